"""The balance of a configuration of spheres, and its solution by GMRES; compiled."""

import math
from typing import NamedTuple

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled_sums, compiled_within
from mpad_core.numerics.harmonics.factors import Factors, solve_factored
from mpad_core.numerics.harmonics.far import Far, add_far
from mpad_core.numerics.harmonics.layout import spots
from mpad_core.numerics.harmonics.pairs import Pairs, Places, pair_product
from mpad_core.numerics.harmonics.selves import add_rigid_columns, apply_inverse

RESTART = 60
"""Length of a cycle."""


class System(NamedTuple):
    """All that the product needs; see `balance` for the equations."""

    at: Places
    pairs: Pairs
    far: Far  # of pairs that are not among `pairs`
    wall: bool
    operators: Array  # image operators, flat
    inverses: Array  # of `selves.self_inverse`, flat; not read without a wall
    coupled: Factors  # of the resistance (6N, 6N) with every correction, in units of `layout`


@compiled_sums
def _dot(a: Array, b: Array) -> float:
    total = 0.0
    for k in range(len(a)):
        total += a[k] * b[k]
    return total


@compiled_sums
def rigid_parts(at: Places, y: Array, out: Array) -> None:
    """Write the rigid parts (N, 6) of flat coefficients, ordered as in `layout.spots`."""
    for i in range(len(at.degrees)):
        for k, spot in enumerate(spots(at.degrees[i])):
            out[i, k] = y[at.own[i] + spot]


@compiled_sums
def _add_rigid(at: Places, u: Array, y: Array) -> None:
    """Add rigid parts (N, 6) to flat coefficients."""
    for i in range(len(at.degrees)):
        for k, spot in enumerate(spots(at.degrees[i])):
            y[at.own[i] + spot] += u[i, k]


@compiled_sums
def balance(system: System, r: Array, load: Array, y: Array, u: Array) -> None:
    r"""Write sources y and velocities u (N, 6) that answer incoming traces -r and loads, each sphere by itself.

    With B the self-blocks, y = B⁻¹ (F u + r), F putting rigid traces where they belong, and the rigid part of y is the
    load less what the corrections take, y_F = load - Δ u, so that (B⁻¹_FF + Δ) u = load - (B⁻¹ r)_F.
    """
    at = system.at
    if system.wall:
        apply_inverse(at.degrees, at.own, system.inverses, r, y)
    else:
        for k in range(len(r)):
            y[k] = r[k]
    rigid_parts(at, y, u)
    short, flat = load.copy().reshape(-1), u.reshape(-1)
    for i in range(len(flat)):
        short[i] -= flat[i]
    solve_factored(system.coupled, short, flat)
    if system.wall:
        add_rigid_columns(at.degrees, at.own, system.inverses, u, y)
    else:
        _add_rigid(at, u, y)


@compiled_sums
def exchanged(system: System, y: Array, out: Array) -> None:
    """Write the traces of what every sphere gets from all others."""
    pair_product(system.at, system.pairs, system.operators, system.wall, y, out)
    add_far(system.at, system.far, system.wall, y, out)


@compiled_within
def _apply(system: System, nothing: Array, y: Array, work: Array, u: Array, out: Array) -> None:
    """Write y less the balanced answer to what all spheres send each other."""
    exchanged(system, y, work)
    for k in range(len(work)):
        work[k] = -work[k]
    balance(system, work, nothing, out, u)
    for k in range(len(work)):
        out[k] = y[k] - out[k]


@compiled_within
def _orthogonalise(basis: Array, k: int, column: Array) -> None:
    """Make row k+1 of the basis orthogonal to the rows before, one after the other, and normalise it.

    Modified Gram-Schmidt loses orthogonality, but not the backward stability of GMRES (Paige, Rozložník and Strakoš,
    SIAM J. Matrix Anal. Appl. 28 (2006) 264).
    """
    new = basis[k + 1]
    for i in range(k + 1):
        row = basis[i]
        column[i] = _dot(row, new)
        for e in range(len(new)):
            new[e] -= column[i] * row[e]
    column[k + 1] = math.sqrt(_dot(new, new))
    if column[k + 1] > 0:
        for e in range(len(new)):
            new[e] /= column[k + 1]


