"""The scene's path without bonds, run with each solver and compared."""

from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np
from attrs import evolve, frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import MpadError
from mpad_core.interfaces.mobility import Laddered
from mpad_core.physics.problem import Problem
from mpad_core.running.march import make_ready
from mpad_core.scene.compose import compose
from mpad_core.studies.cost.paths import Outcome, Way, travel
from mpad_core.studies.cost.reference import finer_than
from mpad_core.studies.cost.rows import RUN, Row
from mpad_core.studies.cost.solves import Tried
from mpad_core.studies.cost.subject import Subject, ends_of
from mpad_core.studies.measures.estimates import Estimate

_USUAL_FACTOR = 2.5  # in time, from a level to a finer setting


@frozen(kw_only=True, eq=False)
class Run:
    """One run, and what it is compared by; or why there is none."""

    row: Row
    found: Array | None = None  # µm


def judged(runs: Sequence[Run], finer: Run | None = None) -> tuple[Row, ...]:
    """Give the rows with their errors against the last that ran: the median of the absolute differences, and the worst.

    How far that is from the truth is told by a finer one, or else by the one before it.
    """
    ran = [run for run in runs if run.found is not None]
    if not ran:
        return tuple(run.row for run in runs)
    other = finer or (ran[-2] if len(ran) > 1 else None)
    bound = _middle(_difference(ran[-1], other)) if other else np.inf
    return tuple(_judged(run, ran[-1], bound, other.row.label if other else "") for run in runs)


def _judged(run: Run, reference: Run, bound: float, against: str) -> Row:
    if run.found is None:
        return run.row
    if run is reference:
        return evolve(run.row, error=bound, bound=bound, reference=True, against=against)
    wrong = _difference(run, reference)
    return evolve(run.row, error=_middle(wrong), worst=float(np.nanmax(wrong, initial=0.0)), bound=bound)


def _difference(one: Run, other: Run) -> Array:
    assert one.found is not None
    assert other.found is not None
    return np.abs(one.found - other.found)


def _middle(wrong: Array) -> float:
    known = wrong[np.isfinite(wrong)]
    return float(np.median(known)) if len(known) else np.nan


def run_of(study: str, label: str, line: str, outcome: Outcome, way: Way) -> Run:
    """Give the row of a run, without its errors, and what it is compared by."""
    found = outcome.of(way)
    values = {name: Estimate(1e3 * float(x)) for name, x in zip(outcome.names(), found, strict=True)}
    return Run(row=Row(study=study, label=label, line=line, time=way.took, values=values), found=found)


def solver_runs(subject: Subject, tried: Sequence[Tried], budget: float) -> Iterator[tuple[Row, ...]]:
    """Run the path without bonds with every level, the cheapest first, and the finest with a finer setting still.

    Parameters
    ----------
    subject
        With an outcome.
    tried
        The levels, the finest last.
    budget
        s, of computing; what does not fit is said to be left out.

    Yields
    ------
    The rows after each run.
    """
    own = _quiet_way(subject, subject.problem)
    runs = _of_ladder(subject, own)
    for k in sorted(range(len(tried)), key=lambda k: _spent(tried[k].row)):
        needed = own.took + own.steps * max(_spent(tried[k].row) - _own_refresh(subject, tried), 0.0)
        runs[k] = _level_run(subject, tried[k], needed, budget)
        budget -= runs[k].row.time if runs[k].found is not None else 0.0
        yield judged(_in_order(runs))
    ran = [k for k in sorted(runs) if k >= 0 and runs[k].found is not None]
    if ran and _USUAL_FACTOR * runs[ran[-1]].row.time <= budget:
        yield judged(_in_order(runs), _finer_run(subject, tried[ran[-1]]))


def _in_order(runs: dict[int, Run]) -> list[Run]:
    return [runs[k] for k in sorted(runs)]


def _of_ladder(subject: Subject, own: Way) -> dict[int, Run]:
    """Give the run of the scene's own solver, if that stands for others and so is no level."""
    name = subject.scene.solver.name
    assert subject.outcome is not None
    return {-1: run_of(RUN, name, name, subject.outcome, own)} if isinstance(own.problem.solver, Laddered) else {}


def _finer_run(subject: Subject, finest: Tried) -> Run | None:
    """Run the path with a finer setting than that of the finest level; None where there is none."""
    assert subject.outcome is not None
    problem = subject.problem_with(finest.level)
    for solver, label in finer_than(finest.level):
        with suppress(MpadError):
            return run_of(RUN, label, "", subject.outcome, _quiet_way(subject, evolve(problem, solver=solver)))
    return None


def _spent(row: Row) -> float:
    return row.refresh if np.isfinite(row.refresh) else 0.0


def _own_refresh(subject: Subject, tried: Sequence[Tried]) -> float:
    """Give what a coupling costs the scene's own solver; nothing known of one that stands for others."""
    own = subject.problem.solver
    return next((_spent(one.row) for one in tried if one.level.solver == own), 0.0)


def _quiet_way(subject: Subject, problem: Problem) -> Way:
    machine = subject.quieted(problem)
    return travel(machine, subject.until, ends_of(subject.scene, machine.problem))


def _level_run(subject: Subject, one: Tried, needed: float, budget: float) -> Run:
    """Run the path with a level, or say why not; `needed` is the time (s) that it should take."""
    assert subject.outcome is not None
    row = Row(study=RUN, label=one.level.label, line=one.level.name, claimed=one.level.claim)
    if one.answers is None:
        return Run(row=evolve(row, note=one.row.note))
    if needed > budget:
        return Run(row=evolve(row, note=f"not run: would take some {needed:.2g} s; add --long"))
    try:
        way = _quiet_way(subject, subject.problem_with(one.level))
    except MpadError as error:
        return Run(row=evolve(row, note=f"refused: {' '.join(str(error).split())}"))
    return run_of(RUN, row.label, row.line, subject.outcome, way)


def seeds_differ(subject: Subject, seeds: int = 2) -> float:
    """Give by how much (µm) other seeds of the scene differ from its own run, in the median; NaN where none can."""
    if subject.outcome is None:
        return float("nan")
    own, wrong = subject.outcome.of(subject.own), []
    for replicate in range(1, seeds + 1):
        problem = compose(subject.scene, replicate)
        way = travel(make_ready(problem), subject.until, ends_of(subject.scene, problem))
        wrong.append(np.abs(subject.outcome.of(way) - own))
    return _middle(np.concatenate(wrong))
