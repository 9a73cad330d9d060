"""The equations of a level as one dense matrix: for all loads at once, where spheres are few.

With K the inverses of the self-blocks, T what spheres send each other, F the six rigid traces of each sphere and Δ the
corrections, sources y and velocities u obey (`krylov.balance`)

    (1 + K T) y = K (F u - ambient),    y_F = load - Δ u,

so that with (1 + K T) X = K F and (1 + K T) x = K ambient the resistance is X_F + Δ, and the load load + x_F.
"""

import math

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.harmonics.factors import summed
from mpad_core.numerics.harmonics.far import MOMENTS, moment_spots
from mpad_core.numerics.harmonics.krylov import System
from mpad_core.numerics.harmonics.layout import spots
from mpad_core.numerics.harmonics.levels import Level
from mpad_core.numerics.harmonics.pairs import SOURCE, TARGET, Pairs, pair_product, places_of
from mpad_core.numerics.harmonics.selves import apply_inverse
from mpad_core.numerics.stresslets import pair_block_fts


@compiled
def _add_near(system: System, out: Array) -> None:
    """Add the blocks of near pairs, column by column of the source, and their transposes."""
    at, pairs = system.at, system.pairs
    for k in range(len(pairs.rows)):
        i, j = pairs.rows[k, TARGET], pairs.rows[k, SOURCE]
        row = pairs.rows[k : k + 1].copy()
        row[0, TARGET], row[0, SOURCE] = 0, 1
        two = places_of(np.array([at.degrees[i], at.degrees[j]]), system.wall)
        alone = Pairs(row, pairs.azimuth[k : k + 1], pairs.turns, pairs.axial)
        operators = np.empty(two.operator[2])
        for e in range(two.operator[1], two.operator[2]):  # only the source's image is asked for
            operators[e] = system.operators[at.operator[j] + e - two.operator[1]]
        y, image = np.zeros(two.own[2]), np.empty(two.own[2])
        for c in range(two.own[1], two.own[2]):
            y[c] = 1.0
            pair_product(two, alone, operators, system.wall, y, image)
            y[c] = 0.0
            for r in range(two.own[1]):
                to, of = at.own[i] + r, at.own[j] + c - two.own[1]
                out[to, of] += image[r]
                out[of, to] += image[r]


@compiled
def _add_far(system: System, out: Array) -> None:
    """Add the blocks of the moments of all pairs that are not near."""
    at, far, block = system.at, system.far, np.empty((MOMENTS, MOMENTS))
    count = len(far.radii)
    near = np.zeros((count, count), dtype=np.bool_)
    for k in range(len(far.near)):
        near[far.near[k, 0], far.near[k, 1]] = near[far.near[k, 1], far.near[k, 0]] = True
    for i in range(count):
        for j in range(i):
            if near[i, j]:
                continue
            radii, centres = far.radii, far.centres
            pair_block_fts(centres[i], centres[j], radii[i], radii[j], 1 / (8 * math.pi), system.wall, block)
            for k, row in enumerate(moment_spots(at.degrees[i])):
                for m, column in enumerate(moment_spots(at.degrees[j])):
                    to, of = at.own[i] + row, at.own[j] + column
                    entry = block[k, m] * far.units[i, k] * far.units[j, m]
                    out[to, of] += entry
                    out[of, to] += entry


@compiled
def _rigid_rows(system: System) -> Indices:
    """Give where the rigid motions of all spheres lie, (6N,)."""
    at = system.at
    rows = np.empty(6 * len(at.degrees), dtype=np.int64)
    for i in range(len(at.degrees)):
        for k, spot in enumerate(spots(at.degrees[i])):
            rows[6 * i + k] = at.own[i] + spot
    return rows


@compiled
def _through_selves(system: System, rows: Array) -> None:
    """Multiply every row with K, in place; without a wall it is one."""
    if system.wall:
        for k in range(len(rows)):
            apply_inverse(system.at.degrees, system.at.own, system.inverses, rows[k].copy(), rows[k])


@frozen(kw_only=True, eq=False)
class Dense:
    """Resistance and load of the rigid motions, and the sources that these make; in the units of `layout`."""

    resistance: Array  # (6N, 6N), symmetric to the last bit
    load: Array  # (6N,)
    moving: Array  # (6N, n): sources of unit velocities
    held: Array  # (n,): sources of spheres held in the flow

    @classmethod
    def of(cls, level: Level) -> "Dense":
        """Form and solve."""
        system, size = level.system, len(level.ambient)
        rigid = _rigid_rows(system)
        coupled = np.zeros((size, size))
        _add_near(system, coupled)
        _add_far(system, coupled)
        right = np.zeros((len(rigid) + 1, size))
        right[np.arange(len(rigid)), rigid] = 1.0
        right[-1] = -level.ambient
        _through_selves(system, coupled)  # T is symmetric, so its rows are its columns: these are those of K T
        _through_selves(system, right)
        alone = right[:-1, rigid].copy()  # K_FF, which the correction has in it and the solution brings anew
        coupled[np.diag_indices(size)] += 1.0
        sources = np.asarray(np.linalg.solve(coupled.T, right.T).T, dtype=np.float64)
        resistance = sources[:-1, rigid] + summed(level.blocks) - alone
        return cls(
            resistance=0.5 * (resistance + resistance.T),
            load=level.load.ravel() - sources[-1, rigid],
            moving=sources[:-1],
            held=sources[-1],
        )

    def sources(self, velocities: Array) -> Array:
        """Give the sources (K, n) of velocities (K, 6N)."""
        found: Array = velocities @ self.moving + self.held
        return found
