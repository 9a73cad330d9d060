"""One cell's way along the wall: the same value whether a run or a camera saw it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import evolve, field, frozen

from mpad_core.arrays import Array
from mpad_core.records.trajectory import Trajectory

_ROUNDING = 1e-9  # of an interval: a frame at k intervals is one at k intervals, whatever its last digits


def _floats(values: Any) -> Array:
    return np.ascontiguousarray(values, dtype=np.float64)


@frozen(kw_only=True, eq=False, repr=False)
class Track:
    """Where one cell was (T frames), times ascending."""

    times: Array = field(converter=_floats)  # (T,), s
    x: Array = field(converter=_floats)  # (T,), µm, along the flow
    y: Array = field(converter=_floats)  # (T,), µm, along the wall across the flow
    name: str
    kind: str = ""
    run: str = ""  # which run or table it is from: tracks of one run are not independent
    radius: float = float("nan")  # µm

    def __repr__(self) -> str:
        """Say whose it is and how much there is."""
        span = f", {self.times[0]:g} to {self.times[-1]:g} s" if len(self) else ""
        return f"Track({self.name!r}, {len(self)} frames{span})"

    def __len__(self) -> int:
        """Give the number of frames."""
        return len(self.times)

    def x_at(self, time: float) -> float:
        """Give x (µm) at a time (s), between frames on a straight line."""
        return float(np.interp(time, self.times, self.x))

    def y_at(self, time: float) -> float:
        """Give y (µm) at a time (s), between frames on a straight line."""
        return float(np.interp(time, self.times, self.y))


def tracks_of(trajectory: Trajectory, *, run: str = "") -> tuple[Track, ...]:
    """Take the tracks of all cells out of a recorded trajectory, frame by frame as recorded."""
    header = trajectory.header
    return tuple(
        Track(
            times=trajectory.times,
            x=trajectory.positions[:, i, 0],
            y=trajectory.positions[:, i, 1],
            name=name,
            kind=header.kinds[i],
            run=run,
            radius=header.radii[i],
        )
        for i, name in enumerate(header.cells)
    )


def resampled(track: Track, every: float, *, after: float = 0.0) -> Track:
    """Give a track as a camera would have seen it: at whole multiples of an interval, nothing smoothed.

    Parameters
    ----------
    track
        Of any frames; between them on straight lines, so a frame that is missing leaves no gap.
    every
        s, between frames.
    after
        s: what was before is left out.

    Returns
    -------
    Track
        Without frames if the track does not reach the first of those times.
    """
    if not len(track):
        return track
    first = np.ceil(max(track.times[0], after) / every - _ROUNDING)
    last = np.floor(track.times[-1] / every + _ROUNDING)
    times = every * np.arange(first, last + 1)
    return evolve(
        track, times=times, x=np.interp(times, track.times, track.x), y=np.interp(times, track.times, track.y)
    )


def usual_interval(tracks: Sequence[Track]) -> float:
    """Give the median interval (s) between frames; NaN where no track has two."""
    intervals = [np.diff(track.times) for track in tracks if len(track) > 1]
    return float(f"{np.median(np.concatenate(intervals)):.9g}") if intervals else float("nan")


def interval_of(track: Track) -> float:
    """Give the interval (s) of a resampled track; NaN with fewer than two frames."""
    return float((track.times[-1] - track.times[0]) / (len(track) - 1)) if len(track) > 1 else float("nan")


def counted(tracks: Sequence[Track]) -> dict[str, int]:
    """Count the cells and the independent runs behind some tracks, as `Sample` takes them."""
    return {"cells": len({(t.run, t.name) for t in tracks}), "seeds": len({t.run for t in tracks})}
