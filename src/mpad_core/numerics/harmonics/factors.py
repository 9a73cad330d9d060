"""A symmetric positive definite matrix made ready for solves: its inverse where it is small, sparse factors else."""

from typing import NamedTuple

import numpy as np

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled_sums
from mpad_core.numerics.harmonics.definite import invert

DENSE = 192
"""Rows up to which the inverse is kept: its products vectorise, which sparse substitution does not."""


class Factors(NamedTuple):
    """The inverse (n, n); or, where that has no rows, L D Lᵀ of the rows and columns taken in `order`."""

    inverse: Array
    order: Indices  # (n,): row k of the factors is row order[k] of the matrix
    starts: Indices  # (n+1,): of the columns of L below the diagonal
    rows: Indices
    values: Array
    pivots: Array  # (n,): D


class Blocks(NamedTuple):
    """A sparse symmetric matrix of 6x6 blocks: those on the diagonal, and dense ones (12, 12) that are added to it."""

    diagonal: Array  # (N, 6, 6)
    who: Indices  # (K, 2): the two spheres of each added block
    added: Array  # (K, 12, 12)


def factored(blocks: Blocks) -> Factors:
    """Factor the sum of the blocks.

    Raises
    ------
    FloatingPointError
        If it is not positive definite.
    """
    size = 6 * len(blocks.diagonal)
    if size <= DENSE:
        inverse = summed(blocks)
        none, empty = np.zeros(0, np.int64), np.zeros(0)
        if not invert(inverse):
            raise FloatingPointError("the resistance is not positive definite")
        return Factors(inverse, none, none, none, empty, empty)
    return _sparse(blocks)


@compiled_sums
def summed(blocks: Blocks) -> Array:
    """Give the sum of the blocks, (6N, 6N)."""
    count = len(blocks.diagonal)
    out = np.zeros((6 * count, 6 * count))
    for i in range(count):
        for k in range(6):
            for m in range(6):
                out[6 * i + k, 6 * i + m] = blocks.diagonal[i, k, m]
    for p in range(len(blocks.who)):
        for k in range(12):
            row = 6 * blocks.who[p, k // 6] + k % 6
            for m in range(12):
                out[row, 6 * blocks.who[p, m // 6] + m % 6] += blocks.added[p, k, m]
    return out


def _sparse(blocks: Blocks) -> Factors:
    """Factor by SuperLU, in the order of least degree and without pivoting, as a definite matrix allows."""
    from scipy.sparse import coo_array
    from scipy.sparse.linalg import splu

    count = len(blocks.diagonal)
    own = 6 * np.arange(count)[:, None] + np.arange(6)  # (N, 6): rows of each sphere
    both = own[blocks.who].reshape(-1, 12)
    rows = np.concatenate([np.repeat(own, 6, axis=1).ravel(), np.repeat(both, 12, axis=1).ravel()])
    columns = np.concatenate([np.tile(own, 6).ravel(), np.tile(both, 12).ravel()])
    values = np.concatenate([blocks.diagonal.ravel(), blocks.added.ravel()])
    matrix = coo_array((values, (rows, columns)), shape=(6 * count, 6 * count)).tocsc()
    lu = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    pivots = lu.U.diagonal()
    if not (pivots > 0).all() or (lu.perm_r != lu.perm_c).any():
        raise FloatingPointError("the resistance is not positive definite")
    lower = lu.L.tocsc()
    lower.setdiag(0.0)
    lower.eliminate_zeros()
    order = np.argsort(lu.perm_c).astype(np.int64)
    starts, at = lower.indptr.astype(np.int64), lower.indices.astype(np.int64)
    return Factors(np.zeros((0, 0)), order, starts, at, lower.data, pivots)


@compiled_sums
def solve_factored(factors: Factors, b: Array, out: Array) -> None:
    """Write the solution for the right-hand side b (n,)."""
    if len(factors.inverse) > 0:
        for i in range(len(b)):
            row, total = factors.inverse[i], 0.0
            for k in range(len(b)):
                total += row[k] * b[k]
            out[i] = total
        return
    n, x = len(b), np.empty(len(b))
    for k in range(n):
        x[k] = b[factors.order[k]]
    for k in range(n):
        for e in range(factors.starts[k], factors.starts[k + 1]):
            x[factors.rows[e]] -= factors.values[e] * x[k]
    for k in range(n - 1, -1, -1):
        x[k] /= factors.pivots[k]
        for e in range(factors.starts[k], factors.starts[k + 1]):
            x[k] -= factors.values[e] * x[factors.rows[e]]
    for k in range(n):
        out[factors.order[k]] = x[k]
