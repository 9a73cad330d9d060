"""From a configuration to velocities: two levels of degrees, whose difference is the estimate of the error."""

import numpy as np
from attrs import frozen

from mpad_cdlbiem.refusing import refuse_bad, refuse_loads
from mpad_core.arrays import Array
from mpad_core.interfaces.errors import RefusedError
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
from mpad_core.numerics.harmonics.krylov import solve_columns
from mpad_core.numerics.harmonics.levels import Flow, Level, Scene
from mpad_core.numerics.harmonics.warm import between, kept, started

MOST = 600
"""Iterations after which a solve is given up."""

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
        scene = Scene(
            centres=configuration.centres,
            radii=configuration.radii,
            gaps=configuration.wall_gaps,
            flow=Flow(self.setting.shear_rate, self.setting.shear_rate),
            wall=self.setting.wall,
        )
        fine = self._degrees(scene)
        coarse = coarser(fine)
        try:
            levels = [Level.of(scene, degrees, self.lubrication) for degrees in (coarse, fine)]
        except FloatingPointError as error:
            raise RefusedError(f"cdl-biem: {error}") from error
        share = extrapolated(fine, coarse)
        return Prepared(plan=self, coarse=levels[0], fine=levels[1], share=share, guess=guess)

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

    def _solved(self, level: Level, columns: Array, y: Array, tolerance: float) -> tuple[Array, int, float]:
        """Solve at one level; `y` is the first guess and becomes the answer. Velocities (K, N, 6)."""
        u = np.empty(columns.shape)
        loads = np.ascontiguousarray(columns / level.units + level.load)
        iterations, residual = solve_columns(level.system, level.ambient, loads, tolerance, MOST, y, u)
        if not residual <= tolerance:
            raise RefusedError(f"cdl-biem: no convergence: residual {residual:.2g} after {iterations} iterations")
        return u / level.units, iterations, residual

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
