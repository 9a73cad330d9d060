"""What a study of cost has found: one row for each thing that was tried, and which of them nothing beats."""

import math
from collections.abc import Sequence

import numpy as np
from attrs import field, frozen

from mpad_core.studies.measures.estimates import Estimate

# what is varied: the solver, in single solves, in paths without bonds and in whole runs; the tolerances
SOLVE, RUN, LONG, POSITION, RATE = "solve", "run", "long", "position", "rate"


@frozen(kw_only=True)
class Row:
    """One thing that was tried: how wrong it is, and what it takes.

    Errors of solves are relative, those of runs and of the tolerance of positions in µm, those of rates relative.
    """

    study: str
    label: str
    line: str  # what it is a level of: a solver, or a tolerance
    error: float = math.nan  # median
    worst: float = math.nan
    normal: float = math.nan  # median, of the velocities normal to the wall alone
    claimed: float = math.nan
    reported: float = math.nan  # median of what the solver itself says
    bound: float = 0.0  # below this an error cannot be told from that of the reference
    time: float = math.nan  # s, of one solve or of one run
    refresh: float = math.nan  # s, of one coupling as a run asks for it
    setup: float = math.nan  # s, of a new plan and its first solve, compiled
    memory: float = math.nan  # bytes that numpy held at most while preparing and solving
    reference: bool = False
    against: str = ""  # what the reference's own error was told by
    values: dict[str, Estimate] = field(factory=dict)  # what came out, by what it is
    note: str = ""  # why there is nothing, where there is nothing

    @property
    def known_error(self) -> float:
        """The error, or the bound below which it cannot be told."""
        return max(self.error, self.bound)

    @property
    def below(self) -> bool:
        """Whether the error is only known to be below the bound."""
        return self.error <= self.bound


def front(rows: Sequence[Row]) -> list[bool]:
    """Tell for each row of one study whether no other is both as good and faster, or as fast and better."""
    places = [(row.time, row.known_error) for row in rows]
    return [bool(np.isfinite(own).all()) and not any(_beats(other, own) for other in places) for own in places]


def _beats(one: tuple[float, float], other: tuple[float, float]) -> bool:
    return one != other and one[0] <= other[0] and one[1] <= other[1]
