"""Where the binding molecules of the cells are: fixed on each sphere at the tips of its bumps, by its layouts."""

from functools import partial

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.errors import InputError
from mpad_core.numerics.streams import Stream, fill_uniform, key_of
from mpad_core.physics.layouts.uniform import Uniform
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

    Raises
    ------
    InputError
        If a layout finds no room, naming the cell.
    """
    arms: list[Array] = [np.zeros((0, 3))]
    kinds: list[Indices] = [np.zeros(0, np.int64)]
    counts = site_counts(problem)
    for cell in range(len(problem.names)):
        for kind, number in enumerate(counts[cell]):
            arms.append(_arms(problem, cell, kind, int(number)))
            kinds.append(np.full(number, kind, np.int64))
    first = np.concatenate([[0], np.cumsum(counts.sum(axis=1))]).astype(np.int64)
    return Sites(arm=np.concatenate(arms), first=first, kind=np.concatenate(kinds))


def _arms(problem: Problem, cell: int, kind: int, number: int) -> Array:
    """Place the molecules of one kind on one cell."""
    layout = problem.layouts[cell][kind] if problem.layouts else Uniform()
    shell = float(problem.radii[cell] + problem.roughness[cell])
    draw = partial(_drawn, key_of(problem.seed), identity_of(problem.names[cell]), kind)
    try:
        return shell * layout.directions(number, float(problem.radii[cell]), shell, draw)
    except ValueError as error:
        raise InputError(f"cell {problem.names[cell]!r}: layout of its sites: {error}") from error


def _drawn(key: np.uint64, identity: np.uint64, kind: int, sequence: int, first: int, number: int) -> Array:
    draws = np.empty((number, 2))
    # a cell has at most 1e8 molecules of a kind, so no sequence runs into the next
    fill_uniform(key, int(Stream.RECEPTORS), identity, (kind << 40) + (sequence << 36) + first, draws)
    return draws


def identity_of(name: str) -> np.uint64:
    """Give the 64-bit identity of a name, for draws."""
    words = np.frombuffer(name.encode().ljust(-(-len(name.encode()) // 4) * 4, b"\0"), "<u4")
    return np.uint64(np.random.SeedSequence([int(word) for word in words]).generate_state(1, np.uint64)[0])
