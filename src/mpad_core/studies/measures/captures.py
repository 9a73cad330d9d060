"""Cells caught from the flow: when, where beside those already caught, and by what.

The classes are those in which King & Hammer (PNAS 2001, Discussion) report observations in venules of 24 to 30 µm:
42.8 % of binding events by hydrodynamic recruitment, 6.6 % by adhesion between cells, 22 % isolated, 28.6 % with three
or more cells. They name no distance. Beside a bound bead of radius 5 µm they saw most attachments upstream at
−53 ≤ Δx ≤ −18 µm (their figure 2A), and a preponderance 40 µm away; ten radii take in all but the farthest.
"""

from collections.abc import Callable, Sequence
from typing import Literal, TypeAlias

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from mpad_core.studies.measures.bonds import WALL
from mpad_core.studies.measures.tracks import Track

RADII_WITHIN = 10.0
CLASSES = ("isolated", "hydrodynamic", "cell-cell", "multicell")
CaptureClass: TypeAlias = Literal["isolated", "hydrodynamic", "cell-cell", "multicell"]
Span: TypeAlias = tuple[float, float]  # s, s


@frozen(kw_only=True)
class CaptureRule:
    """When a cell counts as caught, and by what.

    ``within`` (µm) is the distance R along the wall, between centres, at which a caught cell counts as a neighbour.
    """

    bound_for: float = 0.1  # s, without a break
    slower_than: float = 0.1  # of the cell's own free speed, on average over that time
    within: float = 50.0  # µm
    shortly: float = 0.1  # s: a bond between cells counts that lived at most so long before the capture


@frozen(kw_only=True)
class Capture:
    """One capture."""

    cell: str
    time: float  # s, from when on the cell is bound and slow
    dx: float  # µm, from the nearest caught cell, positive downstream of it; NaN where no other cell is caught
    dy: float  # µm
    neighbours: int  # caught cells within R
    kind: CaptureClass
    run: str = ""


def caught_spans(
    track: Track, bound: Sequence[Span] | None, speed: Callable[[float], float], rule: CaptureRule
) -> list[Span]:
    """Give from when to when a cell is caught.

    Parameters
    ----------
    track
        Of the cell, in frames as recorded.
    bound
        Spans (s) in which it has bonds with the wall without a break; None: not known, it is caught as long as slow.
    speed
        Free speed (µm/s) of the cell at a time (s).
    rule
        While bound, one time of ``bound_for`` after the other is looked at; from the beginning of the first in which
        the mean speed is low the cell is caught, until its last bond breaks.
    """
    if not len(track):
        return []
    if bound is None:
        return _slow_spans(track, speed, rule)
    begins = ((_caught_from(track, span, speed, rule), span[1]) for span in bound)
    return [(begin, end) for begin, end in begins if begin < np.inf]


def _caught_from(track: Track, span: Span, speed: Callable[[float], float], rule: CaptureRule) -> float:
    begin, end = max(span[0], track.times[0]), min(span[1], track.times[-1])
    whiles = int((end - begin) / rule.bound_for * (1 + 1e-12)) if end > begin else 0
    for start in begin + rule.bound_for * np.arange(whiles):
        if _is_slow(track, float(start), speed, rule):
            return float(start)
    return np.inf


def _is_slow(track: Track, start: float, speed: Callable[[float], float], rule: CaptureRule) -> bool:
    end = start + rule.bound_for
    return abs(track.x_at(end) - track.x_at(start)) < rule.slower_than * speed(end) * rule.bound_for


def _slow_spans(track: Track, speed: Callable[[float], float], rule: CaptureRule) -> list[Span]:
    """Give the spans of whiles that begin at frames and are slow, those that overlap as one."""
    starts = track.times[track.times <= track.times[-1] - rule.bound_for]
    spans: list[Span] = []
    for start in (float(start) for start in starts if _is_slow(track, float(start), speed, rule)):
        if spans and start <= spans[-1][1]:
            spans[-1] = (spans[-1][0], start + rule.bound_for)
        else:
            spans.append((start, start + rule.bound_for))
    return spans


def bound_spans(lives: NDArray[np.void], cell: int) -> list[Span]:
    """Give the spans (s) in which a cell has at least one bond with the wall; the last may end at infinity.

    Parameters
    ----------
    lives : (B,) of BOND_LIFE
        Of all cells, in the order of forming.
    cell
        Its index.
    """
    spans: list[Span] = []
    for life in lives[(lives["cell"] == cell) & (lives["partner"] == WALL)]:
        formed, broken = float(life["formed"]), float(life["broken"])
        if spans and formed < spans[-1][1]:
            spans[-1] = (spans[-1][0], max(spans[-1][1], broken))
        else:
            spans.append((formed, broken))
    return spans


def captures(
    tracks: Sequence[Track],
    caught: Sequence[Sequence[Span]],
    lives: NDArray[np.void] | None,
    rule: CaptureRule,
) -> list[Capture]:
    """Give all captures of one run, in the order of time.

    Parameters
    ----------
    tracks
        Of all cells of the run.
    caught
        For each cell, see `caught_spans`. A cell that is caught when its track begins has not been captured.
    lives : (B,) of BOND_LIFE, or None
        Where they are not known, no capture is told to be one by adhesion between cells.
    rule
        With the distance R.

    Notes
    -----
    A class goes by what is caught within R of the captured cell: two cells or more, and it is ``multicell``; else if it
    had a bond with another cell then or shortly before, it is ``cell-cell``; else with one neighbour ``hydrodynamic``,
    with none ``isolated``.
    """
    found = [
        _capture(i, time, tracks, caught, lives, rule)
        for i, spans in enumerate(caught)
        for time, _ in spans
        if time > tracks[i].times[0]
    ]
    return sorted(found, key=lambda capture: capture.time)


def _capture(
    i: int, time: float, tracks: Sequence[Track], caught: Sequence[Sequence[Span]], lives: NDArray[np.void] | None,
    rule: CaptureRule,
) -> Capture:  # fmt: skip
    others = [j for j, spans in enumerate(caught) if j != i and _is_held(tracks[j], spans, time)]
    x, y = tracks[i].x_at(time), tracks[i].y_at(time)
    apart = np.array([[x - tracks[j].x_at(time), y - tracks[j].y_at(time)] for j in others]).reshape(-1, 2)
    distances = np.hypot(*apart.T)
    dx, dy = apart[np.argmin(distances)].tolist() if others else (np.nan, np.nan)
    near = int(np.sum(distances <= rule.within))
    kind = _class(near, lives is not None and _held_by_a_cell(lives, i, time, rule.shortly))
    return Capture(cell=tracks[i].name, time=time, dx=dx, dy=dy, neighbours=near, kind=kind, run=tracks[i].run)


def _is_held(track: Track, spans: Sequence[Span], time: float) -> bool:
    """Tell whether a cell is caught at a time, and still watched."""
    return bool(track.times[0] <= time <= track.times[-1]) and any(begin <= time < end for begin, end in spans)


def _held_by_a_cell(lives: NDArray[np.void], cell: int, time: float, shortly: float) -> bool:
    mine = ((lives["cell"] == cell) | (lives["partner"] == cell)) & (lives["partner"] != WALL)
    return bool(np.any(mine & (lives["formed"] <= time) & (lives["broken"] >= time - shortly)))


def _class(near: int, held: bool) -> CaptureClass:
    if near >= 2:
        return "multicell"
    if held:
        return "cell-cell"
    return "hydrodynamic" if near else "isolated"
