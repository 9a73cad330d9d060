"""Rows, the front among them, and what is written of them."""

import csv
import json
import math

from mpad_core.studies.cost.files import COLUMNS, Found, write
from mpad_core.studies.cost.rows import RUN, SOLVE, Row, front
from mpad_core.studies.cost.table import table_lines
from mpad_core.studies.measures.estimates import Estimate


def row(time, error, bound=0.0, **more):
    return Row(study=SOLVE, label=f"s x={time}", line="s", time=time, error=error, bound=bound, **more)


def test_the_front_is_what_nothing_beats():
    rows = [row(1.0, 1e-1), row(2.0, 1e-2), row(3.0, 1e-2), row(2.5, 0.5), row(0.5, math.nan), row(4.0, 1e-3)]
    assert front(rows) == [True, True, False, False, False, True]


def test_what_cannot_be_told_apart_is_no_better():
    """Below the reference's own error a slower level is no better than a faster one."""
    rows = [row(1.0, 9e-4, bound=1e-3), row(2.0, 1e-6, bound=1e-3), row(3.0, 1e-3, bound=1e-3, reference=True)]
    assert front(rows) == [True, False, False]
    assert all(one.below for one in rows)
    assert [one.known_error for one in rows] == [1e-3] * 3


def test_two_alike_are_both_on_the_front():
    assert front([row(1.0, 0.1), row(1.0, 0.1)]) == [True, True]


def test_files_hold_every_row_and_column(tmp_path):
    values = {"delta (nm) at dx = 0 um": Estimate(3.0, 2.0, 4.0)}
    refused = Row(study=SOLVE, label="s", line="s", note="refused: too near")
    run = Row(study=RUN, label="s", line="s", error=2e-3, time=1.0, values=values)
    write(Found(title="a scene", rows=(row(1e-3, 1e-2), refused, run), facts=(("solver", "s"),)), tmp_path)
    with (tmp_path / "cost.csv").open() as file:
        read = list(csv.DictReader(file))
    assert list(read[0]) == [*COLUMNS, "delta (nm) at dx = 0 um"]
    assert [one["pareto"] for one in read] == ["True", "False", "True"]
    assert (read[0]["error"], read[0]["time_s"]) == ("0.01", "0.001")
    assert (read[1]["note"], read[1]["error"]) == ("refused: too near", "")
    assert (read[2]["error"], read[2]["delta (nm) at dx = 0 um"]) == ("2.0", "3.0")  # lengths in nm
    told = json.loads((tmp_path / "cost.json").read_text())
    assert (told["title"], told["solver"], len(told["rows"])) == ("a scene", "s", 3)
    assert told["rows"][2]["values"] == {"delta (nm) at dx = 0 um": {"value": 3.0, "low": 2.0, "high": 4.0}}
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["cost.csv", "cost.json"]


def test_the_table_marks_the_front_and_shows_refusals():
    bounded = row(2e-3, 1e-5, bound=1e-4, reference=True, against="s x=9")
    rows = (row(1e-3, 1e-2), bounded, Row(study=SOLVE, label="other", line="o", note="refused: too near"))
    lines = list(table_lines(Found(title="", rows=rows, facts=(("situations", "3 along the run"),))))
    stars = [line.split("|")[1].strip() for line in lines if line.startswith("|")]
    assert stars == ["", "-", "*", "*", ""]
    assert any("<= 1.0e-04" in line and "(reference)" in line for line in lines)
    assert any("other" in line and "refused: too near" in line for line in lines)
    assert any(line.endswith("difference to s x=9") for line in lines)
