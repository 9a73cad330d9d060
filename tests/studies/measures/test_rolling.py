"""Velocities, deviations, pauses and steps of tracks for which they are known."""

import math

import numpy as np
import pytest

from mpad_core.studies.measures import rolling
from mpad_core.studies.measures.estimates import estimate
from mpad_core.studies.measures.pauses import (
    PauseRule,
    motion_of,
    pause_count,
    pause_rate,
    pause_share,
    pause_time,
    step_deviation,
    step_size,
)
from mpad_core.studies.measures.tracks import Track

RULE = PauseRule(slower_than=1.0, at_least=0.1)
CELLS = 6
FALSE_ALARM = 5  # standard deviations: odds of 6e-7 for each number


def track(x, y=None, every=0.1, **more):
    x = np.asarray(x, float)
    return Track(times=every * np.arange(len(x)), x=x, y=np.zeros(len(x)) if y is None else y, name="a", **more)


@pytest.fixture(scope="module")
def crowd(rolling_track):
    return [rolling_track(seed, run=f"run {seed}") for seed in range(CELLS)]


class TestUniformMotion:
    uniform = (track(2.5 * 0.1 * np.arange(201), 0.3 * 0.1 * np.arange(201)),)

    def test_velocity(self):
        found = estimate(rolling.velocity(self.uniform))
        assert (found.value, found.low, found.high) == pytest.approx((2.5, 2.5, 2.5), rel=1e-12)
        assert (found.cells, found.seeds) == (1, 1)

    def test_no_fluctuation_and_no_deviation(self):
        assert rolling.fluctuation(self.uniform).value() < 1e-6
        assert rolling.deviation(self.uniform, 1.0).value() < 1e-12
        assert rolling.deviation(self.uniform, 1.0, across=True).value() < 1e-12
        assert rolling.deviation([track(np.full(50, 20.1))], 1.0).value() < 1e-14

    def test_no_pause(self):
        assert pause_count(self.uniform, RULE) == 0
        assert pause_share(self.uniform, RULE).value() == 0
        assert pause_count(self.uniform, PauseRule(slower_than=3.0)) == 1


class TestWhatIsWorkedOutByHand:
    def test_velocity_and_fluctuation(self):
        tracks = [track([0, 1, 3]), track([0, 0, 0], run="other")]
        assert rolling.velocity(tracks).value() == pytest.approx(7.5)  # of 10, 20, 0, 0
        assert rolling.fluctuation(tracks).value() == pytest.approx(math.sqrt(125 - 7.5**2))
        assert rolling.relative_fluctuation(tracks).value() == pytest.approx(math.sqrt(125 - 7.5**2) / 7.5)
        assert (rolling.velocity(tracks).cells, rolling.velocity(tracks).seeds) == (2, 2)

    def test_deviation_from_the_line_in_each_window(self):
        """Two windows of two intervals: 0 1 0 leaves 1/6 + 4/6 about its line, by 3 − 2; 0 1 2 leaves nothing."""
        found = rolling.deviation([track([0, 1, 0, 1, 2])], 0.2)
        assert found.series[0].ravel().tolist() == pytest.approx([2 / 3, 0])
        assert found.value() == pytest.approx(math.sqrt(1 / 3))

    def test_deviation_far_from_the_origin(self):
        near, far = ([track(base + np.array([0, 1e-3, 0, 1e-3, 2e-3]))] for base in (0.0, 1e6))
        assert rolling.deviation(far, 0.2).value() == pytest.approx(rolling.deviation(near, 0.2).value(), rel=1e-6)

    def test_windows_longer_than_the_track_give_none(self):
        assert math.isnan(rolling.deviation([track([0, 1, 0])], 0.5).value())

    def test_pauses_and_steps(self):
        """Rests of three, two and one intervals; one interval is too short for a while of two."""
        x = [0, 5, 5, 5, 5, 7, 7, 7, 8, 8, 9, 9, 9, 9]
        motion = motion_of(track(x), PauseRule(slower_than=1.0, at_least=0.2))
        assert motion.paused.tolist() == [0, 1, 1, 1, 0, 1, 1, 0, 0, 0, 1, 1, 1]
        assert motion.steps.tolist() == [2, 2]
        assert motion.moving.tolist() == pytest.approx([0.1, 0.3])
        found = [track(x)]
        rule = PauseRule(slower_than=1.0, at_least=0.2)
        assert pause_count(found, rule) == 3
        assert pause_share(found, rule).value() == pytest.approx(8 / 13)
        assert pause_time(found, rule).value() == pytest.approx(0.8 / 2)  # two are seen to end
        assert pause_rate(found, rule).value() == pytest.approx(3 / 1.3)
        assert step_size(found, rule).value() == 2
        assert step_deviation(found, rule).value() == 0

    def test_a_while_of_whole_frames_is_not_rounded_up_for_its_last_digit(self):
        """2.1 s are three intervals of 0.7 s, though their quotient is 3.0000000000000004."""
        x = [0, 5, 5, 5, 5, 10, 15, 20, 25]
        assert pause_count([track(x, every=0.7)], PauseRule(slower_than=1.0, at_least=2.1)) == 1
        assert pause_count([track(x, every=0.7)], PauseRule(slower_than=1.0, at_least=2.11)) == 0

    def test_noise_below_the_threshold_does_not_end_a_pause(self):
        noise = 0.04 * np.random.default_rng(1).uniform(-1, 1, size=500)  # up to 8 um/s from frame to frame at 10 ms
        assert motion_of(track(noise, every=0.01), RULE).paused.all()

    def test_a_track_of_one_frame(self):
        assert pause_count([track([1.0])], RULE) == 0
        assert math.isnan(rolling.velocity([track([1.0])]).value())


class TestRestsAndJumps:
    """Rests of 0.2 s and an exponential time of mean 0.3 s, jumps of 1 ± 0.2 µm; 400 of them in each of six cells."""

    number = CELLS * 200.0 / 0.5

    def near(self, sample, truth, spread):
        found = estimate(sample)
        assert abs(found.value - truth) < FALSE_ALARM * spread
        # the interval has the width of the known spread, to within what 100 blocks or more leave of it (7 %, 5 sd)
        assert found.high - found.low == pytest.approx(2 * 1.96 * spread, rel=0.4)

    def test_pauses(self, crowd):
        """A jump falls into an interval of 10 ms, which is no pause. Renewal theory: Cox, Renewal Theory, 1962, §4."""
        self.near(pause_time(crowd, RULE), 0.49, 0.3 / math.sqrt(self.number))
        self.near(pause_rate(crowd, RULE), 2.0, math.sqrt(0.3**2 / 0.5**3 / (CELLS * 200)))

    def test_steps(self, crowd):
        self.near(step_size(crowd, RULE), 1.0, 0.2 / math.sqrt(self.number))
        self.near(step_deviation(crowd, RULE), 0.2, 0.2 / math.sqrt(2 * self.number))

    def test_velocity(self, crowd):
        """A renewal-reward process: variance of (jump − v · rest) by the mean rest."""
        self.near(rolling.velocity(crowd), 2.0, math.sqrt((0.2**2 + 4 * 0.3**2) / 0.5 / (CELLS * 200)))

    def test_cells_and_seeds_are_counted(self, crowd):
        found = estimate(rolling.velocity(crowd))
        assert (found.cells, found.seeds) == (CELLS, CELLS)
