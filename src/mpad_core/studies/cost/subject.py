"""What a study of cost is about: a scene, its own run, and what of it is compared."""

from collections.abc import Sequence

import numpy as np
from attrs import evolve, frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import InputError
from mpad_core.interfaces.mobility import Laddered
from mpad_core.physics.levels import Level, Situation
from mpad_core.physics.problem import Problem
from mpad_core.running.initial import at_rest
from mpad_core.running.march import Machine, make_ready, march
from mpad_core.running.scouting import situations
from mpad_core.running.stopping import first_that_holds
from mpad_core.scene.compose import compose
from mpad_core.scene.spec import Part, Scene
from mpad_core.studies.conditions import stop_conditions
from mpad_core.studies.cost.paths import AtPlaces, AtTime, Clock, Ends, Outcome, Way, first_free, travel
from mpad_core.studies.cost.quiet import is_random, quiet

_PLACES = (-75.0, -15.0, 0.0, 15.0, 30.0, 60.0)  # µm, unless others are asked for
_EVENLY = 6  # places, where fewer than half of those lie on the way
_PATIENCE = 60.0  # s of computing for the scene's own run


@frozen(kw_only=True, eq=False)
class Subject:
    """A scene, and what it does with its own solver."""

    scene: Scene
    problem: Problem
    cell: int  # that is followed
    own: Way
    until: float  # s, when runs end at the latest: as the scene says, or where its own run was given up
    situations: tuple[Situation, ...]
    outcome: Outcome | None  # what paths without bonds are compared by; none where there is no such path

    def problem_with(self, level: Level) -> Problem:
        """Give the scene's problem with another solver.

        Raises
        ------
        InputError
            If the solver cannot treat it.
        """
        part = Part(kind="solver", name=level.name, parameters=dict(level.parameters))
        return compose(evolve(self.scene, solver=part))

    def quieted(self, problem: Problem) -> Machine:
        """Make ready the paths without bonds and thermal motion."""
        return make_ready(quiet(problem, self.own.centres[0], self.cell))


def ends_of(scene: Scene, problem: Problem, patience: float = np.inf) -> Ends:
    """Give what tells a run's last state: the scene's conditions, or that there is no patience (s) left."""
    clock, conditions = Clock(), stop_conditions(scene)
    return lambda state: bool(first_that_holds(conditions, problem, state)) or clock.read() > patience


def subject_of(scene: Scene, number: int, at: Sequence[float] = ()) -> Subject:
    """Run a scene with its own solver, and choose what is compared.

    Parameters
    ----------
    scene
        Any.
    number
        Of situations along the run.
    at
        Δx (µm) at which passages are compared; some usual ones if left out.

    Raises
    ------
    InputError
        For places that the cell does not come to, or in a scene without a passage.
    RefusedError, PartError
        If the scene's own run fails.
    """
    problem = compose(scene)
    machine = make_ready(problem)
    _compile(machine)
    cell = first_free(problem, (scene.passage.cell,) if scene.passage else ())
    own = travel(machine, scene.stop.time, ends_of(scene, problem, _PATIENCE))
    until = float(own.last.time) if own.took > _PATIENCE else scene.stop.time
    return Subject(
        scene=scene, problem=problem, cell=cell, own=own, until=until, outcome=_outcome(scene, own, cell, at),
        situations=tuple(situations(machine, own.last.time, number)),
    )  # fmt: skip


def _compile(machine: Machine) -> None:
    """Take a few steps, so that nothing is compiled when times are taken."""
    for _ in march(machine, at_rest(machine), machine.pace.longest):
        pass


def _outcome(scene: Scene, own: Way, cell: int, at: Sequence[float]) -> Outcome | None:
    if scene.passage:
        return AtPlaces(cell=cell, dx=_places(own.dx(cell), at))
    if at:
        raise InputError("--at: is for scenes with a [passage]; this one has none")
    if is_random(own.problem):
        return None  # cells that roll by themselves have no path without bonds
    free = tuple(np.flatnonzero(~own.problem.held).tolist())
    return AtTime(cells=free, time=own.last.time, called=tuple(own.problem.names[i] for i in free))


def _places(dx: Array, at: Sequence[float]) -> tuple[float, ...]:
    low, high = float(dx[0]), float(dx.max())
    wrong = [x for x in at if not low <= x <= high]
    if wrong:
        raise InputError(f"--at: the cell goes from dx = {low:.4g} to {high:.4g} um only, not by {wrong[0]:g} um")
    usual = tuple(x for x in _PLACES if low <= x <= high)
    if 2 * len(usual) < len(_PLACES):
        usual = tuple(float(f"{x:.3g}") for x in np.linspace(low, high, _EVENLY + 2)[1:-1])
    return tuple(sorted(at)) or usual


def own_level(scene: Scene, levels: Sequence[Level]) -> Level | None:
    """Give the scene's own solver as a level without a claim; none if it is among those given, or stands for others."""
    solver = scene.solver.instance
    if isinstance(solver, Laddered) or any(level.solver == solver for level in levels):
        return None
    return Level(
        name=scene.solver.name, parameters=_changed(scene.solver), claim=np.inf, reference=False, solver=solver
    )


def _changed(part: Part) -> tuple[tuple[str, object], ...]:
    """Give the parameters of a part that are not its defaults."""
    plain = Part(kind=part.kind, name=part.name).build()
    return tuple((key, value) for key, value in part.parameters.items() if getattr(plain, key, value) != value)
