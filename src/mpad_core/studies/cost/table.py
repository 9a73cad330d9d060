"""The tables that ``mpad cost`` prints: they are Markdown, too."""

import math
from collections.abc import Callable, Iterator, Sequence

from mpad_core.studies.cost.files import Found
from mpad_core.studies.cost.rows import LONG, POSITION, RATE, RUN, SOLVE, Row, front

Column = tuple[str, Callable[[Row], str]]


def table_lines(found: Found) -> Iterator[str]:
    """Yield what ``mpad cost`` prints; rows on the front, which nothing beats in both time and error, have a star."""
    facts = dict(found.facts)
    for study, (title, columns) in _TABLES.items():
        rows = found.of(study)
        if rows:
            yield ""
            yield title
            yield from _NOTES[study](facts)
            yield from _about_references(rows)
            yield ""
            yield from _table(rows, columns)
    yield ""
    yield "* nothing else is both as fast and as exact. Compiling is left out of all times."


def _table(rows: Sequence[Row], columns: Sequence[Column]) -> Iterator[str]:
    heads = ["", *(head for head, _ in columns)]
    cells = [
        ["*" if best else "", *(_cell(row, k, give) for k, (_, give) in enumerate(columns))]
        for row, best in zip(rows, front(rows), strict=True)
    ]
    values = list(dict.fromkeys(name for row in rows for name in row.values)) if rows[0].study in (LONG, RATE) else []
    heads += values
    for row, line in zip(rows, cells, strict=True):
        line += [_value(row, name) for name in values]
    widths = [max(len(line[k]) for line in (heads, *cells)) for k in range(len(heads))]
    for line in (heads, ["-" * max(width, 1) for width in widths], *cells):
        yield "| " + " | ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)) + " |"


def _cell(row: Row, column: int, give: Callable[[Row], str]) -> str:
    """Give a cell of a row; of one without numbers its name, and in the next column why there are none."""
    if not row.note or column == 0:
        return give(row)
    return row.note if column == 1 else ""


def _value(row: Row, name: str) -> str:
    value = row.values.get(name)
    if value is None or not math.isfinite(value.value):
        return ""
    return f"{value.value:.4g}" + (f" [{value.low:.4g}, {value.high:.4g}]" if math.isfinite(value.low) else "")


def _number(value: float, form: str = ".1e") -> str:
    return f"{value:{form}}" if math.isfinite(value) else ""


def _below(row: Row, scale: float = 1.0, form: str = ".1e") -> str:
    text = _number(scale * row.known_error, form)
    return f"<= {text}" if row.below and text else text


def _nm(value: float) -> str:
    return _number(1e3 * value, ".2g")


def _ms(value: float) -> str:
    return _number(1e3 * value, ".2g")


_SOLVER: Column = ("solver", lambda row: row.label + (" (reference)" if row.reference else ""))
_SETTING: Column = ("tolerance", lambda row: row.label + (" (reference)" if row.reference else ""))
_RUN_ERRORS: tuple[Column, ...] = (
    ("error, nm", lambda row: _below(row, 1e3, ".2g")),
    ("worst", lambda row: _nm(row.worst)),
    ("run, s", lambda row: _number(row.time, ".2g")),
)
_TABLES: dict[str, tuple[str, tuple[Column, ...]]] = {
    SOLVE: (
        "Single solves: relative error of the velocities",
        (
            _SOLVER,
            ("error", _below),
            ("worst", lambda row: _number(row.worst)),
            ("normal to the wall", lambda row: _number(row.normal)),
            ("reported", lambda row: _number(row.reported)),
            ("solve, ms", lambda row: _ms(row.time)),
            ("coupling, ms", lambda row: _ms(row.refresh)),
            ("set-up, ms", lambda row: _ms(row.setup)),
            ("memory, MB", lambda row: _number(1e-6 * row.memory, ".2g")),
        ),
    ),
    RUN: ("Whole paths, without bonds and thermal motion: each solver", (_SOLVER, *_RUN_ERRORS)),
    LONG: ("The scene itself: each solver", (_SOLVER, ("run, s", lambda row: _number(row.time, ".2g")))),
    POSITION: (
        "Whole paths, without bonds and thermal motion: the scene's solver, other steps",
        (_SETTING, *_RUN_ERRORS),
    ),
    RATE: (
        "Bond events: waiting times against those with much finer tolerances, relative to their mean",
        (
            _SETTING,
            ("error", lambda row: _number(row.error)),
            ("worst", lambda row: _number(row.worst)),
            ("run, s", lambda row: _number(row.time, ".2g")),
        ),
    ),
}
Facts = dict[str, str]


def _solve_notes(facts: Facts) -> Iterator[str]:
    yield f"in {facts['situations']}: medians, and the worst"


def _run_notes(facts: Facts) -> Iterator[str]:
    yield f"{facts['compared']}: median difference, and the worst; cells that bind are held still"
    if "seeds" in facts:
        yield f"in the scene itself, with its bonds, another seed makes a difference of {facts['seeds']} nm"


def _long_notes(facts: Facts) -> Iterator[str]:
    yield "with 95 % intervals"


def _position_notes(facts: Facts) -> Iterator[str]:
    yield f"{facts['compared']}: median difference, and the worst; solver {facts['solver']}"


def _rate_notes(facts: Facts) -> Iterator[str]:
    yield f"the time is that of the scene itself; solver {facts['solver']}"


_NOTES: dict[str, Callable[[Facts], Iterator[str]]] = {
    SOLVE: _solve_notes,
    RUN: _run_notes,
    LONG: _long_notes,
    POSITION: _position_notes,
    RATE: _rate_notes,
}


def _about_references(rows: Sequence[Row]) -> Iterator[str]:
    for row in rows:
        if row.reference and row.against:
            yield f"the reference's own error is its difference to {row.against}"
