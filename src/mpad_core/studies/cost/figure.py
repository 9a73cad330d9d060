"""The picture of a study of cost: error against time, each solver a line through its levels."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mpad_core.studies.cost.files import Found
from mpad_core.studies.cost.labels import place_labels
from mpad_core.studies.cost.rows import POSITION, RATE, RUN, SOLVE, Row, front

_COLOURS = ("#1b4965", "#c1121f", "#e09f3e", "#3d8b8b", "#7b4b94", "#6a994e", "#b5651d", "#5c677d")
_GREY = "#8d99ae"
_FEW_DECADES = 10**1.8
_TOLERANCES = {"position": "#000000", "rate": "#8d99ae"}


def draw(found: Found, file: Path) -> None:
    """Draw what was found into a PNG: single solves above, whole paths and bond events below, where there are any."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    lower = [bool(found.of(RUN)), bool(found.of(RATE))]
    figure = Figure(figsize=(9, 4.6 + 4.0 * any(lower)), layout="constrained")
    FigureCanvasAgg(figure)
    names: list[Any] = [["solves", "solves"], *([_below(*lower)] if any(lower) else [])]
    panels = figure.subplot_mosaic(names)
    colours = _colours(found)
    _draw_solves(panels["solves"], found, colours)
    if lower[0]:
        _draw_paths(panels["paths"], found, colours)
    if lower[1]:
        _draw_events(panels["events"], found)
    figure.suptitle(found.title, x=0.01, ha="left", fontsize=11)
    figure.canvas.draw()  # places the axes, and so the points that labels must not cover
    for panel in panels.values():
        _mark_axis(panel.xaxis)
        _mark_axis(panel.yaxis)
        place_labels(panel)
    figure.savefig(file, dpi=130)


def _below(paths: bool, events: bool) -> list[str]:
    return ["paths" if paths else "events", "events" if events else "paths"]


def _colours(found: Found) -> dict[str, str]:
    """Give each solver a colour, in the order of rows, whoever brings it."""
    lines = dict.fromkeys(row.line for study in (SOLVE, RUN) for row in found.of(study))
    return {line: _COLOURS[k % len(_COLOURS)] for k, line in enumerate(lines)} | _TOLERANCES


def _draw_solves(panel: Any, found: Found, colours: dict[str, str]) -> None:
    rows = found.of(SOLVE)
    _draw_lines(panel, rows, colours, 1e3, 1.0)
    _draw_bound(panel, rows, 1.0)
    panel.set_xlabel("time of one solve (ms)")
    panel.set_ylabel("relative error of velocities")
    panel.set_title("one solve", loc="left", fontsize=10)
    panel.plot([], [], color="0.85", lw=7, label="nothing is both faster and more exact")
    panel.legend(frameon=False, fontsize=8, loc="upper right")


def _draw_paths(panel: Any, found: Found, colours: dict[str, str]) -> None:
    rows, steps = found.of(RUN), found.of(POSITION)
    _draw_lines(panel, rows, colours, 1.0, 1e3)
    _draw_lines(panel, steps, colours, 1.0, 1e3)
    _draw_bound(panel, rows, 1e3)
    _explain(panel, {"position": f"{dict(found.facts).get('solver', '')}, tolerance of positions"} if steps else {})
    seeds = float(dict(found.facts).get("seeds", "nan"))
    if math.isfinite(seeds):
        panel.axhline(seeds, color=_GREY, lw=1, ls=":")
        panel.annotate("another seed", (1, seeds), xycoords=("axes fraction", "data"), fontsize=8, color=_GREY,
                       xytext=(-4, 3), textcoords="offset points", ha="right")  # fmt: skip
    panel.set_xlabel("time of the path (s)")
    panel.set_ylabel("error (nm)")
    panel.set_title("a whole path, without bonds", loc="left", fontsize=10)


