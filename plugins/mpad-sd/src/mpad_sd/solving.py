"""From a configuration to velocities."""

import numpy as np
from attrs import evolve, frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import RefusedError, refused
from mpad_core.interfaces.values import Configuration, Motion, Report, Setting
from mpad_core.numerics.harmonics.degrees import Degrees
from mpad_core.numerics.harmonics.dense import Dense
from mpad_core.numerics.harmonics.far import far_of
from mpad_core.numerics.harmonics.fluctuating import divergence_of, root_of
from mpad_core.numerics.harmonics.levels import Flow, Level, Scene
from mpad_core.numerics.harmonics.products import solved
from mpad_core.numerics.harmonics.warm import kept, started
from mpad_core.numerics.neighbours import closest_pair
from mpad_sd.accuracy import error_of, feigned_by, missed_afar
from mpad_sd.near import degrees_of
from mpad_sd.refusing import refuse_bad, refuse_loads

MATRIX = 1e-9
"""Residual for the columns of a mobility matrix, whose weakest motions feel it."""

DENSE = 6000
"""Coefficients of all spheres up to which the equations are one matrix for a whole mobility: 0.3 GB, 3 s."""

TOGETHER = 16
"""Right-hand sides whose sources are held at a time."""


@frozen(kw_only=True)
class Plan:
    """The setting, and how the equations are solved."""

    setting: Setting
    tolerance: float
    strain: bool
    least_gap: float
    reach: float

    def prepared(self, configuration: Configuration, guess: Array | None) -> "Prepared":
        """Check the configuration, find near pairs and form the blocks."""
        refuse_bad(configuration, self.setting)
        scene = self._scene(configuration)
        degrees = degrees_of(scene.centres, scene.radii, scene.gaps, scene.wall, self.reach)
        with refused("sd", lambda: closest(configuration)):
            level = level_of(scene, degrees)
        feigned = feigned_by(configuration, self.least_gap, self.setting.wall)
        return Prepared(plan=self, degrees=degrees, level=level, feigned=feigned, guess=guess)

    def _scene(self, configuration: Configuration) -> Scene:
        """Put what touches to the least gap from the wall; pairs are put so for lubrication alone."""
        centres, radii, gaps = configuration.centres, configuration.radii, configuration.wall_gaps
        if self.setting.wall and (gaps < self.least_gap * radii).any():
            centres, gaps = centres.copy(), np.maximum(gaps, self.least_gap * radii)
            centres[:, 2] = np.maximum(centres[:, 2], radii)
        return Scene(
            centres=centres,
            radii=radii,
            gaps=gaps,
            flow=Flow(self.setting.shear_rate, self.setting.shear_rate if self.strain else 0.0),
            wall=self.setting.wall,
            least_gap=self.least_gap,
        )


def level_of(scene: Scene, degrees: Degrees) -> Level:
    """Form the blocks of near pairs and spheres, and make far pairs ready."""
    far = far_of(scene.centres, scene.radii, degrees.who, scene.wall)
    return Level.of(scene, degrees, lubrication=True, far=far)


def closest(configuration: Configuration) -> str:
    """Name the closest pair, or the sphere closest to the wall where there is no pair, for a message."""
    i, j, gap = closest_pair(configuration.centres, configuration.radii)
    if i == j:
        return f"the gap to the wall is {configuration.wall_gaps.min():.3g} µm"
    return f"the closest spheres are {i} and {j}, gap {gap:.3g} µm"


@frozen(kw_only=True, eq=False)
class Solved:
    """Velocities (K, N, 6), how it went, and the sources (K, n) if they were few."""

    velocity: Array
    report: Report
    sources: Array | None


