"""Exact clocks for rates that change on the way; compiled.

A cell's next event happens when the hazard of all that can happen to it, integrated over time, has used up a random
number that is exponential with mean one (Anderson, J. Chem. Phys. 127 (2007) 214107). Over a sub-step the hazard is
taken at the two points of Gauss and Legendre, which integrates cubics exactly, and by the straight line through both
where the time of an event is asked for. So nothing depends on how time is cut into sub-steps but through the path.
"""

import math

from mpad_core.numerics.compiled import compiled_lean
from mpad_core.numerics.streams import Stream, Word, uniform_pair

EARLY, LATE = 0.5 - math.sqrt(1 / 12), 0.5 + math.sqrt(1 / 12)  # the points, as shares of the sub-step
_CLOCKS = int(Stream.CLOCKS)


@compiled_lean
def drawn(key: Word, owner: Word, count: int) -> float:
    """Draw how much hazard a cell may use up before its event number `count`."""
    return -math.log(uniform_pair(key, _CLOCKS, owner, count)[0])


@compiled_lean
def choice(key: Word, owner: Word, count: int) -> float:
    """Draw, uniformly between 0 and 1, which of all that could happen is event number `count`."""
    return uniform_pair(key, _CLOCKS, owner, count)[1]


@compiled_lean
def used(early: float, late: float, dt: float) -> float:
    """Give the hazard integrated over a sub-step, of the rates at its two points."""
    return 0.5 * (early + late) * dt


@compiled_lean
def used_until(share: float, early: float, late: float, dt: float) -> float:
    """Give the hazard integrated over the first `share` of a sub-step."""
    slope = (late - early) / (LATE - EARLY)
    return max((early + (0.5 * share - EARLY) * slope) * share * dt, 0.0)


@compiled_lean
def share_until(left: float, early: float, late: float, dt: float) -> float:
    """Give the share of a sub-step over which `left` is used up; infinity if more is left than the whole uses."""
    if not used(early, late, dt) >= left:
        return math.inf
    slope = (late - early) / (LATE - EARLY)
    start = early - EARLY * slope
    # start s + slope s²/2 = left/dt, by the form of the root that loses no digits
    root = math.sqrt(max(start * start + 2 * slope * left / dt, 0.0))
    return min(2 * left / dt / (start + root), 1.0)
