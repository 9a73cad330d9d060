"""Which solver a run takes that leaves the choice open: the cheapest whose error, measured on the scene, is allowed.

The scene is marched through once with the coarsest solver that couples cells, for some hundred outer steps. Where it
came through, every level is asked for the velocities under the loads that acted there, and compared with a level that
claims a tenth of the error asked for, or with the finest. What a run asks for, the coupling, is timed in the middle.
"""

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from attrs import evolve, frozen

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.errors import InputError, PartError, RefusedError
from mpad_core.interfaces.values import Configuration
from mpad_core.physics import asking
from mpad_core.physics.auto import Auto
from mpad_core.physics.couplers import coupler
from mpad_core.physics.coupling import typical_speed
from mpad_core.physics.levels import Level, Situation, answer, installed_levels, relative_error
from mpad_core.physics.problem import Problem
from mpad_core.physics.questions import check_needs
from mpad_core.running.march import make_ready
from mpad_core.running.scouting import situations
from mpad_core.scene.compose import compose
from mpad_core.scene.files import load_scene
from mpad_core.scene.spec import Scene

_SITUATIONS = 7
_MOST_STEPS = 300  # outer steps of the march that finds them
_MARGIN = 10.0  # by which the reference is to be better than what is asked for
_MOST_CELLS = 40  # at which solvers are tried: those nearest to the closest pair
_ROUNDING = 1e-11  # of the error: below, neither it nor its estimate means anything
_LEAST_TRUST = 0.1  # an estimate far too large somewhere may be right elsewhere
_CLEARLY = 3.0  # times better is a rung to climb to, since two that err alike agree for nothing
_TIMED = 0.1  # s, and three times at least


@frozen(kw_only=True)
class Trial:
    """What one level is worth in some situations."""

    level: Level
    error: float  # the largest
    trust: float  # the largest ratio of the error to that reported
    seconds: float  # of one coupling


@frozen(kw_only=True)
class Choice:
    """The levels that a run takes, the first to begin with, and why."""

    levels: tuple[str, ...]
    trust: tuple[float, ...]
    reason: str


def settled(scene: Scene) -> Scene:
    """Give the scene with its solver chosen, where it leaves the choice open; else the scene itself.

    Raises
    ------
    InputError
        If no installed solver can treat the scene.
    """
    solver = scene.solver.instance
    if not isinstance(solver, Auto) or solver.levels:
        return scene
    choice = chosen(compose(scene), solver.accuracy, scene.stop.time)
    made = {"levels": choice.levels, "trust": choice.trust, "reason": choice.reason}
    return evolve(scene, solver=evolve(scene.solver, parameters=scene.solver.parameters | made))


def kept_choice(scene: Scene, resolved: Path) -> Scene:
    """Give the scene with the choice that a run of it has written down, if it is a run of this scene."""
    try:
        kept = load_scene(resolved).solver
    except InputError:
        return scene  # that it does not fit is for others to say
    asked = scene.solver.parameters
    same = kept.name == scene.solver.name == Auto.name and kept.parameters["accuracy"] == asked["accuracy"]
    return evolve(scene, solver=kept) if same and not asked["levels"] else scene


def chosen(problem: Problem, accuracy: float, until: float) -> Choice:
    """Try all levels on a problem, and choose.

    Parameters
    ----------
    problem
        What is to be run, by whatever solver.
    accuracy
        Largest relative error of the velocities.
    until
        Time (s) at which the run ends.

    Raises
    ------
    InputError
        If no installed solver can treat the problem.
    """
    levels = [level for level in installed_levels() if np.isfinite(level.claim) and _treats(level, problem)]
    if not levels:
        raise InputError("solver 'auto': no installed solver that states levels can treat this scene; see `mpad parts`")
    if not problem.coupled:
        return Choice(levels=(levels[0].label,), trust=(1.0,), reason="cells are not coupled: no solver is asked")
    places = _scouted(problem, levels, until)
    near = _near(min(places, key=lambda place: place.closest()[0]))
    problem, places = problem.only(near), [place.part(near) for place in places]
    reference, expected = _expected(problem, levels, accuracy, places)
    trials = tried(problem, levels[: levels.index(reference)], expected, places)
    return _choice(trials, levels[levels.index(reference) :], accuracy, len(places))


def _expected(
    problem: Problem, levels: Sequence[Level], accuracy: float, places: Sequence[Situation]
) -> tuple[Level, list[Array]]:
    """Give the level to compare with, and what it says: the coarsest that is fine enough, and does not refuse.

    Raises
    ------
    RefusedError
        If every level refuses somewhere, with what the last one says.
    """
    fine = [level for level in levels if _MARGIN * level.claim <= accuracy]
    coarse = levels[: len(levels) - len(fine)]
    for reference in (*fine, *reversed(coarse)):
        try:
            return reference, [moved for moved, _ in _moves(problem, reference, places)]
        except (RefusedError, PartError) as error:
            refusal = error
    raise refusal


