"""Which pairs are near, and the degrees of their harmonics; compiled."""

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.harmonics.degrees import Degrees, decay, needed, wall_decay
from mpad_core.numerics.harmonics.layout import between
from mpad_core.numerics.neighbours import near_pairs

REACH = 1.5
"""Smaller radii: the gap within which a pair is near. Beyond, degrees above the moments change u by less than 2e-3."""

DEGREE = 4
"""Of equal near spheres: with lubrication, two and the wall are right to 1.5e-2 (u) and 2.5e-2 (mobility)."""

LEAST = 2
"""That of the stresslet."""

HIGHEST = 40
"""Of the larger of two spheres, whatever the ratio: blocks grow as its cube."""

SPREAD = 11.5
"""Harmonics count until they have fallen by exp(-SPREAD); with fewer, lone spheres near the wall feel strain less."""


@compiled
def degrees_of(centres: Array, radii: Array, gaps: Array, wall: bool) -> Degrees:
    """List the near pairs, and give degrees to them and to all spheres; gaps (N,) are those to the wall, if any."""
    who = near_pairs(centres, radii, REACH)
    spheres, pairs = np.full(len(radii), LEAST), np.empty_like(who)
    most = np.full(len(radii), DEGREE)
    for k in range(len(who)):  # what a small sphere does at the surface of a large one is narrow
        small, large = who[k]
        wanted = min(HIGHEST, int(DEGREE * np.sqrt(radii[large] / radii[small])))
        most[large] = max(most[large], wanted)
    for k in range(len(who)):
        alphas = decay(between(centres, who[k, 0], who[k, 1]), radii[who[k, 0]], radii[who[k, 1]])
        for side in range(2):
            sphere = who[k, side]
            pairs[k, side] = max(LEAST, min(needed(SPREAD, alphas[side]), most[sphere]))
            spheres[sphere] = max(spheres[sphere], pairs[k, side])
    if wall:
        for i in range(len(radii)):
            spheres[i] = max(spheres[i], min(needed(SPREAD, wall_decay(gaps[i], radii[i])), most[i]))
    return Degrees(spheres, who, pairs, np.ones(len(who), np.int64), 0.0)
