"""Pauses of rolling cells, and the steps between them.

A cell pauses as long as it stays slow over every while: |x(t + while) − x(t)| below a threshold speed times the while.
Over a while and not from frame to frame, so that neither the camera's noise nor its rate decides. There is no agreed
threshold, so it is always told with the result. Pauses shorter than the while are missed: of pauses that last
exponentially long with mean τ, those that are found last τ plus the while on average.
"""

from collections.abc import Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from mpad_core.arrays import Array
from mpad_core.studies.measures.estimates import Sample, deviation_of, mean_of, quotient
from mpad_core.studies.measures.tracks import Track, counted, interval_of

_ROUNDING = 1e-9


@frozen(kw_only=True)
class PauseRule:
    """When a cell counts as pausing."""

    slower_than: float  # µm/s, on average over a while
    at_least: float = 0.1  # s: the while; whole intervals between frames, rounded up


@frozen(kw_only=True, eq=False)
class Motion:
    """One track told apart into pauses and movement (T − 1 intervals between frames)."""

    every: float  # s
    paused: NDArray[np.bool_]  # (T − 1,)
    steps: Array  # µm, displacements between a pause and the next one
    moving: Array  # s, how long each of those took


def motion_of(track: Track, rule: PauseRule) -> Motion:
    """Tell pauses from movement; what lies before the first pause and after the last is no step."""
    every = interval_of(track)
    paused = _paused(track.x, every, rule)
    begins, ends = _stretches(~paused)
    whole = (begins > 0) & (ends < len(paused))
    steps = track.x[ends[whole]] - track.x[begins[whole]]
    moving: Array = every * (ends - begins)[whole].astype(float)
    return Motion(every=every, paused=paused, steps=steps, moving=moving)


def _paused(x: Array, every: float, rule: PauseRule) -> NDArray[np.bool_]:
    """Tell for each interval whether it lies in a while over which the cell is slow."""
    if len(x) < 2:
        return np.zeros(0, bool)
    frames = max(int(np.ceil(rule.at_least / every - _ROUNDING)), 1)
    slow = np.abs(x[frames:] - x[:-frames]) < rule.slower_than * every * frames
    covered = np.zeros(len(x), np.int64)
    covered[: len(slow)] += slow
    covered[frames : frames + len(slow)] -= slow
    paused: NDArray[np.bool_] = np.cumsum(covered)[:-1] > 0
    return paused


def _stretches(flags: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Give where stretches of True begin, and the first place after each."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)


def pause_count(tracks: Sequence[Track], rule: PauseRule) -> int:
    """Count all pauses, those that a record's edge cuts off too."""
    return sum(len(_stretches(motion_of(t, rule).paused)[0]) for t in tracks)


def _turns(tracks: Sequence[Track], rule: PauseRule) -> list[Array]:
    """Give a row an interval: paused or not, a pause begins here, a pause has ended here, 1/s to a row."""
    found = []
    for track in tracks:
        motion = motion_of(track, rule)
        change = np.diff(motion.paused.astype(float), prepend=motion.paused[:1].astype(float))
        if len(track) > 1:
            found.append(np.stack([motion.paused, change > 0, change < 0, np.full(len(change), motion.every)], axis=1))
    return [np.asarray(rows, float) for rows in found]


def pause_share(tracks: Sequence[Track], rule: PauseRule) -> Sample:
    """Give the share of time that cells pause."""
    return Sample(series=_turns(tracks, rule), statistic=mean_of, least=0.0, most=1.0, **counted(tracks))


def pause_rate(tracks: Sequence[Track], rule: PauseRule) -> Sample:
    """Give how often a pause begins (1/s)."""
    return Sample(series=_turns(tracks, rule), statistic=quotient(1, 3), least=0.0, **counted(tracks))


def pause_time(tracks: Sequence[Track], rule: PauseRule) -> Sample:
    """Give the mean duration of pauses (s): all time in pauses by the number of pauses seen to end.

    So pauses that a record's edge cuts off count with the time they were seen; for pauses that end at a constant rate
    this is the estimate of greatest likelihood.
    """

    def lasting(mean: Array) -> Array:
        found: Array = mean[..., 0] * mean[..., 3] / mean[..., 2]
        return found

    return Sample(series=_turns(tracks, rule), statistic=lasting, least=0.0, **counted(tracks))


def step_sizes(tracks: Sequence[Track], rule: PauseRule) -> list[Array]:
    """Give the displacements (µm) along the flow between pauses, one series a track, in order."""
    return [motion_of(track, rule).steps for track in tracks]


def step_size(tracks: Sequence[Track], rule: PauseRule) -> Sample:
    """Give the mean step (µm)."""
    return Sample(series=step_sizes(tracks, rule), statistic=mean_of, **counted(tracks))


def step_deviation(tracks: Sequence[Track], rule: PauseRule) -> Sample:
    """Give the standard deviation of steps (µm)."""
    series = [np.stack([s, s**2], axis=1) for s in step_sizes(tracks, rule)]
    return Sample(series=series, statistic=deviation_of, least=0.0, **counted(tracks))
