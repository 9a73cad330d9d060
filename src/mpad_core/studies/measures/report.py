"""What was measured, as a table and as JSON, with what it was measured by."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal, TypeAlias

from attrs import asdict, frozen

from mpad_core.studies.measures.captures import Capture
from mpad_core.studies.measures.estimates import Estimate
from mpad_core.studies.measures.pauses import PauseRule

By: TypeAlias = Literal["kind", "cell"]
Measured: TypeAlias = tuple[str, str, Estimate]  # what, unit, number

_MOST_CAPTURES = 20  # in the table


@frozen(kw_only=True)
class Options:
    """How to measure; None: as the data suggest, which is told with the result."""

    every: float | None = None  # s, between a camera's frames; None: the usual interval of what was recorded
    after: float = 0.0  # s, left out
    by: By = "kind"
    cells: tuple[str, ...] = ()  # only these; none: all
    pause_speed: float | None = None  # µm/s; None: half the mean velocity of the cells in a column
    pause_time: float = 0.1  # s
    window: float = 1.0  # s, over which the deviation from uniform motion is looked at
    seed: int = 0  # of the bootstrap


@frozen(kw_only=True, eq=False)
class Column:
    """What was measured on the cells of one kind, or on one cell of all runs."""

    name: str
    cells: int
    seeds: int
    watched: float  # s, of all cells together
    pause_rule: PauseRule
    measured: tuple[Measured, ...]
    bond_shares: tuple[float, ...] = ()  # of time, with 0, 1, 2, … bonds


@frozen(kw_only=True, eq=False)
class Report:
    """All columns, all captures, and how they came about."""

    options: Options
    every: float  # s
    runs: tuple[str, ...]
    columns: tuple[Column, ...]
    captures: tuple[Capture, ...] = ()
    within: tuple[float, ...] = ()  # µm, R of each run


def table_lines(report: Report) -> Iterator[str]:
    """Yield the table that ``mpad measure`` prints."""
    runs = len(report.runs)
    yield f"{runs} run{'s' * (runs > 1)}, frames {report.every:g} s apart, 95 % intervals in brackets"
    rows = list(dict.fromkeys((what, unit) for column in report.columns for what, unit, _ in column.measured))
    texts = [[f"{what} ({unit})" if unit else what for what, unit in rows], *map(_texts(rows), report.columns)]
    heads = ["", *(column.name for column in report.columns)]
    behind = ["watched", *(f"{c.cells} cell{'s' * (c.cells > 1)}, {c.watched:.4g} s" for c in report.columns)]
    ruled = ["a pause (slower, longer)", *(_rule(c.pause_rule) for c in report.columns)]
    lines = [heads, behind, ruled, *zip(*texts, strict=True)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for line in lines:
        yield "  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)).rstrip()
    yield from map(_capture_line, report.captures[:_MOST_CAPTURES])
    if len(report.captures) > _MOST_CAPTURES:
        yield f"and {len(report.captures) - _MOST_CAPTURES} captures more; --json has all"


def _rule(rule: PauseRule) -> str:
    return f"{rule.slower_than:.3g} um/s, {rule.at_least:.3g} s"


def _texts(rows: Sequence[tuple[str, str]]) -> Callable[[Column], list[str]]:
    def of(column: Column) -> list[str]:
        known = {(what, unit): number for what, unit, number in column.measured}
        return [_text(known[row]) if row in known else "" for row in rows]

    return of


def _text(number: Estimate) -> str:
    if not math.isfinite(number.value):
        return "-"
    if math.isfinite(number.low):
        return f"{number.value:.4g} [{number.low:.4g}, {number.high:.4g}]"
    return f"{number.value:.0f}" if float(number.value).is_integer() else f"{number.value:.4g}"


def _capture_line(capture: Capture) -> str:
    near = f"dx = {capture.dx:.1f} um, dy = {capture.dy:.1f} um" if math.isfinite(capture.dx) else "no cell is caught"
    return f"capture of {capture.cell} at t = {capture.time:.4g} s: {capture.kind}, {near} ({capture.run})"


def plain(report: Report) -> dict[str, Any]:
    """Give the report as JSON knows it; what is no number is null."""
    return {
        "runs": list(report.runs),
        "every_s": report.every,
        "options": asdict(report.options),
        "within_um": list(report.within),
        "columns": [_plain_column(column) for column in report.columns],
        "captures": [_finite(asdict(capture)) for capture in report.captures],
    }


def _plain_column(column: Column) -> dict[str, Any]:
    measured = [{"what": what, "unit": unit, **_finite(asdict(number))} for what, unit, number in column.measured]
    return {
        "name": column.name,
        "cells": column.cells,
        "seeds": column.seeds,
        "watched_s": column.watched,
        "pause": asdict(column.pause_rule),
        "measured": measured,
        "share_of_time_by_bonds": list(column.bond_shares),
    }


def _finite(values: dict[str, Any]) -> dict[str, Any]:
    return {name: None if isinstance(v, float) and not math.isfinite(v) else v for name, v in values.items()}
