"""The picture of a passage."""

from collections.abc import Sequence
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from mpad_core.studies.passage import Path, contribution

_INK, _GREY, _RED = "#1b4965", "#8d99ae", "#c1121f"


def draw_passages(
    passing: tuple[Sequence[Path], Sequence[Path]],
    alone: tuple[Sequence[Path], Sequence[Path]],
    on_rates: Sequence[float],
    title: str,
    file: FilePath,
) -> None:
    """Draw δ(Δx) past the other cell and alone; for a probe also their difference and the capture hazard.

    Parameters
    ----------
    passing, alone
        Whole paths, and their free parts.
    on_rates
        Further on-rates (1/s) to draw the hazard for.
    title, file
        What stands above the picture, and the PNG's name.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    path = passing[0][0]
    lower = [] if path.binds else [_draw_contribution] * bool(alone[0]) + [_draw_hazard] * bool(path.problem.species)
    figure = Figure(figsize=(7.5, 3.1 + 2.7 * len(lower)), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1 + len(lower), 1, sharex=True, squeeze=False)[:, 0]
    _draw_overlap(panels[0], passing[0], alone[0])
    for panel, draw in zip(panels[1:], lower, strict=True):
        draw(panel, passing[1][0], alone[1], on_rates)
    panels[0].set_title(title, loc="left", fontsize=11)
    panels[-1].set_xlabel(f"Δx of {path.problem.names[path.cell]} (µm)")
    figure.savefig(file, dpi=130)


def _draw_overlap(panel: Any, paths: Sequence[Path], alone: Sequence[Path]) -> None:
    for i, path in enumerate(alone):
        panel.plot(path.dx, 1e3 * path.overlap, color=_GREY, lw=1.2, ls="--", label=None if i else "alone")
    for i, path in enumerate(paths):
        panel.plot(path.dx, 1e3 * path.overlap, color=_INK, lw=1.5, label=None if i else "past the other cell")
        if np.isfinite(path.caught_at):
            at = np.interp(path.caught_at, path.times, path.dx), np.interp(path.caught_at, path.times, path.overlap)
            panel.plot(at[0], 1e3 * at[1], "o", color=_RED, ms=5)
    panel.axhline(0, color="black", lw=0.6)
    panel.set_ylabel("receptor overlap δ (nm)")
    low = 1e3 * min(float(np.min(path.overlap)) for path in (*paths, *alone))
    high = 1e3 * max(float(np.max(path.overlap)) for path in (*paths, *alone))
    # the lift over the other cell is ten times what lies below zero: cut it, so that the rest can be read
    panel.set_ylim(1.25 * low - 3, min(1.1 * high + 3, max(-2 * low, 20.0)))
    panel.legend(frameon=False, fontsize=9)


def _draw_contribution(panel: Any, path: Path, alone: Sequence[Path], on_rates: Sequence[float]) -> None:
    share = 1e3 * contribution(path, alone[0])
    low, high = 1.5 * min(float(np.nanmin(share)), -8.0), 1.5 * max(float(np.nanmax(share)), 8.0)
    panel.plot(path.dx, share, color=_INK, lw=1.5)
    panel.set_ylim(low, high)
    panel.axhline(0, color="black", lw=0.6)
    panel.set_yscale("symlog", linthresh=5)
    panel.set_yticks([tick for tick in (-1000, -100, -10, 0, 10, 100, 1000) if low <= tick <= high])
    panel.set_ylabel("δ less δ alone,\nsame place (nm)")


def _draw_hazard(panel: Any, path: Path, alone: Sequence[Path], on_rates: Sequence[float]) -> None:
    base = [species.on_rate for species in path.problem.species]
    speed = np.maximum(np.abs(path.speed), 1e-12)
    shades = [str(shade) for shade in np.linspace(0.0, 0.65, 1 + len(on_rates))]
    for shade, rate in zip(shades, (None, *on_rates), strict=True):
        per_length = path.hazard(rate) / speed
        label = "/".join(f"{value:g}" for value in base) if rate is None else f"{rate:g}"
        panel.plot(path.dx, np.where(per_length > 0, per_length, np.nan), color=shade, lw=1.3, label=f"{label} 1/s")
    panel.set_yscale("log")
    panel.set_ylim(1e-6, None)
    panel.set_ylabel("capture hazard (1/µm)")
    panel.legend(title="on-rate", frameon=False, fontsize=9, ncols=1 + len(on_rates))
