"""Where the binding molecules of the cells are: fixed on each sphere, uniformly at random, at the tips of its bumps."""

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.streams import Stream, fill_uniform, key_of
from mpad_core.physics.problem import Problem


@frozen(kw_only=True, eq=False)
class Sites:
    """All cells' molecules, those of one cell after those of the cell before."""

    arm: Array  # (S, 3) µm, from the centre, in the cell's frame
    first: Indices  # (N + 1,)
    kind: Indices  # (S,)


def place_sites(problem: Problem) -> Sites:
    """Place the molecules of every cell.

    Density times the area of the smooth sphere gives their number. Draws are keyed by the cell's name, so a cell has
    the same molecules whichever other cells are there.
    """
    key = key_of(problem.seed)
    arms: list[Array] = [np.zeros((0, 3))]
    kinds: list[Indices] = [np.zeros(0, np.int64)]
    counts = [0]
    for cell, name in enumerate(problem.names):
        area = 4 * np.pi * problem.radii[cell] ** 2
        count = 0
        for kind, density in enumerate(problem.site_densities[cell]):
            number = round(float(density) * area)
            draws = np.empty((number, 2))
            fill_uniform(key, int(Stream.RECEPTORS), identity_of(name), kind << 40, draws)
            cosine, azimuth = 2 * draws[:, 0] - 1, 2 * np.pi * draws[:, 1]
            sine = np.sqrt(1 - cosine**2)
            shell = problem.radii[cell] + problem.roughness[cell]
            arms.append(shell * np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1))
            kinds.append(np.full(number, kind, np.int64))
            count += number
        counts.append(count)
    return Sites(arm=np.concatenate(arms), first=np.cumsum(counts), kind=np.concatenate(kinds))


def identity_of(name: str) -> np.uint64:
    """Give the 64-bit identity of a name, for draws."""
    words = np.frombuffer(name.encode().ljust(-(-len(name.encode()) // 4) * 4, b"\0"), "<u4")
    return np.uint64(np.random.SeedSequence([int(word) for word in words]).generate_state(1, np.uint64)[0])
