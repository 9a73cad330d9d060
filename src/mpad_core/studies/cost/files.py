"""What a study of cost leaves in its directory: written anew after each row, so that nothing computed is lost."""

import csv
import io
import json
import math
from pathlib import Path
from typing import Any

from attrs import frozen

from mpad_core.records.directory import write_whole
from mpad_core.studies.cost.rows import POSITION, RUN, Row, front
from mpad_core.studies.measures.estimates import Estimate

CSV, JSON, PICTURE = "cost.csv", "cost.json", "cost.png"
COLUMNS = (
    *("study", "label", "line", "pareto", "reference", "error", "worst", "normal", "below", "claimed", "reported"),
    *("time_s", "refresh_s", "setup_s", "memory_MB", "against", "note"),
)


@frozen(kw_only=True)
class Found:
    """All that a study has found so far."""

    title: str
    rows: tuple[Row, ...] = ()
    facts: tuple[tuple[str, str], ...] = ()  # what must be known to read the rows, by what it is about

    def of(self, study: str) -> list[Row]:
        """Give the rows of one study."""
        return [row for row in self.rows if row.study == study]


def write(found: Found, directory: Path) -> None:
    """Write table and JSON, each whole or not at all."""
    told = records(found)
    names = list(dict.fromkeys(name for record in told for name in record["values"]))
    text = io.StringIO()
    writer = csv.DictWriter(text, [*COLUMNS, *names], restval="", extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    for record in told:
        values = {name: value["value"] for name, value in record["values"].items()}
        writer.writerow({key: "" if value is None else value for key, value in (record | values).items()})
    facts = dict(found.facts)
    whole = {"title": found.title, **facts, "rows": told}
    write_whole(directory / CSV, text.getvalue().encode())
    write_whole(directory / JSON, (json.dumps(whole, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode())


def records(found: Found) -> list[dict[str, Any]]:
    """Give the rows as plain values: numbers that are none as None, lengths in nm where errors are lengths."""
    told = []
    for study in dict.fromkeys(row.study for row in found.rows):
        rows = found.of(study)
        told += [_record(row, best) for row, best in zip(rows, front(rows), strict=True)]
    return told


def _record(row: Row, best: bool) -> dict[str, Any]:
    scale = 1e3 if row.study in (RUN, POSITION) else 1.0
    return {
        "study": row.study, "label": row.label, "line": row.line, "pareto": best, "reference": row.reference,
        "error": _number(scale * row.error), "worst": _number(scale * row.worst), "normal": _number(row.normal),
        "below": _number(scale * row.bound), "claimed": _number(row.claimed), "reported": _number(row.reported),
        "time_s": _number(row.time), "refresh_s": _number(row.refresh), "setup_s": _number(row.setup),
        "memory_MB": _number(1e-6 * row.memory), "against": row.against, "note": row.note,
        "values": {name: _estimate(value) for name, value in row.values.items()},
    }  # fmt: skip


def _number(value: float) -> float | None:
    return float(f"{value:.6g}") if math.isfinite(value) else None


def _estimate(value: Estimate) -> dict[str, float | None]:
    return {"value": _number(value.value), "low": _number(value.low), "high": _number(value.high)}