def _draw_events(panel: Any, found: Found) -> None:
    _draw_lines(panel, found.of(RATE), _TOLERANCES, 1.0, 1.0)
    _explain(panel, {"position": "tolerance of positions", "rate": "tolerance of rates"})
    panel.set_xlabel("time of the run (s)")
    panel.set_ylabel("relative error of waiting times")
    panel.set_title("bond events", loc="left", fontsize=10)


def _draw_lines(panel: Any, rows: Sequence[Row], colours: dict[str, str], per_second: float, scale: float) -> None:
    """Draw each line through its levels; what nothing beats is filled, and joined by a broad grey line."""
    best = [row for row, on in zip(rows, front(rows), strict=True) if on and row.known_error > 0]
    best.sort(key=lambda row: row.time)
    panel.plot(
        [per_second * row.time for row in best], [scale * row.known_error for row in best],
        color="0.85", lw=7, solid_capstyle="round", zorder=1,
    )  # fmt: skip
    for line in dict.fromkeys(row.line for row in rows):
        own = [row for row in rows if row.line == line and _can_be_drawn(row)]
        own.sort(key=lambda row: row.time)
        x, y = [per_second * row.time for row in own], [scale * row.known_error for row in own]
        panel.plot(x, y, color=colours[line], lw=1.2, zorder=2)
        for at, row in zip(zip(x, y, strict=True), own, strict=True):
            _draw_point(panel, at, row, colours[line], row in best)
    if any(_can_be_drawn(row) for row in rows):
        panel.set(xscale="log", yscale="log")
    panel.grid(color="0.93")
    panel.margins(0.14)


def _explain(panel: Any, lines: dict[str, str]) -> None:
    """Say what the lines are whose labels are only values."""
    for line, text in lines.items():
        panel.plot([], [], color=_TOLERANCES[line], lw=1.2, label=text)
    if lines:
        panel.legend(frameon=False, fontsize=8, loc="upper right")


def _mark_axis(axis: Any) -> None:
    """Write plain numbers at decades, and between them where there are few."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    if axis.get_scale() != "log":
        return  # nothing has been drawn
    axis.set_minor_formatter(NullFormatter())
    if high / low < _FEW_DECADES:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _can_be_drawn(row: Row) -> bool:
    return bool(np.isfinite([row.time, row.known_error]).all()) and row.known_error > 0


def _draw_point(panel: Any, at: tuple[float, float], row: Row, colour: str, best: bool) -> None:
    marker = "v" if row.below else "o"
    panel.plot(*at, marker, color=colour, mfc=colour if best else "white", ms=6, zorder=3)
    panel.text(*at, short(row), color=colour, fontsize=8, gid="label")


def _draw_bound(panel: Any, rows: Sequence[Row], scale: float) -> None:
    """Shade where errors cannot be told from that of the reference."""
    bounds = [scale * row.bound for row in rows if row.reference and math.isfinite(row.bound) and row.bound > 0]
    if bounds:
        low = min(0.3 * bounds[0], panel.get_ylim()[0])
        panel.axhspan(low, bounds[0], color="0.9", lw=0, zorder=0)
        panel.set_ylim(bottom=low)
        panel.text(0.01, 0.02, "the reference's own error", transform=panel.transAxes, fontsize=8, color="0.45")


def short(row: Row) -> str:
    """Give a label that has room beside a point: the line's name, and values without their keys."""
    if row.study in (POSITION, RATE):
        return row.label.partition(",")[0].replace(" (the scene's)", "").replace(f"{row.line} = ", "")
    values = [word.partition("=")[2] for word in row.label.split()[1:] if "=" in word]
    return " ".join([row.line, *(_brief(value) for value in values)])


def _brief(value: str) -> str:
    try:
        number = float(value)
    except ValueError:
        return value
    power = math.log10(number) if number > 0 else math.nan
    return f"1e{power:.0f}" if power < -1 and abs(power - round(power)) < 1e-9 else f"{number:g}"
