"""What a hard case is: something to ask of a solver, what must hold of the answer, and what came out."""

import math
import re
import time
from collections.abc import Callable
from typing import Any

from attrs import evolve, field, frozen

from mpad_core import solver
from mpad_core.interfaces.errors import MpadError
from mpad_core.interfaces.mobility import Laddered, MobilitySolver
from mpad_core.plugins.registry import installed

HOLDS, REFUSED, FAILS = "holds", "refused", "fails"
_NAMES = re.compile(r"spheres? \d|cells? '|point \d|cells\.|has no flow|step \d")  # who or what is at fault
_LONGEST = 400  # characters of one clear line


@frozen(kw_only=True)
class Outcome:
    """What came of a case with one solver; numbers that do not apply are NaN."""

    verdict: str
    why: str = ""  # the refusal in its own words, or what does not hold
    condition: float = math.nan  # of the mobility in Stokes' units
    lowest: float = math.nan  # its lowest eigenvalue
    iterations: int = -1  # of one right-hand side; of a run, its outer steps
    claimed: float = math.nan  # error that the solver reports
    found: float = math.nan  # error found, or for a run what must be small
    seconds: float = math.nan  # of the processor


@frozen(kw_only=True)
class Case:
    """A hard case."""

    name: str
    must: str  # what must hold
    ask: Callable[[MobilitySolver], Outcome]
    dear: tuple[str, ...] = ()  # columns for which it takes long
    may_refuse: bool = True
    only: tuple[str, ...] = field(default=())  # columns it is about; none: all

    def of(self, chosen: MobilitySolver) -> Outcome:
        """Ask; a refusal must be one clear line that says who or what is at fault."""
        began = time.process_time()
        try:
            found = self.ask(chosen)
        except MpadError as error:
            line = str(error)
            clear = "\n" not in line and len(line) < _LONGEST and bool(_NAMES.search(line))
            if not clear:
                found = Outcome(verdict=FAILS, why=f"not a clear refusal: {line!r}")
            elif not self.may_refuse:
                found = Outcome(verdict=FAILS, why=f"must not be refused: {line}")
            else:
                found = Outcome(verdict=REFUSED, why=line)
        return evolve(found, seconds=time.process_time() - began)


def judged(faults: list[str], **numbers: Any) -> Outcome:
    """Give the outcome of an answer of which these things do not hold."""
    return Outcome(verdict=FAILS if faults else HOLDS, why="; ".join(faults), **numbers)


def solvers() -> dict[str, MobilitySolver]:
    """Give every column of the tables: the built-in solvers at their levels, and whatever else is installed.

    Who stands for others (`Laddered`) answers by one of these, and has no column.
    """
    columns = {
        "isolated": solver("isolated"),
        "rpb": solver("rpb"),
        "rpb blake": solver("rpb", lone_sphere="blake"),
        "sd": solver("sd"),
        "cdl-biem 1e-2": solver("cdl-biem", accuracy=1e-2),
        "cdl-biem 1e-3": solver("cdl-biem", accuracy=1e-3),
        "elements 24": solver("cdl-biem", discretisation="elements", elements=24),
        "elements 96": solver("cdl-biem", discretisation="elements", elements=96),
    }
    known = {chosen.name for chosen in columns.values()}
    others = {part.name: solver(part.name) for part in installed("solver") if part.name not in known}
    return columns | {name: other for name, other in others.items() if not isinstance(other, Laddered)}
