"""From a configuration to velocities: two levels of degrees, whose difference is the estimate of the error."""

import numpy as np
from attrs import evolve, frozen

from mpad_cdlbiem.refusing import refuse_bad, refuse_loads
from mpad_core.arrays import Array
from mpad_core.interfaces.errors import refused
from mpad_core.interfaces.values import Configuration, Motion, Report, Setting
from mpad_core.numerics.harmonics.degrees import (
    Degrees,
    choose,
    coarser,
    extrapolated,
    most_degree,
    most_degrees,
    spread_of,
)
from mpad_core.numerics.harmonics.fluctuating import divergence_of, root_of
from mpad_core.numerics.harmonics.levels import Flow, Level, Scene
from mpad_core.numerics.harmonics.products import solved
from mpad_core.numerics.harmonics.warm import between, kept, started

BLOCK = 1e-8
"""Residual for several right-hand sides: together they may be a mobility matrix, to be symmetric to 1e-7."""

FINEST = 1e-8
"""The highest accuracy."""

COARSER = 0.05
"""The coarse level only tells an error: its iteration may stop at this part of the accuracy."""


@frozen(kw_only=True)
class SpectralPlan:
    """The setting, and what accuracy is asked for."""

    setting: Setting
    accuracy: float
    degree: int | None
    lubrication: bool
    tolerance: float

    def prepared(self, configuration: Configuration, guess: Array | None) -> "Prepared":
        """Check the configuration, choose degrees and form the blocks."""
        refuse_bad(configuration, self.setting)
        scene = self._scene(configuration)
        fine = self._degrees(scene)
        coarse = coarser(fine)
        return Prepared(
            plan=self,
            coarse=self._level(scene, coarse),
            fine=self._level(scene, fine),
            degrees=fine,
            share=extrapolated(fine, coarse),
            guess=guess,
        )

    def level(self, configuration: Configuration, degrees: Degrees) -> Level:
        """Form the blocks at given degrees, without the means to tell their error."""
        refuse_bad(configuration, self.setting)
        return self._level(self._scene(configuration), degrees)

    def _scene(self, configuration: Configuration) -> Scene:
        return Scene(
            centres=configuration.centres,
            radii=configuration.radii,
            gaps=configuration.wall_gaps,
            flow=Flow(self.setting.shear_rate, self.setting.shear_rate),
            wall=self.setting.wall,
        )

    def _level(self, scene: Scene, degrees: Degrees) -> Level:
        with refused("cdl-biem"):
            return Level.of(scene, degrees, self.lubrication)

    def _degrees(self, scene: Scene) -> Degrees:
        most = most_degrees(most_degree(self.accuracy), scene.radii)
        # of a degree that is given, what it lacks is added however little it is
        spread = spread_of(self.accuracy if self.degree is None else FINEST)
        return choose(scene.centres, scene.radii, scene.gaps, scene.wall, spread, most, self.degree or 0)


@frozen(kw_only=True, eq=False)
class Prepared:
    """A configuration at the degrees that answer, and at the lower ones that tell how good the answer is."""

    plan: SpectralPlan
    coarse: Level
    fine: Level
    degrees: Degrees  # of the fine level
    share: float  # of the difference between the levels that is the fine one's error
    guess: Array | None = None

    def solve(self, loads: Array) -> Motion:
        """Solve at both levels, each starting from the other or from the guess."""
        refuse_loads(loads)
        n = len(self.fine.scene.radii)
        columns = np.moveaxis(loads.reshape(n, 6, -1), 2, 0) / self.plan.setting.viscosity
        start = started(self.guess, len(columns), self.fine.system.at)
        if start is None:
            rough = np.zeros((len(columns), self.coarse.system.at.own[-1]))
        else:
            rough = between(self.fine.system.at, self.coarse.system.at, start)
        tolerance = self.plan.tolerance if len(columns) == 1 else min(self.plan.tolerance, BLOCK)
        lower, _, _ = self._solved(self.coarse, columns, rough, max(COARSER * self.plan.accuracy, self.plan.tolerance))
        y = between(self.coarse.system.at, self.fine.system.at, rough) if start is None else start
        velocity, iterations, residual = self._solved(self.fine, columns, y, tolerance)
        report = Report(error=self._error(velocity, lower) + 0.1 * residual, iterations=iterations, residual=residual)
        motion = np.moveaxis(velocity, 0, 2).reshape(loads.shape)
        return Motion(velocity=motion, report=report, guess=kept(self.fine.system.at, y))

    def root(self, noise: Array) -> Array:
        """Multiply noise (N, 6) or (N, 6, k) with a root of the mobility."""
        with refused("cdl-biem"):
            return root_of(self.fine, self.plan.setting.viscosity, noise)

    def drift(self, noise: Array | None) -> Array:
        """Give ∇·M (N, 6) of the fine level at its degrees, by all differences or by one random difference."""
        still = evolve(self.plan, setting=evolve(self.plan.setting, shear_rate=0.0))
        scene = self.fine.scene
        at = Configuration(centres=scene.centres, radii=scene.radii, wall_gaps=scene.gaps)
        with refused("cdl-biem"):
            return divergence_of(
                self.fine, lambda shift: still.level(at.moved(shift), self.degrees), still.setting.viscosity, noise
            )

    def _solved(self, level: Level, columns: Array, y: Array, tolerance: float) -> tuple[Array, int, float]:
        """Solve at one level; `y` is the first guess and becomes the answer. Velocities (K, N, 6)."""
        loads = np.ascontiguousarray(columns / level.units + level.load)
        with refused("cdl-biem"):
            return solved(level, level.ambient, loads, tolerance, y)

    def _error(self, velocity: Array, lower: Array) -> float:
        """Estimate the relative error of (U, aΩ) by what the last degrees changed; the worst of all columns."""
        scale = np.ones_like(velocity[0])
        scale[:, 3:] = self.fine.scene.radii[:, None]
        change = np.sqrt((((velocity - lower) * scale) ** 2).sum(axis=(1, 2)))
        size = np.sqrt(((velocity * scale) ** 2).sum(axis=(1, 2)))
        return self.share * float(np.max(np.divide(change, size, out=np.zeros_like(size), where=size > 0), initial=0.0))

    def flow(self, motion: Motion, points: Array) -> Array:
        """Give the fluid's velocity (n, 3) at points (n, 3)."""
        from mpad_cdlbiem.spectral.fields import flow_at

        return flow_at(self.fine, self._sources(motion), points)

    def stresslets(self, motion: Motion) -> Array:
        """Give the stresslets (N, 3, 3) of a motion under one load, see `fields.stresslets` (pN µm)."""
        from mpad_cdlbiem.spectral.fields import stresslets

        return stresslets(self.fine, self._sources(motion), self.plan.setting.viscosity)

    def tractions(self, motion: Motion, sphere: int, directions: Array) -> Array:
        """Give the fluid's tractions (n, 3) on a sphere, see `fields.tractions` (pN/µm²)."""
        from mpad_cdlbiem.spectral.fields import tractions

        return tractions(self.fine, self._sources(motion), self.plan.setting.viscosity, sphere, directions)

    def _sources(self, motion: Motion) -> Array:
        """Give the sources (n,) of a motion of this very configuration under one load."""
        n, at = len(self.fine.scene.radii), self.fine.system.at
        if motion.guess is None or motion.guess.shape != (1, n + at.own[-1]):
            raise ValueError("fields are those of a motion under one load that this configuration was solved for")
        return np.ascontiguousarray(motion.guess[0, n:])
