"""Which pairs are near, and the degrees of their harmonics; compiled."""

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.harmonics.degrees import Degrees, decay, needed, wall_decay
from mpad_core.numerics.harmonics.layout import between
from mpad_core.numerics.neighbours import near_pairs

DEGREE = 4
"""Of equal near spheres: with lubrication, two and the wall are right to 1.5e-2 (u) and 2.5e-2 (mobility)."""

LEAST = 2
"""That of the stresslet."""

HIGHEST = 40
"""Of the larger of two spheres, whatever the ratio: blocks grow as its cube."""

SPREAD = 11.5
"""Harmonics count until they have fallen by exp(-SPREAD): to a thousandth of a per cent, since lifts are so small."""


@compiled
def degrees_of(centres: Array, radii: Array, gaps: Array, wall: bool, reach: float) -> Degrees:
    """List the pairs with gaps below `reach` smaller radii, and give degrees to them and to all spheres.

    Lubrication is for those whose degrees do not resolve the gap; `gaps` (N,) are those to the wall, if any.
    """
    who = near_pairs(centres, radii, reach)
    spheres, pairs, near = np.full(len(radii), LEAST), np.empty_like(who), np.zeros(len(who), np.int64)
    most = np.full(len(radii), DEGREE)
    for k in range(len(who)):  # what a small sphere does at the surface of a large one is narrow
        small, large = who[k]
        wanted = min(HIGHEST, int(DEGREE * np.sqrt(radii[large] / radii[small])))
        most[large] = max(most[large], wanted)
    for k in range(len(who)):
        alphas = decay(between(centres, who[k, 0], who[k, 1]), radii[who[k, 0]], radii[who[k, 1]])
        for side in range(2):
            sphere, wanted = who[k, side], needed(SPREAD, alphas[side])
            pairs[k, side] = max(LEAST, min(wanted, most[sphere]))
            near[k] = max(near[k], 1 if wanted > most[sphere] else 0)
            spheres[sphere] = max(spheres[sphere], pairs[k, side])
    if wall:
        for i in range(len(radii)):
            spheres[i] = max(spheres[i], min(needed(SPREAD, wall_decay(gaps[i], radii[i])), most[i]))
    return Degrees(spheres, who, pairs, near, 0.0)
