"""How many degrees each sphere and each pair needs for an accuracy, from the gaps at hand."""

import math
from typing import NamedTuple

import numpy as np

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.harmonics.layout import between

LEAST_OF_SPHERES, LEAST_OF_PAIRS = 3, 2
"""One more than the coarse level must have: shear drives degree 2 of a sphere, and pairs feel each other's forces."""

HIGH = 10**6
"""More than any degree."""

HIGHEST_CHOSEN = 60
"""Highest degree that is chosen without being asked for: blocks grow as its cube."""


class Degrees(NamedTuple):
    """Degrees of spheres and of pairs, and which pairs need lubrication since their degrees do not resolve the gap."""

    spheres: Indices  # (N,)
    who: Indices  # (P, 2): the pairs, target and source; the source is the larger
    pairs: Indices  # (P, 2): their degrees
    near: Indices  # (P,): 1 for the pairs with lubrication
    alpha: float  # the slowest decay of what is not resolved, see `decay`; of all spheres and pairs


@compiled
def decay(distance: float, a: float, b: float) -> tuple[float, float]:
    """Give α of two spheres in bispherical coordinates: harmonics of degree l on one come back as exp(-2 α l)."""
    product = (distance - a - b) * (distance + a + b) * (distance * distance - (a - b) ** 2)
    focal = math.sqrt(max(product, 0.0)) / (2 * distance)
    return math.asinh(focal / a), math.asinh(focal / b)


@compiled
def wall_decay(gap: float, radius: float) -> float:
    """Give α of a sphere above the wall, cosh α = 1 + gap/radius."""
    eps = gap / radius
    return math.log1p(eps + math.sqrt(eps * (2 + eps)))


@compiled
def needed(spread: float, alpha: float) -> int:
    """Give the degree at which exp(-2 α l) has fallen by exp(-spread)."""
    return min(HIGH, math.ceil(spread / (2 * max(alpha, 1e-9))))


@compiled
def choose(centres: Array, radii: Array, gaps: Array, wall: bool, spread: float, most: Indices, fixed: int) -> Degrees:
    """Give the degrees that the gaps call for.

    Parameters
    ----------
    centres, radii, gaps, wall
        The spheres; gaps are to the wall, if there is one.
    spread
        Harmonics count until they have fallen by exp(-spread).
    most : (N,)
        Degree of each sphere from which on near gaps are left to lubrication.
    fixed
        Degree of all spheres and pairs, whatever the gaps, or 0.
    """
    n = len(radii)
    count = n * (n - 1) // 2
    who, pairs = np.empty((count, 2), dtype=np.int64), np.empty((count, 2), dtype=np.int64)
    spheres, near = np.full(n, fixed if fixed > 0 else LEAST_OF_SPHERES), np.zeros(count, dtype=np.int64)
    slowest, k = 1e9, 0
    for i in range(n):
        if wall:
            alpha = wall_decay(gaps[i], radii[i])
            slowest = min(slowest, alpha)
            if fixed == 0:
                spheres[i] = max(LEAST_OF_SPHERES, min(needed(spread, alpha), most[i]))
        for j in range(i):
            who[k, 0], who[k, 1] = (i, j) if radii[i] <= radii[j] else (j, i)
            k += 1
    for k in range(count):
        i, j = who[k]
        distance = between(centres, i, j)
        alphas = decay(distance, radii[i], radii[j])
        for side in range(2):
            sphere, wanted = who[k, side], needed(spread, alphas[side])
            pairs[k, side] = fixed if fixed > 0 else max(LEAST_OF_PAIRS, min(wanted, most[sphere]))
            spheres[sphere] = max(spheres[sphere], pairs[k, side])
            near[k] = max(near[k], 1 if wanted > pairs[k, side] else 0)
            slowest = min(slowest, alphas[side])
    return Degrees(spheres, who, pairs, near, slowest)


@compiled
def fewer(degree: int, least: int) -> int:
    """Give the degree of the coarse level: an even one (odd and even err differently), half at most."""
    return max(least, 2 * (degree // 4))


@compiled
def coarser(fine: Degrees) -> Degrees:
    """Give the degrees of the coarse level, for the error estimate; near pairs stay near."""
    spheres, pairs = fine.spheres.copy(), fine.pairs.copy()
    for i in range(len(spheres)):
        spheres[i] = fewer(spheres[i], LEAST_OF_SPHERES - 1)
    for k in range(len(pairs)):
        for side in range(2):
            pairs[k, side] = fewer(pairs[k, side], LEAST_OF_PAIRS - 1)
    return Degrees(spheres, fine.who, pairs, fine.near, fine.alpha)


def spread_of(accuracy: float) -> float:
    """Give how far harmonics must fall for an accuracy of the velocities."""
    return math.log(1000 / accuracy)


def most_degree(accuracy: float) -> int:
    """Give the degree from which on near contact is left to lubrication, for an accuracy of the velocities.

    What is left then is the coupling of three surfaces near each other, which higher degrees reduce but slowly;
    measured for two and more spheres at the wall, gaps from 1e-3 to 1 radii (1e-2 and 1e-3) and from 0.05 on (1e-4).
    """
    digits = -math.log10(accuracy)
    return max(4, 4 * math.ceil(0.5 * digits * digits - 0.5 * digits))


@compiled
def most_degrees(most: int, radii: Array) -> Indices:
    """Give the highest degree (N,) of each sphere: more for those that are not the smallest.

    Seen from a large sphere, what a small one at its surface does is narrow in proportion to its radius. The pair's own
    resistance is right by lubrication; for a small sphere in the corner between a large one and the wall, the root of
    the ratio of radii is what was measured to do.
    """
    out = np.full(len(radii), most)
    for i in range(len(radii)):
        for j in range(len(radii)):
            if radii[j] < radii[i]:
                out[i] = max(out[i], min(HIGHEST_CHOSEN, int(most * math.sqrt(radii[i] / radii[j]))))
    return out


def extrapolated(fine: Degrees, coarse: Degrees) -> float:
    """Give the error of the fine level over its difference to the coarse one.

    Errors fall as exp(-2 α p) where harmonics resolve the gap, more slowly where three surfaces meet: taken is
    exp(-α p) at the narrowest gap, and no gain where that is almost closed. The factor before it is measured.
    """
    gained = max(int((fine.spheres - coarse.spheres).max()), 1)
    return 0.18 * min(1.0, 1 / math.expm1(min(fine.alpha * gained, 50.0)))
