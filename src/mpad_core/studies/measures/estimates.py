"""Numbers with their 95 % intervals, and how many cells, runs and blocks stand behind them.

The interval is that of the block bootstrap's quantiles about the draws' own centre, wider by Student's factor for the
number of blocks, so that few blocks give a wide interval and one block gives none.
"""

import math
import zlib
from collections.abc import Callable, Iterable

import numpy as np
from attrs import evolve, field, frozen
from scipy.stats import chi2, norm, t

from mpad_core.arrays import Array
from mpad_core.studies.measures.blocks import Blocks, Statistic, block_length, blocks_of, means

LEVEL = 0.95
DRAWS = 1000  # the spread of the quantiles at 2.5 % is then 4 % of the interval's half width
_TAIL = 0.5 * (1 - LEVEL)
_DEFINED = 0.99  # share of draws in which a statistic must have a value


@frozen
class Estimate:
    """A measured number and its 95 % interval; NaN where there is none."""

    value: float
    low: float = math.nan
    high: float = math.nan
    cells: int = field(default=0, kw_only=True)
    seeds: int = field(default=0, kw_only=True)  # independent runs, or tables of tracks
    blocks: int = field(default=0, kw_only=True)  # that count as independent; of events, their number

    def __repr__(self) -> str:
        """Say it as a table would."""
        behind = f"{self.cells} cells, {self.seeds} seeds, {self.blocks} blocks"
        return f"Estimate({self.value:.4g} [{self.low:.4g}, {self.high:.4g}], {behind})"


def _first(mean: Array) -> Array:
    first: Array = mean[..., 0]
    return first


def _rows(series: Iterable[Array]) -> tuple[Array, ...]:
    """Make each series two-dimensional; leave out those without rows."""
    tables = (np.asarray(s, dtype=np.float64) for s in series)
    return tuple(s.reshape(len(s), -1) for s in tables if len(s))


@frozen(kw_only=True, eq=False)
class Sample:
    """What a number is worked out of: series of rows, one a cell and run, and a function of the rows' means.

    Most that is asked of rolling cells is such a function: a speed, a standard deviation, a share of time, a time per
    event.
    """

    series: tuple[Array, ...] = field(converter=_rows)  # (n, q) each, equally spaced in time or by event
    statistic: Statistic = _first  # means (..., q) -> (...)
    least: float = -math.inf  # what the number cannot be below, nor its interval
    most: float = math.inf
    cells: int = 1
    seeds: int = 1

    def value(self) -> float:
        """Give the number, without an interval; NaN without rows."""
        return self._of(means(self.series)) if self.series else math.nan

    def _of(self, mean: Array) -> float:
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(self.statistic(mean))

    def blocks(self) -> Blocks:
        """Cut the series as the memory of this very number asks for."""
        return blocks_of(self.series, block_length(self.series, self.statistic))


@frozen(kw_only=True, eq=False)
class _Draws:
    """A number drawn anew by the bootstrap, beside itself and the centre of the draws."""

    value: float
    centre: float
    drawn: Array
    blocks: int


def estimate(sample: Sample, *, seed: int = 0, name: str = "") -> Estimate:
    """Give a sample's number with its interval.

    Parameters
    ----------
    sample
        Without rows it gives NaN.
    seed, name
        Of the bootstrap's draws: the same two give the same interval, whatever else is estimated.

    Returns
    -------
    Estimate
        Without an interval where the series hold only one block, or the number is undefined in more than one draw of a
        hundred.
    """
    if not sample.series:
        return Estimate(math.nan, cells=sample.cells, seeds=sample.seeds)
    found = _with_interval(_draws(sample, seed, name), sample.cells, sample.seeds)
    return evolve(found, low=max(found.low, sample.least), high=min(found.high, sample.most))


def ratio(above: Sample, below: Sample, *, seed: int = 0, name: str = "") -> Estimate:
    """Give the ratio of two independent samples' numbers with its interval.

    Parameters
    ----------
    above, below
        Of other runs each, since they are drawn independently. The interval means little where the number below may be
        zero.
    seed, name
        As for `estimate`.
    """
    cells, seeds = min(above.cells, below.cells), min(above.seeds, below.seeds)
    if not (above.series and below.series):
        return Estimate(math.nan, cells=cells, seeds=seeds)
    a, b = _draws(above, seed, f"{name} above"), _draws(below, seed, f"{name} below")
    with np.errstate(divide="ignore", invalid="ignore"):
        value, centre = np.divide([a.value, a.centre], [b.value, b.centre]).tolist()
        together = _Draws(value=value, centre=centre, drawn=a.drawn / b.drawn, blocks=min(a.blocks, b.blocks))
    return _with_interval(together, cells, seeds)


