"""Exact clocks for rates that change on the way; compiled.

A cell's next event happens when the hazard of all that can happen to it, integrated over time, has used up a random
number that is exponential with mean one (Anderson, J. Chem. Phys. 127 (2007) 214107). Over a sub-step the rate is
looked up at the two points of Gauss and Legendre, and taken as the exponential through both, k exp(g s): exact for a
bond of Bell's whose load grows evenly, and to fourth order for any smooth rate, since the error of its logarithm,
proportional to (s − s₁)(s − s₂), has no mean. So nothing depends on how time is cut into sub-steps but by the path.
"""

import math

from mpad_core.numerics.compiled import compiled_lean
from mpad_core.numerics.streams import Stream, Word, uniform_pair

EARLY, LATE = 0.5 - math.sqrt(1 / 12), 0.5 + math.sqrt(1 / 12)  # the points, as shares of the sub-step
_STEADY = 1e-6  # growth below which the exponential is its series
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
def _growth(early: float, late: float) -> float:
    """Give g of the rate k exp(g s) through both, s the share; 0 where one of them is zero: see `used_until`."""
    return math.log(late / early) / (LATE - EARLY) if early > 0.0 and late > 0.0 else 0.0


@compiled_lean
def used_until(share: float, early: float, late: float, dt: float) -> float:
    """Give the hazard integrated over the first `share` of a sub-step.

    Where one of the rates is zero, something has come into reach or left it on the way, and there is no better law than
    their mean.
    """
    growth = _growth(early, late)
    start = early * math.exp(-growth * EARLY) if growth != 0.0 else 0.5 * (early + late)
    mean = math.expm1(growth * share) / growth if abs(growth) > _STEADY else share * (1 + 0.5 * growth * share)
    return start * mean * dt


@compiled_lean
def share_until(left: float, early: float, late: float, dt: float) -> float:
    """Give the share of a sub-step over which `left` is used up; infinity if more is left than the whole uses."""
    whole = used_until(1.0, early, late, dt)
    if not (whole >= left and whole > 0.0):
        return math.inf
    growth = _growth(early, late)
    start = early * math.exp(-growth * EARLY) if growth != 0.0 else 0.5 * (early + late)
    even = left / (start * dt)
    share = math.log1p(growth * even) / growth if abs(growth) > _STEADY else even * (1 - 0.5 * growth * even)
    return min(max(share, 0.0), 1.0)
