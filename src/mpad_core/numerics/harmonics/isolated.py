"""An isolated pair in unbounded fluid as the truncated harmonics see it: what is subtracted before adding the exact."""

import math

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled, compiled_within
from mpad_core.numerics.harmonics.definite import solve
from mpad_core.numerics.harmonics.layout import strain_unit
from mpad_core.numerics.harmonics.selves import axial_matrix
from mpad_core.numerics.harmonics.translation import count


@compiled_within
def _both(p: int, q: int, m: int, axial: Array) -> Array:
    """Give identity plus coupling of order m: sphere 1 (source of `axial`, degree q), then sphere 2 (target, p)."""
    block = axial_matrix(p, q, m, axial)
    rows, columns = block.shape
    matrix = np.eye(rows + columns)
    for r in range(rows):
        for c in range(columns):
            matrix[columns + r, c] = matrix[c, columns + r] = block[r, c]
    return matrix


@compiled_within
def _answers(
    p: int, q: int, m: int, axial: Array, strain: float, other_strain: float, units: Array
) -> tuple[Array, Array]:
    """Give resistance (4, 4) over W1 and X1 of spheres 1 and 2 (U1, U2, Ω1, Ω2), and the loads (4,) in strain."""
    one, two = count(q, m), count(p, m)
    spots = np.array([one, 3 * one + two, 2 * one, 3 * one + 2 * two])
    right = np.zeros((3 * (one + two), 5))
    for k in range(4):
        right[spots[k], k] = 1.0
    if one > 1:  # harmonics of degree 1 do not see strain
        right[one + 1, 4] = strain
    if two > 1:
        right[3 * one + two + 1, 4] = other_strain
    resistance, load = np.empty((4, 4)), np.empty(4)
    definite = 1.0 if solve(_both(p, q, m, axial), right) else np.nan
    for k in range(4):
        load[k] = right[spots[k], 4] * units[k] * definite
        for l in range(4):  # noqa: E741
            resistance[k, l] = right[spots[k], l] * units[k] * units[l]
    return resistance, load


@compiled
def subtract_functions(p: int, q: int, ratio: float, axial: Array, out: Array) -> None:
    """Subtract the resistance functions of two spheres in unbounded fluid, truncated.

    Parameters
    ----------
    p, q
        Highest degrees of sphere 2, the target of `axial`, and of sphere 1, its source.
    ratio
        Radius of sphere 2 over that of sphere 1; the functions are for radius 1 and viscosity 1.
    axial
        Of `axial_blocks` between the two.
    out : (22,)
        Functions in the order of `mpad_core.numerics.pair_functions`, changed in place; NaN if rounding has made the
        pair indefinite.
    """
    units = np.empty(4)
    units[0], units[1] = math.sqrt(6 * math.pi), math.sqrt(6 * math.pi * ratio)
    units[2], units[3] = math.sqrt(8 * math.pi), math.sqrt(8 * math.pi * ratio**3)
    start = 0
    for m in range(2):
        size = math.sqrt(1.5 - 1.5 * m + 2.0 * m)  # |E| of (-x/2, -y/2, z) and of (z, 0, x)
        resistance, load = _answers(p, q, m, axial[start:], strain_unit(1.0) * size, strain_unit(ratio) * size, units)
        _subtract(m, resistance, load, out)
        start += 6 * count(p, 0) * count(q, 0)


@compiled
def _subtract(m: int, resistance: Array, load: Array, out: Array) -> None:
    """Subtract what order m gives: motion and spin along the line (0), all that is across (1)."""
    k = 0 if m == 0 else 6
    for r in range(4):
        for c in range(r, 4):
            if m == 1 or r // 2 == c // 2:
                out[k] -= resistance[r, c]
                k += 1
    for r in range(2 + 2 * m):
        out[16 + 2 * m + r] -= load[r]
