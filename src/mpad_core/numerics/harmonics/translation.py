r"""The exterior fields of one sphere as traces on another, above it on the z-axis: closed formulae; compiled.

With irregular and regular solid harmonics I_n^m = (n-m)! P_n^m e^{imφ}/r^{n+1} and R_n^m = r^n P_n^m e^{imφ}/(n+m)!,
whose derivatives shift indices, a source at distance d below gives by Taylor's series

    I_l^m(r + d e_z) = Σ_n (-1)^{n+m} (l+n)!/d^{l+n+1} R_n^m(r).

The exterior fields are ∇I (V), r×∇I (X), and, with pressure, g r²∇I + (2l+1) r I, g = -(2l+1)(l-2)/(2(l+1)) (W, less
its part in V; Lamb's solution, Kim and Karrila, Microhydrodynamics, 4.2). A regular field is known on a sphere from r·u
and r·∇×u alone. With r = r_source - d e_z and z R_n from the recurrence of P_n these are

    ∇I:                    r·u = Σ n I_n                                      (I_n: the part of I of degree n in r)
    r_s×∇I:                r·u = -i m d I,          r·∇×u = Σ n l I_n
    g r_s²∇I + (2l+1)r_s I:  r·u = g(r² + 2dz + d²) Σ n I_n + (2l+1)(r² + dz) I,   r·∇×u = -(2g-2l-1) i m d I

so that every entry is one product of factorials and a rational function of n, l, m.
"""

import math

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.harmonics.layout import V, W, X, lowest, unit

HIGHEST = 250
"""Highest degree: the factorials' products stay within the range of floating point for all gaps of use."""

UNITS = np.array([[unit(f, n) / math.sqrt(2 * n + 1) if n else 1.0 for n in range(HIGHEST + 3)] for f in (V, W, X)])
"""(3, HIGHEST + 3): the units of the coefficients, and the norm of Y but for its factorials."""


@compiled
def count(p: int, m: int) -> int:
    """Give the number of degrees up to p that have order m."""
    return max(0, p + 1 - lowest(m))


@compiled
def axial_size(p: int, q: int) -> int:
    """Give the number of entries of the blocks of all orders m, for targets to degree p and sources to degree q."""
    total = 0
    for m in range(min(p, q) + 1):
        total += 6 * count(p, m) * count(q, m)
    return total


@compiled
def _entries(n: int, l: int, m: int, near: float, far: float, to: Array) -> None:  # noqa: E741
    """Write what one exterior field of degree l gives in degree n but for the common factor, lengths over d.

    Parameters
    ----------
    n, l, m
        Degrees of target and source, order.
    near, far
        Radii of target and source over the distance.
    to : (6,)
        Written: V from W; W from V, W, X; X from W, X.
    """
    g = -(2 * l + 1) * (l - 2.0) / (2 * (l + 1))
    a_part = g * n - (n + m) * (n - m) * (2 * g * (n - 1) + 2 * l + 1) / ((l + n) * (2 * n - 1.0))
    b_part = g * n + 2 * l + 1 - (l + n + 1) * (2 * g * (n + 1) + 2 * l + 1) / (2 * n + 3.0)
    to[0] = near * 2 * b_part / ((n + 1.0) * (2 * n + 1))
    to[1] = far * far / near
    to[2] = a_part / (n * near) + near * b_part * (2 * n + 3) / (n * (2 * n + 1.0)) - far * far / near * (g - 1)
    to[3] = m * far / (n * near)
    to[4] = m * (2 * g - 2 * l - 1) / (n * (n + 1.0))
    to[5] = -far * l / (n + 1.0)


@compiled
def _write(
    n: int,
    l: int,  # noqa: E741
    row: int,
    column: int,
    columns: int,
    rows: int,
    factor: float,
    to: Array,
    out: Array,
) -> None:
    """Put the six entries of (n, l) where they belong, in the units of the coefficients."""
    out[row * columns + column] = factor * UNITS[V, n] * to[0] / UNITS[W, l]
    into = factor * UNITS[W, n]
    wide = (rows + 3 * row) * columns + column
    out[wide] = into * to[1] / UNITS[V, l]
    out[wide + columns] = into * to[2] / UNITS[W, l]
    out[wide + 2 * columns] = into * to[3] / UNITS[X, l]
    into = factor * UNITS[X, n]
    wide = (4 * rows + 2 * row) * columns + column
    out[wide] = into * to[4] / UNITS[W, l]
    out[wide + columns] = into * to[5] / UNITS[X, l]


@compiled
def axial_blocks(p: int, a: float, q: int, b: float, distance: float, out: Array) -> None:
    """Write the traces, on a sphere of radius a, of the exterior fields of one of radius b at `distance` below it.

    Parameters
    ----------
    p, a
        Highest degree and radius of the target.
    q, b
        Of the source.
    distance
        Between the centres; the target is the upper one.
    out : (axial_size(p, q),)
        Written: for m = 0 .. min(p, q) the rows of V (from W only), then those of W (from V, W, X), then those of X
        (from W, X), each row over the degrees of the sources.
    """
    near, far, at = a / distance, b / distance, 0
    to, step = np.empty(6), np.empty(max(p, q) + 1)
    for m in range(min(p, q) + 1):
        first, rows, columns = lowest(m), count(p, m), count(q, m)
        for n in range(first, max(p, q) + 1):
            step[n] = 1 / math.sqrt((n + 1.0 - m) * (n + 1 + m))
        # (-1)^(n+m) (l+n)! near^n far^l / ((n+m)! (n-m)! (l+m)! (l-m)!)^½ from row to row and from column to column
        start = (-2 * near * far if m == 0 else (near * far) ** m) * math.sqrt(a / b)
        for n in range(first, p + 1):
            factor = start
            for l in range(first, q + 1):  # noqa: E741
                _entries(n, l, m, near, far, to)
                _write(n, l, n - first, l - first, columns, rows, factor, to, out[at : at + 6 * rows * columns])
                factor *= far * (l + n + 1) * step[l]
            start *= -near * (first + n + 1) * step[n]
        at += 6 * rows * columns
