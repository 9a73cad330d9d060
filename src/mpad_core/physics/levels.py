"""The installed solvers, each at every level of its accuracy; how wrong and how sure of itself one is somewhere."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import evolve, frozen

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.interfaces.mobility import Laddered, MobilitySolver
from mpad_core.interfaces.values import AccuracyLevel, Configuration, Motion, Setting
from mpad_core.physics import asking
from mpad_core.physics.questions import held_loads, unit_load
from mpad_core.plugins import registry


@frozen(kw_only=True)
class Level:
    """A solver at one level of its accuracy."""

    name: str  # of the part
    parameters: tuple[tuple[str, object], ...]
    claim: float  # the error it claims
    reference: bool  # there to compare others with
    solver: MobilitySolver

    @property
    def label(self) -> str:
        """Give the solver and what sets the level, as ``cdl-biem accuracy=0.01``."""
        return " ".join([self.name, *(f"{key}={value}" for key, value in self.parameters)])


def installed_levels(names: Sequence[str] | None = None) -> tuple[Level, ...]:
    """Give every level of the installed solvers (or of those named), the coarsest claim first.

    A solver that states no level counts once, with its defaults and without a claim (infinity). Solvers that stand for
    others (`Laddered`) are left out, and, unless named, those that fail to load: `mpad parts` tells of them.

    Raises
    ------
    InputError, PartError
        If a name is not installed, or a part fails to load.
    """
    found = []
    for name in [part.name for part in registry.installed("solver")] if names is None else names:
        try:
            found += _levels_of(name)
        except (PartError, TypeError, ValueError) as error:
            if names is not None:
                raise error if isinstance(error, PartError) else PartError(f"solver {name!r}: {error}") from error
    return tuple(sorted(found, key=lambda level: -level.claim))


def _levels_of(name: str) -> list[Level]:
    made = registry.load("solver", name)
    if isinstance(made(), Laddered):
        return []
    return [_level(name, made, level) for level in made.traits.levels or (AccuracyLevel(parameters=(), error=np.inf),)]


def _level(name: str, made: type[MobilitySolver], level: AccuracyLevel) -> Level:
    return Level(
        name=name, parameters=level.parameters, claim=level.error, reference=level.reference,
        solver=made(**dict(level.parameters)),
    )  # fmt: skip


def level_named(label: str) -> Level:
    """Find an installed level by its label.

    Raises
    ------
    InputError
        If none is called so.
    """
    name = label.partition(" ")[0]
    known = installed_levels([name])
    for level in known:
        if level.label == label:
            return level
    raise InputError(f"no level {label!r} is installed (there are: {', '.join(level.label for level in known)})")


@frozen(kw_only=True, eq=False)
class Situation:
    """Where the spheres are and what pushes them: one right-hand side."""

    configuration: Configuration
    loads: Array  # (N, 6) pN, pN µm; those on held spheres do not matter
    held: Indices  # spheres whose velocity is zero

    def part(self, cells: Indices) -> "Situation":
        """Give the situation of some of the spheres."""
        held = np.flatnonzero(np.isin(cells, self.held))
        return evolve(self, configuration=self.configuration.part(cells), loads=self.loads[cells], held=held)

    def closest(self) -> tuple[float, Indices]:
        """Give the smallest gap between two spheres (µm), and which they are; infinity and all with fewer."""
        at = self.configuration
        i, j = np.triu_indices(len(at.radii), 1)
        if not len(i):
            return np.inf, np.arange(len(at.radii))
        gaps = np.linalg.norm(at.centres[i] - at.centres[j], axis=1) - at.radii[i] - at.radii[j]
        k = int(np.argmin(gaps))
        return float(gaps[k]), np.array([i[k], j[k]])


def answer(solver: MobilitySolver, plan: Any, setting: Setting, situation: Situation, speed: float) -> Motion:
    """Give the motion in a situation, whose report is of this very right-hand side, the loads on held spheres included.

    Parameters
    ----------
    speed
        Typical of the problem (µm/s); unit loads on held spheres are such as to give about this.
    """
    at, held, loads = situation.configuration, situation.held, situation.loads
    prepared = asking.prepare(solver, plan, at)
    if len(held):
        unit = unit_load(setting.viscosity, float(at.radii.max()), speed)
        loads = held_loads(solver, prepared, loads, held, unit)
    motion = asking.solve(solver, prepared, loads)
    motion.velocity[held] = 0.0
    return motion


def relative_error(found: Array, expected: Array, radii: Array) -> float:
    """Give the relative 2-norm error of (U, aΩ): "the error" everywhere; absolute where nothing should move."""
    weights = np.ones((len(radii), 6))
    weights[:, 3:] = radii[:, None]
    size = np.linalg.norm(weights * expected)
    wrong = np.linalg.norm(weights * (found - expected))
    return float(wrong / size) if size > 0 else float(wrong)
