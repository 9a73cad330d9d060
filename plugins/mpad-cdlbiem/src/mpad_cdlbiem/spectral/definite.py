"""Symmetric positive definite systems of the sizes met here, too small for LAPACK's threads; compiled."""

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled_sums


@compiled_sums
def invert(matrix: Array) -> bool:
    """Invert a matrix in place, by sweeps of its pivots, and make it symmetric; False if it is not definite."""
    n = len(matrix)
    for k in range(n):
        pivot = matrix[k, k]
        if not pivot > 0:
            return False
        matrix[k, k] = 1.0
        for c in range(n):
            matrix[k, c] /= pivot
        for r in range(n):
            factor = matrix[r, k]
            if r != k and factor != 0:
                matrix[r, k] = 0.0
                for c in range(n):
                    matrix[r, c] -= factor * matrix[k, c]
    for r in range(n):
        for c in range(r):
            matrix[r, c] = matrix[c, r] = 0.5 * (matrix[r, c] + matrix[c, r])
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
