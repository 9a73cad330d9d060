"""How fast cells roll, how unsteadily, and how far they stray from a straight path.

All of it is of displacements between the frames of a camera, and depends on their interval: see `resampled`.
"""

from collections.abc import Sequence

import numpy as np

from mpad_core.arrays import Array
from mpad_core.studies.measures.estimates import Sample, deviation_of, mean_of
from mpad_core.studies.measures.tracks import Track, counted, interval_of


def velocity(tracks: Sequence[Track]) -> Sample:
    """Give the rolling velocity (µm/s): the displacement along the flow, by the time it took.

    Parameters
    ----------
    tracks
        Of one interval between frames, as `resampled` gives them.
    """
    return Sample(series=[_velocities(t) for t in tracks], statistic=mean_of, **counted(tracks))


def fluctuation(tracks: Sequence[Track]) -> Sample:
    """Give the standard deviation (µm/s) of the velocity from frame to frame, over all frames of all cells."""
    series = [np.stack([_velocities(t), _velocities(t) ** 2], axis=1) for t in tracks]
    return Sample(series=series, statistic=deviation_of, least=0.0, **counted(tracks))


def relative_fluctuation(tracks: Sequence[Track]) -> Sample:
    """Give the standard deviation of the velocity by the mean's magnitude."""
    series = [np.stack([_velocities(t), _velocities(t) ** 2], axis=1) for t in tracks]

    def relative(mean: Array) -> Array:
        found: Array = deviation_of(mean) / np.abs(mean[..., 0])
        return found

    return Sample(series=series, statistic=relative, least=0.0, **counted(tracks))


def deviation(tracks: Sequence[Track], window: float, *, across: bool = False) -> Sample:
    """Give the root mean square distance (µm) from uniform motion along a straight line, over windows of time.

    Parameters
    ----------
    tracks
        Of one interval between frames.
    window
        s. In each window, one after the other, the line is that of least squares; the longer the window, the further
        a cell strays. A record shorter than the window has no such number.
    across
        Whether y is looked at, across the flow, or x, along it.
    """
    series = [_squares(t.y if across else t.x, _frames(t, window)) for t in tracks]
    return Sample(series=series, statistic=lambda mean: np.sqrt(mean[..., 0]), least=0.0, **counted(tracks))


def _velocities(track: Track) -> Array:
    # by each interval's own length: a sum of displacements, by the whole time, to the last digit
    return np.diff(track.x) / interval_of(track) if len(track) > 1 else np.empty(0)


def _frames(track: Track, window: float) -> int:
    """Give the number of frames that a window spans; more than there are, where it is longer than the track."""
    return round(window / interval_of(track)) + 1 if len(track) > 1 else len(track) + 1


def _squares(place: Array, frames: int) -> Array:
    """Give the mean squares (W,) of what is left of (T,) places when a line is taken away in each window.

    Windows share the frame at which one ends and the next begins. Two parameters are fitted, so the sum of squares is
    divided by two less than the number of frames.
    """
    windows = (len(place) - 1) // (frames - 1) if frames > 2 else 0
    rows = np.array([place[k * (frames - 1) : (k + 1) * (frames - 1) + 1] for k in range(windows)])
    if not windows:
        return np.empty(0)
    base = np.linalg.qr(np.vander(np.linspace(-1, 1, frames), 2))[0]
    rows = rows - rows.mean(axis=1, keepdims=True)  # first: what does not move has no deviation, to the last digit
    left = rows - rows @ base @ base.T
    squares: Array = np.sum(left**2, axis=1) / max(frames - 2, 1)
    return squares
