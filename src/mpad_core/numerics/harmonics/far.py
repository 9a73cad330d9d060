"""Pairs far apart: what forces, torques and stresslets do to velocities, spins and rates of strain; compiled.

Of the vector harmonics these are W and X of degree 1 and W of degree 2, to which a pair's block is restricted. Where
all pairs are, that is a Galerkin projection; beside pairs with higher degrees it is none, and the grand mobility is
definite only as long as what is cut is small beside the tightest contact. The closed forms of `stresslets` are summed
over all pairs, many at once, and taken away again for those that are listed as near.
"""

import math
from typing import NamedTuple

import numpy as np

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled, compiled_sums
from mpad_core.numerics.harmonics.layout import place, places, rigid_units, spots, strain_unit
from mpad_core.numerics.harmonics.pairs import Places
from mpad_core.numerics.stresslets import fts_product, pair_block_fts

MOMENTS = 11
"""Force, torque and stresslet."""


class Far(NamedTuple):
    """Spheres that feel each other by their first moments, all or none of them."""

    centres: Array  # (N, 3), or (0, 3) where no pair is far
    radii: Array
    units: Array  # (N, 11): coefficients times this are moments, velocities times this are coefficients
    near: Indices  # (K, 2): pairs that are not far
    blocks: Array  # (K, 11, 11): their blocks of the moments, in the units of coefficients


def no_far() -> Far:
    """Give the null object: every pair is near."""
    none = np.zeros(0)
    return Far(np.zeros((0, 3)), none, np.zeros((0, 11)), np.zeros((0, 2), np.int64), np.zeros((0, 11, 11)))


@compiled
def moment_spots(p: int) -> tuple[int, int, int, int, int, int, int, int, int, int, int]:
    """Give where the moments lie in a sphere's flat array: `layout.spots`, then zz, xz, yz, xx-yy and xy of W."""
    t, (a, b, c, d, e, f) = places(p), spots(p)
    m1, m2 = place(2, 1), place(2, 2)
    return a, b, c, d, e, f, t + place(2, 0), t + m1, 4 * t + m1, t + m2, 4 * t + m2


@compiled
def far_of(centres: Array, radii: Array, near: Indices, wall: bool) -> Far:
    """Make ready: all pairs are far but those listed."""
    count, rigid = len(radii), rigid_units(radii)
    units, blocks = np.empty((count, MOMENTS)), np.empty((len(near), MOMENTS, MOMENTS))
    for i in range(count):
        for k in range(MOMENTS):
            units[i, k] = rigid[i, k] if k < 6 else strain_unit(radii[i])
    for p in range(len(near)):
        i, j = near[p]
        pair_block_fts(centres[i], centres[j], radii[i], radii[j], 1 / (8 * math.pi), wall, blocks[p])
        for k in range(MOMENTS):
            for m in range(MOMENTS):
                blocks[p, k, m] *= units[i, k] * units[j, m]
    return Far(centres, radii, units, near, blocks)


@compiled_sums
def add_far(at: Places, far: Far, wall: bool, y: Array, out: Array) -> None:
    """Add the traces (flat) that far spheres of sources y (flat) make on each other."""
    count = len(far.radii)
    if count < 2:
        return
    sources, moments = np.empty((count, MOMENTS)), np.empty((count, MOMENTS))
    for i in range(count):
        for k, spot in enumerate(moment_spots(at.degrees[i])):
            sources[i, k] = y[at.own[i] + spot]
            moments[i, k] = sources[i, k] * far.units[i, k]
    traces = fts_product(far.centres, far.radii, 1.0, wall, moments)
    for i in range(count):
        for k in range(MOMENTS):
            traces[i, k] *= far.units[i, k]
    for p in range(len(far.near)):
        i, j = far.near[p]
        for k in range(MOMENTS):
            for m in range(MOMENTS):
                traces[i, k] -= far.blocks[p, k, m] * sources[j, m]
                traces[j, m] -= far.blocks[p, k, m] * sources[i, k]
    for i in range(count):
        for k, spot in enumerate(moment_spots(at.degrees[i])):
            out[at.own[i] + spot] += traces[i, k]
