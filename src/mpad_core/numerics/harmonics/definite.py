"""Symmetric positive definite systems of the sizes met here, too small for LAPACK's threads; compiled."""

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled_sums


@compiled_sums
def invert(matrix: Array) -> bool:
    """Invert a matrix in place, by sweeps of its lower triangle; False if it is not positive definite."""
    n = len(matrix)
    line = np.empty(n)
    for k in range(n):
        pivot = matrix[k, k]
        if not pivot > 0:
            return False
        for c in range(k):
            line[c] = matrix[k, c]
        for c in range(k, n):
            line[c] = matrix[c, k]
        line[k] = 0.0
        for r in range(n):
            row, factor = matrix[r], line[r] / pivot
            if factor != 0:
                for c in range(r + 1):
                    row[c] -= factor * line[c]
        for c in range(n):  # the swept part is minus the inverse
            matrix[max(c, k), min(c, k)] = line[c] / pivot
        matrix[k, k] = -1 / pivot
    for r in range(n):
        for c in range(r + 1):
            matrix[r, c] = matrix[c, r] = -matrix[r, c]
    return True


@compiled_sums
def solve(matrix: Array, right: Array) -> bool:
    """Solve for the columns of `right` (n, k) in place; `matrix` is spoilt. False if it is not positive definite."""
    n, width = right.shape
    for k in range(n):
        if not matrix[k, k] > 0:
            return False
        for r in range(k + 1, n):
            factor = matrix[r, k] / matrix[k, k]
            if factor != 0:
                for c in range(k + 1, n):
                    matrix[r, c] -= factor * matrix[k, c]
                for c in range(width):
                    right[r, c] -= factor * right[k, c]
    for k in range(n - 1, -1, -1):
        for r in range(k + 1, n):
            for c in range(width):
                right[k, c] -= matrix[k, r] * right[r, c]
        for c in range(width):
            right[k, c] /= matrix[k, k]
    return True