@compiled_within
def _rotate(column: Array, rotations: Array, right: Array, k: int) -> None:
    """Bring a new column into the triangle by Givens rotations, and the right-hand side with it."""
    for i in range(k):
        c, s = rotations[i]
        column[i], column[i + 1] = c * column[i] + s * column[i + 1], c * column[i + 1] - s * column[i]
    length = math.hypot(column[k], column[k + 1])
    c, s = (column[k] / length, column[k + 1] / length) if length > 0 else (0.0, 1.0)
    rotations[k, 0], rotations[k, 1] = c, s
    column[k] = length
    right[k + 1] = -s * right[k]
    right[k] *= c


@compiled_within
def gmres(system: System, b: Array, tolerance: float, most: int, y: Array) -> tuple[int, float]:
    """Improve y until it is its own balanced answer within a tolerance.

    Parameters
    ----------
    system
        The spheres.
    b : (n,)
        The balanced answer to flow and loads alone.
    tolerance
        On the residual over |b|.
    most
        Iterations after which to give up.
    y : (n,)
        First guess; the answer is written here.

    Returns
    -------
    iterations, residual
    """
    n, nothing = len(b), np.zeros((len(system.at.degrees), 6))
    u, work, residual = np.empty_like(nothing), np.empty(n), np.empty(n)
    scale, iterations = math.sqrt(_dot(b, b)), 0
    if scale == 0:
        y[:] = 0.0
        return 0, 0.0
    warm = False
    for k in range(n):
        warm = warm or y[k] != 0
    while True:
        for k in range(n):
            residual[k] = b[k]
        if warm:
            _apply(system, nothing, y, work, u, residual)
            for k in range(n):
                residual[k] = b[k] - residual[k]
        norm = math.sqrt(_dot(residual, residual))
        if norm <= tolerance * scale or iterations >= most:
            return iterations, norm / scale
        done, norm = _cycle(system, nothing, residual, norm, tolerance * scale, most - iterations, work, u, y)
        iterations += done
        warm = True
        if norm <= tolerance * scale:  # the recursion's residual is the true one, GMRES being backward stable
            return iterations, norm / scale


@compiled_within
def _cycle(
    system: System,
    nothing: Array,
    residual: Array,
    norm: float,
    goal: float,
    most: int,
    work: Array,
    u: Array,
    y: Array,
) -> tuple[int, float]:
    """Run one cycle of GMRES from a residual, add its correction to y, give the products and the residual left."""
    length = min(most, RESTART)
    basis, triangle = np.empty((length + 1, len(residual))), np.zeros((length, length + 1))
    rotations, right = np.empty((length, 2)), np.zeros(length + 1)
    for e in range(len(residual)):
        basis[0, e] = residual[e] / norm
    right[0] = norm
    used = 0
    while used < length and abs(right[used]) > goal:
        _apply(system, nothing, basis[used], work, u, basis[used + 1])
        _orthogonalise(basis, used, triangle[used])
        _rotate(triangle[used], rotations, right, used)
        used += 1
    weights = np.zeros(used)
    for i in range(used - 1, -1, -1):
        left = right[i]
        for j in range(i + 1, used):
            left -= triangle[j, i] * weights[j]
        weights[i] = left / triangle[i, i] if triangle[i, i] != 0 else 0.0
        for e in range(len(y)):
            y[e] += weights[i] * basis[i, e]
    return used, abs(right[used])


@compiled_sums
def solve_columns(
    system: System, ambient: Array, loads: Array, tolerance: float, most: int, y: Array, u: Array
) -> tuple[int, float]:
    """Solve for every column.

    Parameters
    ----------
    ambient : (n,)
        Traces of the ambient flow.
    loads : (K, N, 6)
        Loads with all corrections, in the units of `layout`.
    tolerance, most
        Of `gmres`.
    y : (K, n)
        First guesses; the sources are written here.
    u : (K, N, 6)
        Written: velocities in the units of `layout`.

    Returns
    -------
    products, residual
        The largest of all columns.
    """
    products, residual = 0, 0.0
    b, work = np.empty(len(ambient)), np.empty(len(ambient))
    for k in range(len(loads)):
        balance(system, -ambient, loads[k], b, u[k])
        done, left = gmres(system, b, tolerance, most, y[k])
        products, residual = max(products, done), max(residual, left)
        exchanged(system, y[k], work)
        for e in range(len(work)):
            work[e] = -work[e] - ambient[e]
        balance(system, work, loads[k], y[k], u[k])
    return products, residual
