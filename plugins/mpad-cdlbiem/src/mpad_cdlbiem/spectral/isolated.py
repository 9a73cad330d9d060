"""An isolated pair in unbounded fluid as the truncated harmonics see it: what is subtracted before adding the exact."""

import math

import numpy as np

from mpad_cdlbiem.spectral.definite import solve
from mpad_cdlbiem.spectral.layout import strain_unit
from mpad_cdlbiem.spectral.selves import axial_matrix
from mpad_cdlbiem.spectral.translation import count
from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled

FUNCTIONS = 22
"""As `mpad_core.numerics.pair_functions` orders them."""


@compiled
def _both(p: int, q: int, m: int, axial: Array) -> Array:
    """Give identity plus coupling of order m: sphere 1 (source of `axial`, degree q), then sphere 2 (target, p)."""
    block = axial_matrix(p, q, m, axial)
    rows, columns = block.shape
    matrix = np.eye(rows + columns)
    matrix[columns:, :columns] = block
    matrix[:columns, columns:] = block.T
    return matrix


@compiled
def _answers(p: int, q: int, m: int, axial: Array, strains: Array, units: Array) -> tuple[Array, Array]:
    """Give resistance (4, 4) over W1 and X1 of spheres 1 and 2 (U1, U2, Ω1, Ω2), and the loads (4,) in strain."""
    one, two = count(q, m), count(p, m)
    spots = np.array([one, 3 * one + two, 2 * one, 3 * one + 2 * two])
    right = np.zeros((3 * (one + two), 5))
    for k in range(4):
        right[spots[k], k] = 1.0
    right[one + 1, 4], right[3 * one + two + 1, 4] = strains[0], strains[1]
    resistance, load = np.empty((4, 4)), np.empty(4)
    if not solve(_both(p, q, m, axial), right):
        resistance[:], load[:] = np.nan, np.nan
        return resistance, load
    for k in range(4):
        load[k] = right[spots[k], 4] * units[k]
        for l in range(4):  # noqa: E741
            resistance[k, l] = right[spots[k], l] * units[k] * units[l]
    return resistance, load


@compiled
def pair_functions_of(p: int, q: int, ratio: float, axial: Array) -> Array:
    """Give the resistance functions of two spheres in unbounded fluid, truncated.

    Parameters
    ----------
    p, q
        Highest degrees of sphere 2, the target of `axial`, and of sphere 1, its source; at least 2.
    ratio
        Radius of sphere 2 over that of sphere 1; the functions are for radius 1 and viscosity 1.
    axial
        Of `axial_blocks` between the two.

    Returns
    -------
    functions : (22,)
        In the order of `mpad_core.numerics.pair_functions`; NaN if rounding has made the pair indefinite.
    """
    out = np.empty(FUNCTIONS)
    units = np.empty(4)
    units[0], units[1] = math.sqrt(6 * math.pi), math.sqrt(6 * math.pi * ratio)
    units[2], units[3] = math.sqrt(8 * math.pi), math.sqrt(8 * math.pi * ratio**3)
    strains = np.array([strain_unit(1.0), strain_unit(ratio)])
    along, load = _answers(p, q, 0, axial, strains * math.sqrt(1.5), units)
    out[0], out[1], out[2] = along[0, 0], along[0, 1], along[1, 1]
    out[3], out[4], out[5] = along[2, 2], along[2, 3], along[3, 3]
    out[16:18] = load[:2]
    start = 6 * count(p, 0) * count(q, 0)
    across, load = _answers(p, q, 1, axial[start:], strains * math.sqrt(2.0), units)
    k = 6
    for r in range(4):
        for c in range(r, 4):
            out[k] = across[r, c]
            k += 1
    out[18:22] = load
    return out
