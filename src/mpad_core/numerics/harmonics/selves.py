"""What each sphere sends itself by way of the wall, and the inverse of that together with the identity; compiled."""

import numpy as np

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled, compiled_sums
from mpad_core.numerics.harmonics.definite import invert
from mpad_core.numerics.harmonics.image import RAISE
from mpad_core.numerics.harmonics.layout import V, W, lowest, place, places
from mpad_core.numerics.harmonics.translation import axial_blocks, axial_size, count


@compiled
def inverse_size(p: int) -> int:
    """Give the number of entries of the matrices of all orders, (3 count)² each."""
    total = 0
    for m in range(p + 1):
        total += 9 * count(p, m) * count(p, m)
    return total


@compiled
def axial_matrix(p: int, q: int, m: int, blocks: Array) -> Array:
    """Give order m of `axial_blocks`, `blocks` starting there, as a matrix: rows and columns V, W, X by degrees."""
    rows, columns = count(p, m), count(q, m)
    out, at = np.zeros((3 * rows, 3 * columns)), 0
    for r in range(3 * rows):
        first = 0 if r // rows == W else columns  # V has W for source, W all three, X has W and X
        last = 2 * columns if r // rows == V else 3 * columns
        for c in range(first, last):
            out[r, c] = blocks[at]
            at += 1
    return out


@compiled_sums
def _self_matrix(p: int, m: int, moved: Array, operator: Array) -> Array:
    """Give identity plus the block of order m: the operator, transposed, times `moved` (image's, sphere's degrees)."""
    first, rows, columns = lowest(m), count(p, m), count(p + RAISE, m)
    out = np.eye(3 * rows)
    for l in range(first, p + 1):  # noqa: E741
        for n in range(max(first, l - RAISE), l + RAISE + 1):
            entries = operator[place(l, m), n - l + RAISE]
            for f in range(3):
                for g in range(3):
                    factor, to, of = entries[f, g], g * rows + l - first, f * columns + n - first
                    if factor != 0:
                        for r in range(3 * rows):
                            out[to, r] += moved[of, r] * factor
    return out


@compiled
def self_inverse(p: int, height: float, operator: Array, out: Array) -> bool:
    """Write the inverse of identity plus the wall's self-block of a sphere, order by order.

    Parameters
    ----------
    p
        Highest degree.
    height
        Of the centre, in radii.
    operator : (T, 5, 3, 3)
        Of `image_operator`.
    out : (inverse_size(p),)
        Written: for each m a symmetric matrix over V, W, X by degrees, the same for both classes.

    Returns
    -------
    positive
        Whether all matrices are positive definite, as they are above the wall up to rounding.
    """
    blocks = np.empty(axial_size(p, p + RAISE))
    axial_blocks(p, 1.0, p + RAISE, 1.0, 2 * height, blocks)
    at, to = 0, 0
    for m in range(p + 1):
        own = _self_matrix(p, m, axial_matrix(p, p + RAISE, m, blocks[at:]).T.copy(), operator)
        if not invert(own):
            return False
        size = len(own)
        for r in range(size):
            for c in range(size):
                out[to + r * size + c] = own[r, c]
        at, to = at + 6 * count(p, m) * count(p + RAISE, m), to + size * size
    return True


@compiled_sums
def apply_inverse(degrees: Indices, starts: Indices, inverses: Array, y: Array, out: Array) -> None:
    """Multiply every sphere's coefficients y with its inverse (all flat; the inverses one after the other)."""
    to = 0
    top = degrees.max()
    x = np.empty((2, 3 * (top + 1)))
    for i in range(len(degrees)):
        p = degrees[i]
        source = y[starts[i] : starts[i + 1]].reshape(2, 3, places(p))
        target = out[starts[i] : starts[i + 1]].reshape(2, 3, places(p))
        for m in range(p + 1):
            first, rows = lowest(m), count(p, m)
            size = 3 * rows
            for c in range(2):
                for f in range(3):
                    for r in range(rows):
                        x[c, f * rows + r] = source[c, f, place(first + r, m)]
            for f in range(3):
                for r in range(rows):
                    line = inverses[to + (f * rows + r) * size : to + (f * rows + r + 1) * size]
                    even, odd = 0.0, 0.0
                    for k in range(size):
                        even += line[k] * x[0, k]
                        odd += line[k] * x[1, k]
                    target[0, f, place(first + r, m)] = even
                    target[1, f, place(first + r, m)] = odd
            to += size * size


@compiled_sums
def add_rigid_columns(degrees: Indices, starts: Indices, inverses: Array, u: Array, out: Array) -> None:
    """Add to `out` every sphere's inverse times its rigid traces u (N, 6), ordered as in `layout.spots`."""
    to = 0
    for i in range(len(degrees)):
        p = degrees[i]
        target = out[starts[i] : starts[i + 1]].reshape(2, 3, places(p))
        for m in range(2):
            rows = count(p, m)
            for c in range(2):
                w = u[i, 2] * (c == 0) if m == 0 else u[i, c]
                x = u[i, 5] * (c == 1) if m == 0 else u[i, 4 - c]
                for f in range(3):
                    for r in range(rows):
                        line = to + (f * rows + r) * 3 * rows
                        target[c, f, place(1 + r, m)] += inverses[line + rows] * w + inverses[line + 2 * rows] * x
            to += 9 * rows * rows
        for m in range(2, p + 1):
            to += 9 * count(p, m) ** 2


@compiled
def rigid_resistance(p: int, inverse: Array, out: Array) -> None:
    """Write the resistance (6, 6) of a sphere alone at the wall, as truncated, from its `self_inverse`."""
    out[:] = 0.0
    rows = count(p, 0)
    size = 3 * rows
    out[2, 2], out[5, 5] = inverse[rows * size + rows], inverse[2 * rows * size + 2 * rows]
    for axis in range(2):  # along x with the turn about y, along y with that about x
        spin, w, x = 4 - axis, rows * size + rows, 2 * rows * size + 2 * rows
        out[axis, axis], out[spin, spin] = inverse[size * size + w], inverse[size * size + x]
        out[axis, spin] = out[spin, axis] = inverse[size * size + rows * size + 2 * rows]
