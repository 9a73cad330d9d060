"""All measures at once: from the command line, from a run and from its table, and what the page says of them."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

from mpad_core import load_scene, run
from mpad_core.records.reader import read_trajectory
from mpad_core.studies.measures.measure import measure
from mpad_core.studies.measures.observations import observations
from mpad_core.studies.measures.report import Options, plain, table_lines
from mpad_core.studies.measures.track_tables import write_tracks
from mpad_core.studies.measures.tracks import tracks_of

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "measures.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"<!-- run -->\n```python\n(.*?)```", PAGE, re.DOTALL)


def numbers(report, column=0):
    """Give what a column measured, by name."""
    return {what: number for what, _, number in report.columns[column].measured}


@pytest.fixture
def passing(recorded, events, tmp_path):
    """One cell is held from the beginning, a second comes by 8 µm to the side and is caught at 0.5 s, at 20 µm."""
    times = np.linspace(0, 1, 1001)
    x = np.stack([0 * times, 20.0 - 200.0 * np.maximum(0.5 - times, 0)], axis=1)
    places = np.stack([x, np.broadcast_to([0.0, 8.0], x.shape)], axis=2)
    recorded(tmp_path / "passing", times, places, events([(0.0, 0, 0, 1), (0.5, 0, 1, 1)]))
    return tmp_path / "passing"


def test_a_run_and_its_table_give_the_same_numbers(rolling_run, tmp_path):
    write_tracks(tmp_path / "table.csv", tracks_of(read_trajectory(rolling_run / "trajectory.h5")))
    options = Options(every=0.033, after=1.0, by="cell")
    of_run, of_table = (measure(observations([path]), options) for path in (rolling_run, tmp_path / "table.csv"))
    for column in range(2):
        by_run, by_table = (
            {one["what"]: one for one in plain(report)["columns"][column]["measured"]} for report in (of_run, of_table)
        )
        assert len(by_table) == 11
        assert {what: by_run[what] for what in by_table} == by_table
    assert set(by_run) - set(by_table) >= {"bonds", "mean rupture force", "lifetime of bonds"}


def test_seeds_are_pooled(rolling_run, tmp_path):
    seed = rolling_run / "seed-2"
    for folder in (seed, rolling_run / "control"):
        folder.mkdir()
        shutil.copy(rolling_run / "trajectory.h5", folder)
    one, both = (measure(observations([path]), Options(every=0.033)) for path in (seed, rolling_run))
    assert both.runs == (str(rolling_run), str(seed))
    first, pooled = numbers(one)["rolling velocity"], numbers(both)["rolling velocity"]
    assert (pooled.cells, pooled.seeds) == (4, 2)
    assert pooled.value == pytest.approx(first.value)
    assert pooled.high - pooled.low == pytest.approx((first.high - first.low) / np.sqrt(2), rel=0.2)
    assert measure(observations([seed, rolling_run / "trajectory.h5"]), Options()).runs == (str(seed), str(rolling_run))


def test_what_is_left_out_does_not_count(passing):
    late = measure(observations([passing]), Options(by="cell", after=0.6, window=0.1))
    assert numbers(late, 1)["rolling velocity"].value == pytest.approx(0.0, abs=1e-9)
    assert numbers(measure(observations([passing]), Options(by="cell")), 1)["rolling velocity"].value == (
        pytest.approx(100.0)
    )
    assert late.captures == ()
    assert numbers(late, 1)["bonds"].value == pytest.approx(1.0)


class TestCaptures:
    def test_of_a_run(self, passing):
        report = measure(observations([passing]), Options(by="cell"))
        (capture,) = report.captures
        assert (capture.cell, capture.kind, capture.neighbours) == ("cell-1", "hydrodynamic", 1)
        assert (capture.time, capture.dx, capture.dy) == pytest.approx((0.5, 20.0, 8.0))
        assert numbers(report, 1)["share hydrodynamic"].value == 1
        assert numbers(report, 1)["captures a second free"].value == pytest.approx(1 / 0.5)
        assert numbers(report, 0)["captures"].value == 0

    def test_of_many_captures_the_table_tells_the_first(self, passing):
        report = measure(observations([passing]), Options())
        lines = list(table_lines(evolve(report, captures=report.captures * 30)))
        assert (
            sum(line.startswith("capture of cell-1 at t = 0.5 s: hydrodynamic, dx = 20.0 um") for line in lines) == 20
        )
        assert lines[-1] == "and 10 captures more; --json has all"
        assert list(table_lines(report))[-1].startswith("capture of")

    def test_the_distance_can_be_given(self, passing):
        report = measure(observations([passing], within=20.0), Options())
        assert report.captures[0].kind == "isolated"
        assert report.within == (20.0,)

    def test_of_a_table(self, passing, tmp_path):
        write_tracks(tmp_path / "table.csv", tracks_of(read_trajectory(passing / "trajectory.h5")))
        report = measure(observations([tmp_path / "table.csv"], free_speed=200.0), Options())
        (capture,) = report.captures
        assert (capture.cell, capture.kind) == ("cell-1", "hydrodynamic")
        assert capture.time == pytest.approx(0.49, abs=0.002)
        assert measure(observations([tmp_path / "table.csv"]), Options()).captures == ()

    def test_without_a_flow_no_cell_is_told_to_be_caught(self, recorded, events, tmp_path):
        times = np.linspace(0, 1, 11)
        recorded(tmp_path, times, np.zeros((11, 1, 2)), events([(0.5, 0, 0, 1)]), scene="")
        assert "captures" not in numbers(measure(observations([tmp_path]), Options()))


@pytest.mark.slow
def test_captures_are_those_that_the_run_tells(tmp_path):
    """The run says when the while was over, at an outer step; here it is when it began."""
    quick = ['cells.roller.start.rolling_alone="5 ms"', "passage.control=false"]
    summary = run(load_scene(ROOT / "examples" / "capture.toml", [*quick, "passage.seeds=2"]), tmp_path)
    report = measure(observations([tmp_path]), Options(by="cell"))
    told = [one["cells"]["free"]["caught_at_s"] - 0.1 for one in summary["runs"]]
    found = {capture.run: capture for capture in report.captures if capture.cell == "free"}
    assert [found[str(path)].time for path in (tmp_path, tmp_path / "seed-2")] == pytest.approx(told, abs=2e-3)
    assert [capture.dy for capture in found.values()] == pytest.approx([10.0, 10.0], abs=0.1)


class TestCommand:
    def test_prints_a_table(self, rolling_run, mpad):
        code, out, err = mpad("measure", rolling_run, "--every", "33ms", "--after", "1 s", "--by", "cell")
        assert (code, err) == (0, "")
        lines = out.splitlines()
        assert lines[0] == "1 run, frames 0.033 s apart, 95 % intervals in brackets"
        assert lines[1].split() == ["cell-0", "cell-1"]
        assert re.search(r"^rolling velocity \(um/s\) +[\d.]+ \[[\d.]+, [\d.]+\] +[\d.]+ \[", out, re.MULTILINE)
        assert "nan" not in out
        assert max(map(len, lines)) < 120

    def test_prints_and_writes_json(self, rolling_run, mpad, tmp_path):
        code, out, err = mpad("measure", rolling_run, "--json", "-o", rolling_run)
        assert code == 0
        assert err == f"written to {rolling_run / 'measures.json'}\n"
        told = json.loads(out)
        assert told == json.loads((rolling_run / "measures.json").read_text())
        column = told["columns"][0]
        assert sum(column["share_of_time_by_bonds"]) == pytest.approx(1.0)
        assert column["measured"][0]["what"] == "rolling velocity"
        assert {"value", "low", "high", "cells", "seeds", "blocks", "unit"} < set(column["measured"][0])
        assert {path.name for path in rolling_run.iterdir()} == {"trajectory.h5", "measures.json"}
        assert mpad("measure", rolling_run, "-o", tmp_path / "mine.json")[0] == 0
        assert (tmp_path / "mine.json").exists()

    @pytest.mark.parametrize(("words", "says"), [
        (("--every", "33"), "33"), (("--every", "33 um"), "wrong dimension"), (("--every", "0 s"), "must be above"),
        (("--cell", "x"), "no cell is called 'x'; there are cell-0, cell-1"), (("--seed", "-1"), "--seed"),
        (("--after", "1 h"), "nothing can be measured"),
        (("--every", "1 ns"), "choose a longer interval"), (("-o", "no/where.json"), "cannot be written"),
    ])  # fmt: skip
    def test_what_cannot_be_measured_ends_with_code_2(self, words, says, rolling_run, mpad):
        code, _, err = mpad("measure", rolling_run, *words)
        assert code == 2
        assert says in err

    def test_what_is_no_run_ends_with_code_2(self, tmp_path, mpad, rolling_run):
        assert mpad("measure")[0] == 2
        for path, says in ((tmp_path, "holds no trajectory.h5"), (tmp_path / "a.csv", "cannot be read"),
                           (tmp_path / "a.h5", "a.h5")):  # fmt: skip
            code, _, err = mpad("measure", path)
            assert (code, err.count("\n")) == (2, 1)
            assert says in err
        assert "is given twice" in mpad("measure", rolling_run, rolling_run / "trajectory.h5")[2]


class TestPage:
    @pytest.mark.parametrize("number", range(len(BLOCKS)))
    def test_its_blocks_run(self, number, rolling_run, monkeypatch, capsys):
        shutil.copy(rolling_run / "trajectory.h5", rolling_run / "other.h5")
        monkeypatch.chdir(rolling_run)
        exec(compile(BLOCKS[number], f"block {number}", "exec"), {})
        one, other = re.findall(r"Estimate\((\S+) \[(\S+), (\S+)\]", capsys.readouterr().out)
        if number == 0:
            assert one == other
        else:
            assert [float(found[0]) for found in (one, other)] == [1, 1]
            assert all(float(low) < 1 < float(high) for _, low, high in (one, other))

    def test_its_table_is_what_the_command_prints(self, rolling_run):
        shown = re.search(r"<!-- example.*?-->\n```\n(.*?)```", PAGE, re.DOTALL)[1]
        lines = table_lines(measure(observations([rolling_run]), Options(every=0.033, after=1.0)))
        assert shown.splitlines() == list(lines)

    def test_it_names_every_measure(self, rolling_run):
        report = plain(measure(observations([rolling_run]), Options()))
        rows = PAGE.partition("## The measures")[2]
        for measured in report["columns"][0]["measured"]:
            assert measured["what"].partition(",")[0] in rows
