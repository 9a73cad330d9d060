"""From a configuration to velocities."""

import numpy as np
from attrs import evolve, frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.values import Configuration, Motion, Report, Setting
from mpad_core.numerics.harmonics.far import far_of
from mpad_core.numerics.harmonics.krylov import solve_columns
from mpad_core.numerics.harmonics.levels import Flow, Level, Scene
from mpad_core.numerics.harmonics.warm import kept, started
from mpad_core.numerics.neighbours import closest_pair
from mpad_sd.accuracy import error_of
from mpad_sd.near import degrees_of
from mpad_sd.refusing import refuse_bad, refuse_loads

MOST = 600
"""Iterations after which a solve is given up."""

MATRIX = 1e-9
"""Residual for the columns of a mobility matrix, whose weakest motions feel it."""

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
        radii, gaps = configuration.radii, configuration.wall_gaps
        scene = Scene(
            centres=self._above_the_wall(configuration),
            radii=radii,
            gaps=np.maximum(gaps, self.least_gap * radii) if self.setting.wall else gaps,
            flow=Flow(self.setting.shear_rate, self.setting.shear_rate if self.strain else 0.0),
            wall=self.setting.wall,
            least_gap=self.least_gap,
        )
        degrees = degrees_of(scene.centres, radii, scene.gaps, scene.wall, self.reach)
        far = far_of(scene.centres, radii, degrees.who, scene.wall)
        try:
            level = Level.of(scene, degrees, lubrication=True, far=far)
        except FloatingPointError as error:
            raise RefusedError(f"sd: {error}; {closest(configuration)}") from error
        return Prepared(plan=self, level=level, guess=guess)

    def _above_the_wall(self, configuration: Configuration) -> Array:
        """Put centres that rounding has brought nearer to the wall than the radius where they touch it."""
        if not self.setting.wall or (configuration.centres[:, 2] >= configuration.radii).all():
            return configuration.centres
        centres = configuration.centres.copy()
        centres[:, 2] = np.maximum(centres[:, 2], configuration.radii)
        return centres


def closest(configuration: Configuration) -> str:
    """Name the closest pair, or the sphere closest to the wall where there is no pair, for a message."""
    i, j, gap = closest_pair(configuration.centres, configuration.radii)
    if i == j:
        return f"the gap to the wall is {configuration.wall_gaps.min():.3g} µm"
    return f"the closest spheres are {i} and {j}, gap {gap:.3g} µm"


@frozen(kw_only=True, eq=False)
class Solved:
    """Velocities (K, N, 6) in the units of `layout`, how it went, and the sources (K, n) if they were few."""

    velocity: Array
    report: Report
    sources: Array | None


@frozen(kw_only=True, eq=False)
class Prepared:
    """The equations of a configuration."""

    plan: Plan
    level: Level
    guess: Array | None = None

    def solve(self, loads: Array) -> Motion:
        """Solve for each column, or by the mobility matrix where there are as many as it has."""
        refuse_loads(loads)
        units = self.level.units
        columns = np.moveaxis(loads.reshape(len(units), 6, -1), 2, 0) / (self.plan.setting.viscosity * units)
        if len(columns) >= units.size:
            solved = self._by_matrix(columns)
        else:
            solved = self._solved(self.level.ambient, columns + self.level.load, self.plan.tolerance)
        velocity = np.moveaxis(solved.velocity / units, 0, 2).reshape(loads.shape)
        guess = None if solved.sources is None else kept(self.level.system.at, solved.sources)
        return Motion(velocity=velocity, report=solved.report, guess=guess)

    def _by_matrix(self, columns: Array) -> Solved:
        """Multiply with the mobility, made symmetric, and add the free motion: errors are those of unit loads."""
        unit, mobility, tolerance = self._matrix()
        free = self._solved(self.level.ambient, self.level.load[None], tolerance)
        velocity = columns.reshape(len(columns), -1) @ mobility + free.velocity.ravel()
        report = evolve(unit, error=max(unit.error, free.report.error))
        return Solved(velocity=velocity.reshape(columns.shape), report=report, sources=None)

    def _matrix(self) -> tuple[Report, Array, float]:
        """Give the mobility (6N, 6N) in the units of `layout`, and how it was found."""
        tolerance, size = min(self.plan.tolerance, MATRIX), self.level.units.size
        unit = np.eye(size).reshape(size, *self.level.units.shape)
        solved = self._solved(np.zeros_like(self.level.ambient), unit, tolerance)
        columns = solved.velocity.reshape(size, size)
        return solved.report, 0.5 * (columns + columns.T), tolerance

    def _solved(self, ambient: Array, loads: Array, tolerance: float) -> Solved:
        """Solve for loads (K, N, 6), corrections included, a few at a time: sources take more room than velocities.

        Raises
        ------
        RefusedError
            If the iteration does not converge.
        """
        system, u = self.level.system, np.empty(loads.shape)
        lonely = np.ones(len(system.at.degrees), np.int64)
        lonely[system.pairs.rows[:, :2]] = 0
        start = started(self.guess, len(loads), system.at)
        error, iterations, residual = 0.0, 0, 0.0
        for first in range(0, len(loads), TOGETHER):
            some = slice(first, first + TOGETHER)
            given = np.ascontiguousarray(loads[some])
            y = np.zeros((len(given), system.at.own[-1])) if start is None else start[some].copy()
            done, left = solve_columns(system, ambient, given, tolerance, MOST, y, u[some])
            iterations, residual = max(iterations, done), max(residual, left)
            if not left <= tolerance:
                raise RefusedError(f"sd: no convergence: residual {left:.2g} after {done} iterations")
            error = max(
                error, *(error_of(system, ambient, *each, lonely) for each in zip(given, y, u[some], strict=True))
            )
        report = Report(error=error + residual, iterations=iterations, residual=residual)
        return Solved(velocity=u, report=report, sources=y if len(loads) <= TOGETHER else None)