def _treats(level: Level, problem: Problem) -> bool:
    try:
        check_needs(level.solver.traits, level.name, _start(problem).configuration, problem.setting)
    except InputError:
        return False
    return True


def _scouted(problem: Problem, levels: Sequence[Level], until: float) -> list[Situation]:
    """March with the coarsest level that couples cells and does not refuse; without heat, which would take long."""
    for level in sorted(levels, key=lambda level: not level.solver.traits.coupling):
        try:
            machine = make_ready(evolve(problem, solver=level.solver, thermal_energy=0.0))
            return situations(machine, until, _SITUATIONS, _MOST_STEPS)
        except (RefusedError, PartError):
            continue
    return [_start(problem)]


def _start(problem: Problem) -> Situation:
    at = Configuration(centres=problem.start, radii=problem.radii)
    return Situation(configuration=at, loads=problem.external, held=np.flatnonzero(problem.held))


def _near(place: Situation) -> Indices:
    """Give the cells nearest to the closest pair, where there are too many for the reference; else all."""
    centres = place.configuration.centres
    distance = np.linalg.norm(centres - centres[place.closest()[1]].mean(axis=0), axis=1)
    return np.sort(np.argsort(distance, kind="stable")[:_MOST_CELLS])


def tried(
    problem: Problem, levels: Sequence[Level], expected: Sequence[Array], places: Sequence[Situation]
) -> list[Trial]:
    """Compare levels with what is expected in some situations; those that refuse or fail anywhere are left out."""
    trials = []
    for level in levels:
        try:
            found = _moves(problem, level, places)
            seconds = _seconds(problem, level, places[len(places) // 2])
        except (RefusedError, PartError):
            continue
        errors = np.array([
            relative_error(u, v, place.configuration.radii)
            for (u, _), v, place in zip(found, expected, places, strict=True)
        ])  # fmt: skip
        ratios = (errors + _ROUNDING) / (np.array([reported for _, reported in found]) + _ROUNDING)
        trust = float(max(ratios.max(), _LEAST_TRUST))
        if not np.isfinite(trust):
            continue
        trials.append(Trial(level=level, error=float(errors.max()), trust=trust, seconds=seconds))
    return trials


def _moves(problem: Problem, level: Level, places: Sequence[Situation]) -> list[tuple[Array, float]]:
    with asking.blamed(f"solver {level.name!r}"):
        plan = level.solver.plan(problem.setting)
    speed = typical_speed(problem)
    found = [answer(level.solver, plan, problem.setting, place, speed) for place in places]
    return [(motion.velocity, motion.report.error) for motion in found]


def _seconds(problem: Problem, level: Level, place: Situation) -> float:
    """Time one coupling, the first one left out, which may compile."""
    asked = coupler(evolve(problem, solver=level.solver))
    guess, spent = asked.at(place.configuration, place.loads, None).guess, [time.perf_counter()]
    while len(spent) < 4 or spent[-1] < spent[0] + _TIMED:
        asked.at(place.configuration, place.loads, guess)
        spent.append(time.perf_counter())
    return float(np.diff(spent).min())


def _choice(trials: Sequence[Trial], finest: Sequence[Level], accuracy: float, places: int) -> Choice:
    """Take the cheapest trial that is good enough; the better ones are there to climb to, reference and finer last."""
    good = sorted((trial for trial in trials if trial.error <= accuracy), key=lambda trial: trial.seconds)
    ladder = good[:1]
    for trial in sorted(trials, key=lambda trial: trial.seconds):
        if good and _CLEARLY * trial.error < ladder[-1].error and trial.seconds > ladder[-1].seconds:
            ladder.append(trial)
    labels = [trial.level.label for trial in ladder] + [level.label for level in finest]
    trusts = [float(f"{trial.trust:.3g}") for trial in ladder] + [1.0] * len(finest)
    return Choice(levels=tuple(labels), trust=tuple(trusts), reason=_reason(trials, good, finest[0], accuracy, places))


def _reason(trials: Sequence[Trial], good: Sequence[Trial], reference: Level, accuracy: float, places: int) -> str:
    against = f"errors against {reference.label!r} in {places} situations of the scene"
    tried_out = "; ".join(
        f"{trial.level.label}: {trial.error:.2g} in {1e3 * trial.seconds:.3g} ms"
        for trial in sorted(trials, key=lambda trial: trial.seconds)
    )
    if good:
        return f"{good[0].level.label!r} is the cheapest within {accuracy:g}: {against}: {tried_out}"
    doubt = f", which claims {reference.claim:g} itself," if reference.claim > accuracy else ""
    return f"nothing coarser than {reference.label!r}{doubt} is within {accuracy:g}: {against}: {tried_out or 'none'}"
