"""Few spheres: the mobility matrix itself, lone spheres made exact at the level of resistance; compiled."""

import math

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.values import Motion, Report
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.stokeslets import grand_mobility
from mpad_rpb.accuracy import error_of
from mpad_rpb.lone import lone_corrections
from mpad_rpb.scene import Spheres


@compiled
def invert(matrix: Array) -> bool:
    """Invert a symmetric positive definite matrix in place by Cholesky; False, and rubbish left, if it is not definite.

    Rows are combined whole, which vectorises; the result is symmetric to the last bit. Diagonal scaling drops out of
    Cholesky's rounding, so a sphere at a tiny gap does not spoil the digits of the others.
    """
    n = len(matrix)
    for k in range(n):  # matrix becomes U, matrix = Uᵀ U, upper triangle
        if not matrix[k, k] > 0:
            return False
        root = math.sqrt(matrix[k, k])
        for j in range(k, n):
            matrix[k, j] /= root
        for i in range(k + 1, n):
            factor = matrix[k, i]
            for j in range(i, n):
                matrix[i, j] -= factor * matrix[k, j]
    lower = np.zeros((n, n))  # the inverse of Uᵀ, row by row
    for k in range(n):
        lower[k, k] = 1.0
        for i in range(k):
            factor = matrix[i, k]
            for j in range(i + 1):
                lower[k, j] -= factor * lower[i, j]
        for j in range(k + 1):
            lower[k, j] /= matrix[k, k]
    matrix[:] = 0.0
    for k in range(n):
        for i in range(k + 1):
            factor = lower[k, i]
            for j in range(i + 1):
                matrix[i, j] += factor * lower[k, j]
    for i in range(n):
        for j in range(i):
            matrix[j, i] = matrix[i, j]
    return True


@compiled
def exact_when_alone(
    centres: Array, radii: Array, gaps: Array, viscosity: float, shear_rate: float, ambient: Array, matrix: Array
) -> Array:
    """Turn the method's mobility into the corrected one in place, and give the velocities (6N,) of load-free spheres.

    (M⁻¹ + ΔR) U = F + ΔF + M⁻¹ u_∞, with the corrections of `lone_corrections`. NaN if M is not positive definite.
    """
    count = len(radii)
    resistance, load = np.empty((count, 6, 6)), np.empty((count, 6))
    lone_corrections(centres, radii, gaps, viscosity, shear_rate, resistance, load)
    free = np.full(6 * count, np.nan)
    if not invert(matrix):
        return free
    right = load.reshape(-1)
    for i in range(6 * count):
        for j in range(count):
            right[i] += matrix[i, 6 * j] * ambient[j, 0] + matrix[i, 6 * j + 4] * ambient[j, 4]
    for i in range(count):
        matrix[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] += resistance[i]
    if invert(matrix):
        free[:] = 0.0
        for i in range(6 * count):
            for j in range(6 * count):
                free[i] += matrix[i, j] * right[j]
    return free


def _damp(matrix: Array, damping: Array) -> None:
    """Scale the blocks as `Spheres` says."""
    scales = np.outer(damping, damping)
    np.fill_diagonal(scales, damping)
    matrix *= np.repeat(np.repeat(scales, 6, axis=0), 6, axis=1)


@frozen(kw_only=True, eq=False)
class Dense:
    """The mobility matrix (6N, 6N) and the velocities (6N,) of load-free spheres."""

    spheres: Spheres
    mobility: Array
    free: Array

    @classmethod
    def of(cls, spheres: Spheres) -> "Dense":
        """Form and correct the matrix.

        Raises
        ------
        RefusedError
            If two equal spheres are in one place.
        """
        fluid = spheres.setting
        matrix = grand_mobility(spheres.centres, spheres.radii, fluid.viscosity, fluid.wall)
        if spheres.damping is not None:
            _damp(matrix, spheres.damping)
        if not spheres.exact:
            return cls(spheres=spheres, mobility=matrix, free=spheres.ambient.reshape(-1))
        free = exact_when_alone(
            spheres.centres,
            spheres.radii,
            spheres.gaps,
            fluid.viscosity,
            fluid.shear_rate,
            spheres.ambient,
            matrix,
        )
        if free[0] != free[0]:
            raise RefusedError("rpb: the mobility is not positive definite: " + spheres.closest())
        return cls(spheres=spheres, mobility=matrix, free=free)

    def solve(self, loads: Array) -> Motion:
        """Multiply."""
        loads = np.ascontiguousarray(loads, dtype=np.float64)
        flat = loads.reshape(len(self.free), -1)
        velocity = self.mobility @ flat
        velocity += self.free[:, None]
        if not math.isfinite(velocity.sum()):
            raise RefusedError("rpb: the loads are not finite")
        return Motion(
            velocity=velocity.reshape(loads.shape), report=Report(error=error_of(self.spheres, flat, velocity))
        )
