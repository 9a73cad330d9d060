"""Intervals hold what they claim to hold, for series that remember themselves."""

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from mpad_core.studies.measures.blocks import block_length, blocks_of, correlation_time
from mpad_core.studies.measures.estimates import (
    Estimate,
    Sample,
    deviation_of,
    estimate,
    mean_of,
    proportion,
    quantile,
    quotient,
    rate,
    ratio,
)

SERIES = 2000


def autoregressive(rows, memory, *key):
    """Make a stationary series x' = memory · x + noise of mean zero and unit noise."""
    noise = np.random.default_rng([11, *key]).normal(size=rows)
    noise[0] /= math.sqrt(1 - memory**2)
    return lfilter([1.0], [1.0, -memory], noise)


def coverage(sample_of, truth):
    found = [estimate(sample_of(k), seed=k) for k in range(SERIES)]
    return np.mean([e.low <= truth <= e.high for e in found])


class TestCoverage:
    """The share of 2000 series whose interval holds the truth: 95 % with a spread of 0.5 %.

    So the limits of 90 and 98 % are ten and six spreads away; a false alarm has odds below 1e-8 each.
    """

    @pytest.mark.parametrize("memory", [pytest.param(0.0, marks=pytest.mark.slow), 0.8])
    def test_of_a_mean(self, memory):
        share = coverage(lambda k: Sample(series=[autoregressive(500, memory, k)]), 0.0)
        assert 0.90 < share < 0.98

    @pytest.mark.slow
    def test_of_a_mean_over_cells(self):
        share = coverage(lambda k: Sample(series=[autoregressive(120, 0.6, k, c) for c in range(4)]), 0.0)
        assert 0.90 < share < 0.98

    def test_of_cells_that_differ(self):
        """Each cell has a mean of its own: the interval is of the mean of all such cells, not of these five."""

        def cells(k):
            offsets = np.random.default_rng([12, k]).normal(size=5)
            return Sample(series=[offset + 0.2 * autoregressive(60, 0.3, k, c) for c, offset in enumerate(offsets)])

        assert 0.90 < coverage(cells, 0.0) < 0.98

    @pytest.mark.slow
    def test_of_a_skewed_number(self):
        """Quantiles of draws follow skewness to first order only: 92 % here, the limit six spreads below."""

        def skewed(k):
            x = np.exp(0.3 * autoregressive(600, 0.6, k))
            return Sample(series=[np.stack([x**2, x], axis=1)], statistic=quotient(0, 1))

        variance = 0.09 / (1 - 0.6**2)
        assert 0.88 < coverage(skewed, math.exp(1.5 * variance)) < 0.98

    @pytest.mark.slow
    def test_of_a_ratio_of_runs(self):
        """Deviation as above; the two series are independent, each of mean 5."""
        found = [
            ratio(
                Sample(series=[5 + autoregressive(400, 0.6, k, 0)]),
                Sample(series=[5 + autoregressive(400, 0.6, k, 1)]),
                seed=k,
            )
            for k in range(SERIES)
        ]
        assert 0.90 < np.mean([e.low <= 1 <= e.high for e in found]) < 0.98

    @pytest.mark.slow
    def test_of_a_median(self):
        found = [quantile([autoregressive(500, 0.5, k)], 0.5, cells=1, seeds=1) for k in range(SERIES)]
        assert 0.90 < np.mean([e.low <= 0 <= e.high for e in found]) < 0.98


