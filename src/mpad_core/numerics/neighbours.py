"""Which spheres are close to each other: all pairs are looked at, in memory of the order of their number; compiled."""

import math

import numpy as np

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled


@compiled
def _gap(centres: Array, radii: Array, i: int, j: int) -> float:
    x, y, z = centres[i, 0] - centres[j, 0], centres[i, 1] - centres[j, 1], centres[i, 2] - centres[j, 2]
    return float(math.sqrt(x * x + y * y + z * z) - radii[i] - radii[j])


@compiled
def closest_pair(centres: Array, radii: Array) -> tuple[int, int, float]:
    """Give the two spheres with the smallest gap between them, and the gap; infinite for one sphere alone."""
    first, second, least = 0, 0, math.inf
    for i in range(len(radii)):
        for j in range(i):
            gap = _gap(centres, radii, i, j)
            if gap < least:
                first, second, least = j, i, gap
    return first, second, least


@compiled
def _is_near(centres: Array, radii: Array, i: int, j: int, reach: float) -> bool:
    """Tell by the square of the distance, since a root for each pair would take most of the time."""
    x, y, z = centres[i, 0] - centres[j, 0], centres[i, 1] - centres[j, 1], centres[i, 2] - centres[j, 2]
    within = radii[i] + radii[j] + reach * min(radii[i], radii[j])
    return bool(x * x + y * y + z * z < within * within)


@compiled
def near_pairs(centres: Array, radii: Array, reach: float) -> Indices:
    """List the pairs whose gap is less than `reach` times the smaller radius: (K, 2), the smaller sphere first."""
    count = 0
    for i in range(len(radii)):
        for j in range(i):
            count += _is_near(centres, radii, i, j, reach)
    out, k = np.empty((count, 2), dtype=np.int64), 0
    for i in range(len(radii)):
        for j in range(i):
            if _is_near(centres, radii, i, j, reach):
                out[k, 0], out[k, 1] = (i, j) if radii[i] <= radii[j] else (j, i)
                k += 1
    return out
