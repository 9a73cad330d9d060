"""What a validation has found: as a table for people, as JSON for programs."""

import json
from collections.abc import Iterable, Iterator
from typing import Any

from attrs import asdict, field, frozen

from mpad_core.testing.rows import FAILS, LEFT_OUT, Row, Told, merged, told_of

_HEADS = ("claim", "source", "expected", "found", "examples", "verdict")
_WIDE = (58, 38)  # of the first two columns
_ORDER = ("solver", "bond", "surface", "force")


@frozen(kw_only=True)
class Validation:
    """All that the laws have told, one entry for each law and part, ordered by part."""

    told: tuple[Told, ...] = field(default=())

    @classmethod
    def of(cls, told: Iterable[Told]) -> "Validation":
        """Put together what came in any order."""
        both = sorted(merged(told), key=lambda one: (_ORDER.index(one.kind), one.part, one.law))
        return cls(told=tuple(both))

    @property
    def failing(self) -> list[tuple[Told, Row]]:
        """The claims that fail, each with its law and part."""
        return [(told, row) for told in self.told for row in told.rows if row.verdict == FAILS]

    def counted(self) -> dict[str, int]:
        """Count the claims by their verdict."""
        verdicts = [row.verdict for told in self.told for row in told.rows]
        return {verdict: verdicts.count(verdict) for verdict in dict.fromkeys(sorted(verdicts))}


def by_part(validation: Validation) -> dict[tuple[str, str], list[Told]]:
    """Group what was told by kind and part."""
    grouped: dict[tuple[str, str], list[Told]] = {}
    for told in validation.told:
        grouped.setdefault((told.kind, told.part), []).append(told)
    return grouped


def table_lines(validation: Validation) -> Iterator[str]:
    """Yield the lines of the table: by part, a line for each claim, the worst example's numbers."""
    for (kind, part), laws in by_part(validation).items():
        yield f"{kind} {part}"
        yield _line(_HEADS)
        for told in laws:
            yield from (_line(cells_of(row)) + (f"  {row.reason}" if row.reason else "") for row in told.rows)
        yield ""
    yield ", ".join(f"{number} {verdict}" for verdict, number in validation.counted().items())


def cells_of(row: Row) -> tuple[str, ...]:
    """Give a row's cells as text."""
    examples = "" if row.verdict == LEFT_OUT else str(row.examples)
    return row.claim, row.source, number(row.expected), number(row.found), examples, row.verdict


def number(value: float | None) -> str:
    """Give three digits of a number, nothing of none."""
    return "" if value is None else f"{value:.3g}"


def _line(cells: tuple[str, ...]) -> str:
    first, second, *rest = cells
    return f"  {first:<{_WIDE[0]}}  {second:<{_WIDE[1]}}  " + "  ".join(f"{cell:>9}" for cell in rest)


def json_text(validation: Validation) -> str:
    """Give all of it as JSON; without a date, so that equal findings are equal files."""
    return json.dumps({"told": [_plain(asdict(told)) for told in validation.told]}, indent=1, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    """Write numbers that JSON has no word for as text."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return repr(value) if isinstance(value, float) and value - value != 0 else value


def from_json(text: str) -> Validation:
    """Read what `json_text` has written."""
    told = json.loads(text)["told"]
    for row in (row for one in told for row in one["rows"]):
        row.update({key: float(row[key]) for key in ("expected", "found") if row[key] is not None})
    return Validation(told=tuple(told_of(one) for one in told))
