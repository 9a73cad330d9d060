"""Every level in the situations of a scene: the rows of single solves."""

from collections.abc import Iterator, Sequence

import numpy as np
from attrs import evolve, frozen

from mpad_core.interfaces.errors import MpadError
from mpad_core.physics.levels import Level
from mpad_core.studies.cost.reference import Doubt, doubt, doubt_by_finer
from mpad_core.studies.cost.rows import SOLVE, Row
from mpad_core.studies.cost.solving import Answers, errors, solve_row, with_errors
from mpad_core.studies.cost.subject import Subject


@frozen(kw_only=True, eq=False)
class Tried:
    """A level, what was measured of it, and what it answered; nothing if it refused."""

    level: Level
    row: Row
    answers: Answers | None = None


@frozen(kw_only=True, eq=False)
class Solves:
    """The levels tried so far, the coarsest claim first, and how far the finest that answered may be wrong."""

    tried: tuple[Tried, ...] = ()
    doubt: Doubt | None = None

    @property
    def answered(self) -> list[Tried]:
        """Those that answered."""
        return [one for one in self.tried if one.answers is not None]

    def rows(self, subject: Subject) -> tuple[Row, ...]:
        """Give the rows with their errors against the finest that answered."""
        if not self.answered:
            return tuple(one.row for one in self.tried)
        reference = self.answered[-1]
        return tuple(self._judged(one, reference, subject) for one in self.tried)

    def _judged(self, one: Tried, reference: Tried, subject: Subject) -> Row:
        if one.answers is None or reference.answers is None:
            return one.row
        size, against = (self.doubt.size, self.doubt.against) if self.doubt else (np.inf, "")
        row = with_errors(one.row, errors(one.answers, reference.answers, subject.problem.radii), size)
        if one is not reference:
            return row
        return evolve(row, error=size, worst=np.nan, normal=np.nan, reference=True, against=against)


def solves(subject: Subject, levels: Sequence[Level]) -> Iterator[Solves]:
    """Try every level, the finest claim first since it is the reference; yield what is known after each."""
    so_far = Solves()
    for level in reversed(levels):
        so_far = evolve(so_far, tried=(_tried(subject, level), *so_far.tried))
        if so_far.doubt is None and so_far.answered:
            so_far = evolve(so_far, doubt=_doubt(subject, so_far.answered, level is levels[0]))
        yield so_far


def _tried(subject: Subject, level: Level) -> Tried:
    try:
        row, found = solve_row(level, subject.problem_with(level), subject.situations)
    except MpadError as error:
        note = f"refused: {' '.join(str(error).split())}"
        return Tried(
            level=level, row=Row(study=SOLVE, label=level.label, line=level.name, claimed=level.claim, note=note)
        )
    return Tried(level=level, row=row, answers=found)


def _doubt(subject: Subject, answered: Sequence[Tried], last: bool) -> Doubt | None:
    """Tell how far the finest level may be wrong; None while that waits for the next coarser one."""
    found = [one.answers for one in answered if one.answers is not None]
    if len(answered) == 1:
        by_finer = doubt_by_finer(answered[-1].level, found[-1], subject.problem, subject.situations)
        if by_finer or not last:
            return by_finer
    return doubt([one.level for one in answered], found, subject.problem)
