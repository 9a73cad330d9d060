"""How much independent information lies in series that remember themselves: correlation times and blocks.

The moving-block bootstrap (Künsch, Ann. Statist. 17:1217, 1989) with blocks of five integrated autocorrelation times.
Blocks never reach over the end of a series. All series are drawn from alike, so series shorter than a block count as
one block each: cells that differ from each other are resampled as wholes.
"""

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.signal import correlate

from mpad_core.arrays import Array

Statistic: TypeAlias = Callable[[Array], Array]  # (..., q) means of a series' columns -> (...)

TIMES_PER_BLOCK = 5  # the variance of a mean is then too small by a tenth for an AR(1) series, its interval by 5 %
_WINDOW = (
    5  # correlation times after which the correlation is taken for noise (Sokal, Monte Carlo methods, 1996, ch. 3)
)
_MOST_BLOCKS = 100  # longer blocks lose nothing where there are more of them: Student's factor is 1.02
_CHUNK = 2**22  # numbers held at a time


def means(series: Sequence[Array]) -> Array:
    """Give the means (q,) over all rows of series (n, q)."""
    mean: Array = np.concatenate(series).mean(axis=0)
    return mean


def influence(series: Sequence[Array], statistic: Statistic) -> list[Array]:
    """Give what each row adds to a statistic, to first order: (n,) a series, of mean zero over all of them."""
    centre = means(series)
    steps = 1e-4 * np.sqrt(np.mean([np.mean((s - centre) ** 2, axis=0) for s in series], axis=0))
    shifts = np.diag(np.where(steps > 0, steps, 1.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = (statistic(centre + shifts) - statistic(centre - shifts)) / (2 * np.diag(shifts))
    slopes = np.where(np.isfinite(slopes) & (steps > 0), slopes, 0.0)
    return [(s - centre) @ slopes for s in series]


def correlation_time(series: Sequence[Array]) -> float:
    """Give the integrated autocorrelation time 1 + 2 Σ ρ_k of series of mean zero, in rows; at least 1.

    Parameters
    ----------
    series : (n,) each
        Taken together: differences between them that last count as memory.
    """
    longest = max(len(s) for s in series)
    products, pairs = np.zeros(longest), np.zeros(longest)
    for s in series:
        products[: len(s)] += correlate(s, s, method="fft")[len(s) - 1 :]
        pairs[: len(s)] += np.arange(len(s), 0, -1)
    if products[0] <= 0:
        return 1.0
    times = 2 * np.cumsum((products / pairs) / (products[0] / pairs[0])) - 1
    ends = np.flatnonzero(np.arange(longest) >= _WINDOW * times)
    # where the memory outlasts the series, the series itself is the longest time that can be told
    return max(float(times[ends[0]]) if len(ends) else float(longest), 1.0)


def block_length(series: Sequence[Array], statistic: Statistic) -> int:
    """Choose the length of blocks, in rows, for a statistic of the means of series (n, q)."""
    rows = sum(len(s) for s in series)
    time = correlation_time(influence(series, statistic))
    return int(max(np.ceil(TIMES_PER_BLOCK * time), np.ceil(rows / _MOST_BLOCKS), 1))


@frozen(kw_only=True, eq=False)
class Blocks:
    """The blocks that can be drawn from S series: sums over them, and where each series' own begin."""

    sums: Array  # (K, q + 1): columns, and the number of rows
    first: NDArray[np.int64]  # (S,) row of `sums` where a series' blocks begin
    choices: NDArray[np.int64]  # (S,) how many blocks can be begun in it
    holds: NDArray[np.int64]  # (S,) how many it holds next to each other: how often it is drawn

    @property
    def number(self) -> int:
        """How many blocks a draw has."""
        return int(self.holds.sum())

    def expected(self) -> Array:
        """Give the mean (q,) that draws have on average: ends of series are in fewer blocks than their middle."""
        own = np.add.reduceat(self.sums, self.first, axis=0) / self.choices[:, None]
        total = self.holds @ own
        mean: Array = total[:-1] / total[-1]
        return mean

    def drawn(self, draws: int, dice: np.random.Generator) -> Array:
        """Draw that many times as many blocks as there are; give the means (draws, q) over the rows of each draw."""
        owners = np.repeat(np.arange(len(self.holds)), self.holds)
        at_once = max(_CHUNK // (len(owners) * self.sums.shape[1]), 1)
        found: list[Array] = []
        for begun in range(0, draws, at_once):
            owner = owners[dice.integers(len(owners), size=(min(at_once, draws - begun), len(owners)))]
            picked = self.first[owner] + (dice.random(owner.shape) * self.choices[owner]).astype(np.int64)
            total = self.sums[picked].sum(axis=1)
            found.append(total[:, :-1] / total[:, -1:])
        return np.concatenate(found)


def blocks_of(series: Sequence[Array], length: int) -> Blocks:
    """Cut series (n, q) into blocks of at least a length, as few rows more as use the series up."""
    holds = np.array([max(len(s) // length, 1) for s in series])
    sizes = [len(s) // number for s, number in zip(series, holds, strict=True)]
    sums = [_sums(s, size) for s, size in zip(series, sizes, strict=True)]
    choices = np.array([len(own) for own in sums])
    return Blocks(sums=np.concatenate(sums), first=np.cumsum(choices) - choices, choices=choices, holds=holds)


def _sums(rows: Array, size: int) -> Array:
    total = np.concatenate([np.zeros((1, rows.shape[1])), np.cumsum(rows, axis=0)])
    own = total[size:] - total[:-size]
    return np.column_stack([own, np.full(len(own), float(size))])
