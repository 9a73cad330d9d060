"""Labels beside points, so that they cover neither points nor each other."""

from typing import Any

import numpy as np

_BESIDE = [(7, -3), (-7, -3), (0, 7), (0, -13), (7, 5), (-7, 5), (7, -11), (-7, -11), (0, 16), (0, -22)]
_PLACES = [*_BESIDE, (9, 12), (-9, 12), (9, -20), (-9, -20)]  # points of 1/72 inch
_POINT = 5.0  # pixels around a point that labels leave free
_LINE = 1.5  # and around lines
_ON_A_LINE = 40  # places of each line that are looked at


def place_labels(panel: Any) -> None:
    """Move each text marked ``label`` to the first place around its point where nothing else is; in pixels."""
    renderer = panel.figure.canvas.get_renderer()
    labels = [text for text in panel.texts if text.get_gid() == "label"]
    points = [panel.transData.transform(text.get_position()) for text in labels]
    taken = [_around(point, _POINT) for point in points] + _lines(panel)
    frame = panel.get_window_extent(renderer)
    inside = np.array([frame.x0, frame.y0, frame.x1, frame.y1])
    scale = panel.figure.dpi / 72
    for text, point in zip(labels, points, strict=True):
        box = text.get_window_extent(renderer)
        tried = [_box(point, scale * np.array(shift), box.width, box.height) for shift in _PLACES]
        costs = [sum(_overlap(own, other) for other in taken) + _outside(own, inside) for own in tried]
        best = tried[int(np.argmin(costs))]
        taken.append(best)
        text.set_position(panel.transData.inverted().transform(best[:2]))


def _around(point: Any, by: float) -> Any:
    return np.concatenate([np.asarray(point) - by, np.asarray(point) + by])


def _lines(panel: Any) -> list[Any]:
    """Give small squares along the panel's thin lines."""
    found = []
    for line in panel.lines:
        path = panel.transData.transform(line.get_xydata())
        if len(path) > 1 and line.get_linewidth() < 2 and line.get_transform() == panel.transData:
            along = np.linspace(0, len(path) - 1, _ON_A_LINE)
            x, y = (np.interp(along, np.arange(len(path)), path[:, k]) for k in (0, 1))
            found += [_around(point, _LINE) for point in zip(x, y, strict=True)]
    return found


def _box(point: Any, shift: Any, width: float, height: float) -> Any:
    """Give the corners of a label beside a point: it begins at a shift to the right, and ends at one to the left."""
    left = point[0] + shift[0] - width * (0.5 - 0.5 * np.sign(shift[0]))
    bottom = point[1] + shift[1]
    return np.array([left, bottom, left + width, bottom + height])


def _overlap(one: Any, other: Any) -> float:
    sides = np.minimum(one[2:], other[2:]) - np.maximum(one[:2], other[:2])
    return float(np.prod(np.maximum(sides, 0.0)))


def _outside(one: Any, frame: Any) -> float:
    """Give an area's worth of how far a label reaches out of the frame."""
    beyond = np.maximum(frame[:2] - one[:2], 0).sum() + np.maximum(one[2:] - frame[2:], 0).sum()
    return float(100.0 * beyond)