def _draws(sample: Sample, seed: int, name: str) -> _Draws:
    blocks = sample.blocks()
    entropy = np.random.SeedSequence(seed, spawn_key=(zlib.crc32(name.encode()),))
    means_drawn = blocks.drawn(DRAWS, np.random.Generator(np.random.Philox(entropy)))
    with np.errstate(divide="ignore", invalid="ignore"):
        drawn, centre = sample.statistic(means_drawn), float(sample.statistic(blocks.expected()))
    return _Draws(value=sample.value(), centre=centre, drawn=drawn, blocks=blocks.number)


def _with_interval(found: _Draws, cells: int, seeds: int) -> Estimate:
    defined = found.drawn[np.isfinite(found.drawn)]
    behind = {"cells": cells, "seeds": seeds, "blocks": found.blocks}
    enough = found.blocks > 1 and len(defined) >= _DEFINED * len(found.drawn)
    if not (enough and math.isfinite(found.value) and math.isfinite(found.centre)):
        return Estimate(found.value, **behind)
    below, above = np.quantile(defined, [_TAIL, 1 - _TAIL]) - found.centre
    wider = _student(found.blocks)
    low, high = found.value + wider * min(below, 0.0), found.value + wider * max(above, 0.0)
    return Estimate(found.value, float(low), float(high), **behind)


def _student(blocks: int) -> float:
    """Give how much wider an interval is for blocks so few, their variance being estimated with n for n - 1."""
    return float(math.sqrt(blocks / (blocks - 1)) * t.ppf(1 - _TAIL, blocks - 1) / norm.ppf(1 - _TAIL))


def quantile(
    series: Iterable[Array], share: float, *, cells: int, seeds: int, seed: int = 0, name: str = ""
) -> Estimate:
    """Give a quantile of values with its interval: that of the share below it, turned back into values.

    Parameters
    ----------
    series : (n,) each
        Values, one series a cell and run.
    share
        Which quantile, between 0 and 1.
    cells, seeds, seed, name
        As for `Sample` and `estimate`.

    Notes
    -----
    Woodruff, J. Am. Stat. Assoc. 47:635 (1952).
    """
    values = [np.asarray(s, float) for s in series if len(s)]
    if not values:
        return Estimate(math.nan, cells=cells, seeds=seeds)
    pooled = np.concatenate(values)
    at = float(np.quantile(pooled, share))
    shares = Sample(series=[(s <= at).astype(float) for s in values], least=0.0, most=1.0, cells=cells, seeds=seeds)
    below = estimate(shares, seed=seed, name=name)
    if not math.isfinite(below.low):
        return Estimate(at, cells=cells, seeds=seeds, blocks=below.blocks)
    low, high = np.quantile(pooled, np.clip([share + below.low - below.value, share + below.high - below.value], 0, 1))
    return Estimate(at, float(low), float(high), cells=cells, seeds=seeds, blocks=below.blocks)


def proportion(count: int, of: int, *, cells: int, seeds: int) -> Estimate:
    """Give a share of independent events with its interval (Wilson, J. Am. Stat. Assoc. 22:209, 1927)."""
    if not of:
        return Estimate(math.nan, cells=cells, seeds=seeds)
    z, p = float(norm.ppf(1 - _TAIL)), count / of
    middle, half = p + z**2 / (2 * of), z * math.sqrt(p * (1 - p) / of + z**2 / (4 * of**2))
    scale = 1 + z**2 / of
    return Estimate(p, (middle - half) / scale, (middle + half) / scale, cells=cells, seeds=seeds, blocks=of)


def rate(count: int, time: float, *, cells: int, seeds: int) -> Estimate:
    """Give the rate (1/s) of independent events in a time (s) with its interval (Garwood, Biometrika 28:437, 1936)."""
    if time <= 0:
        return Estimate(math.nan, cells=cells, seeds=seeds)
    low = 0.5 * float(chi2.ppf(_TAIL, 2 * count)) if count else 0.0
    high = 0.5 * float(chi2.ppf(1 - _TAIL, 2 * count + 2))
    return Estimate(count / time, low / time, high / time, cells=cells, seeds=seeds, blocks=count)


def mean_of(mean: Array) -> Array:
    """Give the first of the means: the statistic of a plain average."""
    return _first(mean)


def deviation_of(mean: Array) -> Array:
    """Give the standard deviation from the means of a value and of its square."""
    deviation: Array = np.sqrt(np.maximum(mean[..., 1] - mean[..., 0] ** 2, 0.0))
    return deviation


def quotient(above: int, below: int, factor: float = 1.0) -> Callable[[Array], Array]:
    """Give the statistic that divides one column's mean by another's, times a factor."""

    def divided(mean: Array) -> Array:
        found: Array = factor * mean[..., above] / mean[..., below]
        return found

    return divided
