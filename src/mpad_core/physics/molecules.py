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


def site_counts(problem: Problem) -> Indices:
    """Give how many molecules of each kind each cell has (N, kinds): density times the area of the smooth sphere."""
    area = 4 * np.pi * problem.radii**2
    counts: Indices = np.rint(problem.site_densities * area[:, None]).astype(np.int64)
    return counts


def place_sites(problem: Problem) -> Sites:
    """Place the molecules of every cell.

    Draws are keyed by the cell's name, so a cell has the same molecules whichever other cells are there.
    """
    key = key_of(problem.seed)
    arms: list[Array] = [np.zeros((0, 3))]
    kinds: list[Indices] = [np.zeros(0, np.int64)]
    counts = site_counts(problem)
    for cell, name in enumerate(problem.names):
        for kind, number in enumerate(counts[cell]):
            draws = np.empty((number, 2))
            fill_uniform(key, int(Stream.RECEPTORS), identity_of(name), kind << 40, draws)
            cosine, azimuth = 2 * draws[:, 0] - 1, 2 * np.pi * draws[:, 1]
            sine = np.sqrt(1 - cosine**2)
            shell = problem.radii[cell] + problem.roughness[cell]
            arms.append(shell * np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1))
            kinds.append(np.full(number, kind, np.int64))
    first = np.concatenate([[0], np.cumsum(counts.sum(axis=1))]).astype(np.int64)
    return Sites(arm=np.concatenate(arms), first=first, kind=np.concatenate(kinds))


def identity_of(name: str) -> np.uint64:
    """Give the 64-bit identity of a name, for draws."""
    words = np.frombuffer(name.encode().ljust(-(-len(name.encode()) // 4) * 4, b"\0"), "<u4")
    return np.uint64(np.random.SeedSequence([int(word) for word in words]).generate_state(1, np.uint64)[0])