def test_the_interval_has_the_width_that_theory_gives_and_shrinks_with_the_root_of_time():
    """Widths of 100 series: a spread of 1/sqrt(2 · 100 blocks), 7 %, so the mean is known to 0.7 %; 5 sd are 3.5 %.

    Blocks of five correlation times make the interval 5 % too narrow, Student's factor 2 % wider.
    """
    widths = []
    for rows in (2500, 10000):
        found = [estimate(Sample(series=[autoregressive(rows, 0.6, rows, k)])) for k in range(100)]
        exact = 2 * 1.96 / (1 - 0.6) / math.sqrt(rows)
        widths.append(np.mean([e.high - e.low for e in found]))
        assert widths[-1] == pytest.approx(exact, rel=0.09)
    assert widths[0] / widths[1] == pytest.approx(2.0, rel=0.07)


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9])
def test_correlation_time(memory):
    """Its spread is sqrt(2 (2 · 5 + 1) τ / n) τ (Sokal 1996, eq. 3.19), here of 64 series; 5 sd are allowed."""
    exact = (1 + memory) / (1 - memory)
    found = np.mean([correlation_time([autoregressive(20000, memory, k)]) for k in range(64)])
    # the window of five times leaves out a share exp(-5) of the sum
    assert found == pytest.approx(exact, rel=5 * math.sqrt(22 * exact / 20000 / 64) + math.exp(-5))


def test_memory_is_that_of_the_number_asked_for():
    """The square of a series forgets more quickly than the series: ρ² for ρ."""
    x = autoregressive(100_000, 0.9, 1)
    rows = np.stack([x, x**2], axis=1)
    of_mean, of_square = block_length([rows], mean_of), block_length([rows], lambda mean: mean[..., 1])
    assert of_square < 0.8 * of_mean or of_mean == of_square == 1000  # the least, a hundredth


def test_blocks_use_the_series_up_and_never_reach_over_an_end():
    blocks = blocks_of([np.ones((10, 1)), np.full((4, 1), 100.0), np.full((2, 1), 1000.0)], 3)
    assert blocks.holds.tolist() == [3, 1, 1]
    assert sorted(set((blocks.sums[:, 0] / blocks.sums[:, 1]).tolist())) == [1.0, 100.0, 1000.0]
    assert blocks.number == 5


def test_the_same_seed_gives_the_same_interval_and_another_another():
    sample = Sample(series=[autoregressive(500, 0.5, 3)])
    one, same, other = estimate(sample, seed=1), estimate(sample, seed=1), estimate(sample, seed=2)
    assert one == same
    assert one.low != other.low
    assert one.low != estimate(sample, seed=1, name="else").low


def test_one_block_gives_no_interval():
    found = estimate(Sample(series=[np.linspace(0, 1, 100)]))
    assert found.blocks == 1
    assert math.isnan(found.low)
    assert found.value == pytest.approx(0.5)


def test_no_rows_give_no_number():
    assert math.isnan(estimate(Sample(series=[np.empty(0), np.empty((0, 2))])).value)
    assert math.isnan(ratio(Sample(series=[]), Sample(series=[np.ones(5)])).value)
    assert math.isnan(quantile([np.empty(0)], 0.5, cells=0, seeds=0).value)


def test_a_constant_is_certain():
    found = estimate(Sample(series=[np.full(100, 2.5)]))
    assert (found.value, found.low, found.high) == (2.5, 2.5, 2.5)


def test_an_interval_stays_where_the_number_can_be():
    rows = np.stack([x := autoregressive(60, 0.5, 4), x**2], axis=1)
    open_one = estimate(Sample(series=[rows[:18]], statistic=deviation_of))
    kept = estimate(Sample(series=[rows[:18]], statistic=deviation_of, least=open_one.value, most=open_one.value))
    assert open_one.low < open_one.value < open_one.high
    assert kept.low == kept.high == open_one.value


def test_proportions_and_rates_against_tables():
    """Wilson's interval for 3 of 10 and Garwood's for 4 events, from published tables."""
    share = proportion(3, 10, cells=1, seeds=1)
    assert (share.low, share.high) == pytest.approx((0.1078, 0.6032), abs=1e-4)
    found = rate(4, 1.0, cells=1, seeds=1)
    assert (found.low, found.high) == pytest.approx((1.0899, 10.2416), abs=1e-4)
    assert rate(0, 2.0, cells=1, seeds=1).high == pytest.approx(3.6889 / 2, abs=1e-4)


def test_the_repr_is_a_line_of_a_table():
    assert repr(Estimate(2.5, 2.0, 3.25, cells=3, seeds=2, blocks=40)) == (
        "Estimate(2.5 [2, 3.25], 3 cells, 2 seeds, 40 blocks)"
    )
