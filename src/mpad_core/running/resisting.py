"""The resistance of a group of cells at given heights, r(h) + C, and what is done with such matrices; compiled."""

import math

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled_lean
from mpad_core.numerics.wall_functions import add_wall_resistance
from mpad_core.running.layout import Bodies, Groups


@compiled_lean
def is_positive_definite(matrix: Array) -> bool:
    """Tell whether a symmetric matrix has a Cholesky factor, which is written into its lower triangle."""
    m = matrix.shape[0]
    for j in range(m):
        for k in range(j):
            for i in range(j, m):
                matrix[i, j] -= matrix[i, k] * matrix[j, k]
        if not matrix[j, j] > 0:
            return False
        root = math.sqrt(matrix[j, j])
        for i in range(j, m):
            matrix[i, j] /= root
    return True


@compiled_lean
def solve_in_place(matrix: Array, right: Array) -> None:
    """Solve by Gaussian elimination with partial pivoting; the answer replaces `right`, the matrix is overwritten."""
    m = matrix.shape[0]
    for k in range(m):
        pivot = k
        for i in range(k + 1, m):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(k, m):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            right[k], right[pivot] = right[pivot], right[k]
        for i in range(k + 1, m):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for j in range(k + 1, m):
                    matrix[i, j] -= factor * matrix[k, j]
                right[i] -= factor * right[k]
    for k in range(m - 1, -1, -1):
        for j in range(k + 1, m):
            right[k] -= matrix[k, j] * right[j]
        right[k] /= matrix[k, k]


@compiled_lean
def resistance(
    group: int, bodies: Bodies, groups: Groups, gaps: Array, functions: Array, matrix: Array, right: Array
) -> None:
    """Write r(h) + C (6n, 6n) and f(h) + k + g (6n,) of a group at gaps (N,); `functions` (8,) is scratch."""
    start, n = groups.first[group], groups.first[group + 1] - groups.first[group]
    m, offset, coupling = 6 * n, groups.coupling_first[group], groups.coupling
    for i in range(m):
        for j in range(m):
            matrix[i, j] = coupling[offset + m * i + j]
    for place in range(n):
        cell = groups.cells[start + place]
        o = 6 * place
        for i in range(6):
            right[o + i] = groups.load[cell, i]
        height, felt = gaps[cell] + bodies.radius[cell], gaps[cell] + bodies.wall_offset
        add_wall_resistance(
            o, height, felt, bodies.radius[cell], bodies.viscosity, bodies.shear_rate, functions, matrix, right
        )
