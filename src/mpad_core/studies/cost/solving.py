"""One level of a solver in the situations of a scene: how wrong it is, and what a solve takes.

Times are of compiled code, the least of several tries in each situation and the median over the situations.
"""

import tracemalloc
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from attrs import evolve, frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.physics.couplers import coupler
from mpad_core.physics.coupling import typical_speed
from mpad_core.physics.levels import Level, Situation, answer, relative_error
from mpad_core.physics.problem import Problem
from mpad_core.studies.cost.paths import Clock
from mpad_core.studies.cost.rows import SOLVE, Row

_TRIES = 3, 20  # of one solve, at least and at most, to find the least time
_LONG_ENOUGH = 0.1  # s of tries in each situation
_TIMED = 6  # situations in which solves are timed


@frozen(kw_only=True, eq=False)
class Answers:
    """A solver's velocities (N, 6) in every situation, and the errors that it reports."""

    velocities: tuple[Array, ...]
    reported: tuple[float, ...]


@frozen(kw_only=True, eq=False)
class Errors:
    """How far answers are from others, in each situation."""

    whole: Array  # relative 2-norm of (U, aΩ)
    normal: Array  # of the velocities normal to the wall alone


def answers(solver: MobilitySolver, problem: Problem, situations: Sequence[Situation]) -> Answers:
    """Ask a solver for the motion in every situation.

    Raises
    ------
    RefusedError, PartError
        If it refuses one of them, or fails.
    """
    plan, speed = solver.plan(problem.setting), typical_speed(problem)
    motions = [answer(solver, plan, problem.setting, at, speed) for at in situations]
    return Answers(
        velocities=tuple(motion.velocity for motion in motions),
        reported=tuple(motion.report.error for motion in motions),
    )


def errors(found: Answers, expected: Answers, radii: Array) -> Errors:
    """Give the errors of answers against others."""
    pairs = list(zip(found.velocities, expected.velocities, strict=True))
    return Errors(
        whole=np.array([relative_error(one, other, radii) for one, other in pairs]),
        normal=np.array([_normal_error(one, other) for one, other in pairs]),
    )


def _normal_error(found: Array, expected: Array) -> float:
    size = float(np.linalg.norm(expected[:, 2]))
    wrong = float(np.linalg.norm(found[:, 2] - expected[:, 2]))
    return wrong / size if size > 0 else wrong


def solve_row(level: Level, problem: Problem, situations: Sequence[Situation]) -> tuple[Row, Answers]:
    """Measure a level in all situations; its errors are filled in once there is a reference.

    Raises
    ------
    RefusedError, PartError
        If it refuses one of them, or fails.
    """
    found = answers(level.solver, problem, situations)  # also compiles what is not compiled yet
    row = Row(
        study=SOLVE,
        label=level.label,
        line=level.name,
        claimed=level.claim,
        reported=float(np.median(found.reported)),
        setup=_setup_time(level, problem, situations[0]),
        memory=_memory(level, problem, situations[0]),
    )
    spent, refreshed = _times(level, problem, situations)
    return evolve(row, time=spent, refresh=refreshed), found


def with_errors(row: Row, found: Errors, bound: float) -> Row:
    """Fill in a row's errors."""
    middle, worst, normal = np.median(found.whole), found.whole.max(), np.median(found.normal)
    return evolve(row, error=float(middle), worst=float(worst), normal=float(normal), bound=bound)


def _setup_time(level: Level, problem: Problem, situation: Situation) -> float:
    clock = Clock()
    answers(level.solver, problem, [situation])
    return clock.read()


def _memory(level: Level, problem: Problem, situation: Situation) -> float:
    """Give the bytes that numpy allocated at most at one time; what compiled code allocates is not seen."""
    plan, speed = level.solver.plan(problem.setting), typical_speed(problem)
    tracemalloc.start()
    try:
        answer(level.solver, plan, problem.setting, situation, speed)
        return float(tracemalloc.get_traced_memory()[1])
    finally:
        tracemalloc.stop()


def _times(level: Level, problem: Problem, situations: Sequence[Situation]) -> tuple[float, float]:
    """Give the times (s) of a solve from nothing, and of a coupling as a run asks for it."""
    chosen = [situations[k] for k in np.unique(np.linspace(0, len(situations) - 1, _TIMED).astype(int))]
    plan = level.solver.plan(problem.setting)
    coupling = coupler(problem, plan)

    def solve(at: Situation) -> Callable[[], Any]:
        return lambda: level.solver.solve(level.solver.prepare(plan, at.configuration), at.loads)

    def refresh(at: Situation) -> Callable[[], Any]:
        return lambda: coupling.at(at.configuration, at.loads, None)

    solving, refreshing = ([least_time(act(at)) for at in chosen] for act in (solve, refresh))
    return float(np.median(solving)), float(np.median(refreshing))


def least_time(act: Callable[[], Any]) -> float:
    """Give the least time (s) that an act takes over some tries; the first, which may compile, does not count."""
    act()
    spent: list[float] = []
    while len(spent) < _TRIES[0] or (len(spent) < _TRIES[1] and sum(spent) < _LONG_ENOUGH):
        clock = Clock()
        act()
        spent.append(clock.read())
    return min(spent)