@frozen(kw_only=True, eq=False)
class Prepared:
    """The equations of a configuration."""

    plan: Plan
    degrees: Degrees
    level: Level
    feigned: float  # relative error that the least gap makes
    guess: Array | None = None

    def solve(self, loads: Array) -> Motion:
        """Solve for each column, or by the mobility matrix where there are as many as it has."""
        refuse_loads(loads)
        units = self.level.units
        columns = np.moveaxis(loads.reshape(len(units), 6, -1), 2, 0) / (self.plan.setting.viscosity * units)
        if len(columns) >= units.size:
            found = self._by_matrix(columns)
        else:
            found = self._solved(self.level.ambient, columns + self.level.load, self.plan.tolerance)
        velocity = np.moveaxis(found.velocity, 0, 2).reshape(loads.shape)
        guess = None if found.sources is None else kept(self.level.system.at, found.sources)
        return Motion(velocity=velocity, report=found.report, guess=guess)

    def _by_matrix(self, columns: Array) -> Solved:
        """Multiply with the mobility, made symmetric, and add the free motion."""
        if len(self.level.ambient) <= DENSE:
            return self._by_elimination(columns)
        tolerance, units = min(self.plan.tolerance, MATRIX), self.level.units
        unit = np.eye(units.size).reshape(units.size, *units.shape)
        found = self._solved(np.zeros_like(self.level.ambient), unit, tolerance)
        mobility = self._symmetric((found.velocity * units).reshape(units.size, units.size))
        free = self._solved(self.level.ambient, self.level.load[None], tolerance)
        moved = columns.reshape(len(columns), -1) @ mobility
        report = evolve(found.report, error=max(found.report.error, free.report.error))  # those of unit loads
        return Solved(velocity=moved.reshape(columns.shape) / units + free.velocity, report=report, sources=None)

    def _by_elimination(self, columns: Array) -> Solved:
        """Form the equations as one matrix, and solve them for all columns."""
        dense, units = Dense.of(self.level), self.level.units
        mobility = self._symmetric(np.asarray(np.linalg.inv(dense.resistance), dtype=np.float64))
        moved = (columns.reshape(len(columns), -1) + dense.load) @ mobility
        u, y = moved.reshape(columns.shape), dense.sources(moved)
        report = Report(error=self._error(self.level.ambient, columns + self.level.load, y, u))
        return Solved(velocity=u / units, report=report, sources=y if len(columns) <= TOGETHER else None)

    def _error(self, ambient: Array, loads: Array, y: Array, u: Array) -> float:
        """Give the largest of the columns' errors; velocities in the units of `layout`."""
        system = self.level.system
        lonely = np.ones(len(system.at.degrees), np.int64)
        lonely[self.degrees.who] = 0
        each = (error_of(system, ambient, *column, lonely) for column in zip(loads, y, u, strict=True))
        return max(each) * missed_afar(system, self.plan.reach) + self.feigned

    def _symmetric(self, mobility: Array) -> Array:
        """Give the symmetric part, in the units of `layout`.

        Raises
        ------
        RefusedError
            If it is not positive definite, as it may be where what a short reach leaves out outweighs a tight contact.
        """
        scene, symmetric = self.level.scene, 0.5 * (mobility + mobility.T)
        try:
            np.linalg.cholesky(symmetric)
        except np.linalg.LinAlgError as error:
            where = closest(Configuration(centres=scene.centres, radii=scene.radii, wall_gaps=scene.gaps))
            fault = f"the mobility is not positive definite with reach {self.plan.reach:g}; choose a larger one"
            raise RefusedError(f"sd: {fault}; {where}") from error
        return symmetric

    def root(self, noise: Array) -> Array:
        """Multiply noise (N, 6) or (N, 6, k) with a root of the mobility."""
        with refused("sd"):
            return root_of(self.level, self.plan.setting.viscosity, noise)

    def drift(self, noise: Array | None) -> Array:
        """Give ∇·M (N, 6), near pairs and degrees staying what they are, by all differences or by a random one."""
        scene = evolve(self.level.scene, flow=Flow(0.0, 0.0))

        def level_at(shift: Array) -> Level:
            moved = evolve(scene, centres=scene.centres + shift, gaps=scene.gaps + shift[:, 2])
            return level_of(moved, self.degrees)

        with refused("sd"):
            return divergence_of(self.level, level_at, self.plan.setting.viscosity, noise)

    def _solved(self, ambient: Array, loads: Array, tolerance: float) -> Solved:
        """Solve for loads (K, N, 6), corrections included, a few at a time: sources take more room than velocities.

        Raises
        ------
        RefusedError
            If the iteration does not converge.
        """
        system, velocity = self.level.system, np.empty(loads.shape)
        start = started(self.guess, len(loads), system.at)
        error, iterations, residual = 0.0, 0, 0.0
        for first in range(0, len(loads), TOGETHER):
            some = slice(first, first + TOGETHER)
            given = np.ascontiguousarray(loads[some])
            y = np.zeros((len(given), system.at.own[-1])) if start is None else start[some].copy()
            with refused("sd"):
                u, done, left = solved(self.level, ambient, given, tolerance, y)
            velocity[some] = u
            iterations, residual = max(iterations, done), max(residual, left)
            error = max(error, self._error(ambient, given, y, u * self.level.units))
        report = Report(error=error + residual, iterations=iterations, residual=residual)
        return Solved(velocity=velocity, report=report, sources=y if len(loads) <= TOGETHER else None)
