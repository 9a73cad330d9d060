"""The study as a whole, and its command."""

import csv
import json
import sys
from pathlib import Path

import pytest

from mpad_core import cli
from mpad_core.studies.cost import study

RECRUITMENT = Path(__file__).parents[3] / "examples" / "recruitment.toml"
SHORT = (
    *("--set", 'stop.time="40 ms"', "--set", 'cells.roller.start.rolling_alone="20 ms"'),
    *("--set", 'stop.when=["free.dx > -96 um"]'),
)

pytestmark = pytest.mark.slow


@pytest.fixture
def mpad(monkeypatch, capsys):
    """Call the command line in this process."""

    def call(*words):
        monkeypatch.setattr(sys, "argv", ["mpad", *map(str, words)])
        code = 0
        try:
            cli.main()
        except SystemExit as leaving:
            code = leaving.code or 0
        return code, *capsys.readouterr()

    return call


def read(folder):
    with (folder / "cost.csv").open() as file:
        return list(csv.DictReader(file))


def test_a_passage_from_beginning_to_end(mpad, tmp_path):
    words = ("--solver", "isolated", "--solver", "rpb", "--at", "-98um", "--at", "-97", "--long")
    code, out, err = mpad("cost", RECRUITMENT, "-o", tmp_path, *SHORT, *words)
    assert code == 0, err
    rows = read(tmp_path)
    assert {row["study"] for row in rows} == {"solve", "run", "long", "position", "rate"}
    solvers = ["isolated", "rpb lone_sphere=blake", "rpb lone_sphere=exact"]
    assert sorted(row["label"] for row in rows if row["study"] == "solve") == solvers
    runs = [row for row in rows if row["study"] == "run"]
    assert [float(row["error"]) > 0 and float(row["time_s"]) > 0 for row in runs] == [True] * 3
    assert all(float(row["delta (nm) at dx = -98 um"]) < 0 for row in runs)
    long = [row for row in rows if row["study"] == "long"]
    assert all(float(row["rolling speed of roller (um/s)"]) > 0 for row in long)
    steps = [float(row["error"]) for row in rows if row["study"] == "position"]
    assert steps[0] > 10 * steps[3]  # from 100 times to a tenth of the scene's tolerance
    told = json.loads((tmp_path / "cost.json").read_text())
    assert told["compared"] == "delta of free at dx = -98, -97 um"
    assert len(told["rows"]) == len(rows)
    assert (tmp_path / "cost.png").read_bytes().startswith(b"\x89PNG")
    assert out.splitlines()[-1] == f"written to {tmp_path}"
    assert "| *" in out


def test_a_scene_without_passage_or_bonds(mpad, scene_file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = mpad("cost", scene_file, "--solver", "isolated", "--solver", "rpb")
    assert code == 0, err
    assert {row["study"] for row in read(tmp_path / "runs" / "two-cost")} == {"solve", "run", "position"}
    assert "places of the free cells at t = 0.02 s" in out


def test_one_level_alone_has_nothing_to_be_compared_with(mpad, scene_file, tmp_path):
    code, _, err = mpad("cost", scene_file, "-o", tmp_path / "out", "--solver", "isolated")
    assert code == 0, err
    (row,) = [row for row in read(tmp_path / "out") if row["study"] == "solve"]
    assert (row["error"], row["reference"]) == ("", "True")
    assert (tmp_path / "out" / "cost.png").exists()


def test_an_interruption_leaves_what_was_measured(mpad, scene_file, tmp_path, monkeypatch):
    def stopped(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(study, "solver_runs", stopped)
    code, _, err = mpad("cost", scene_file, "-o", tmp_path / "out", "--solver", "isolated", "--solver", "rpb")
    assert code == 130
    assert err.splitlines()[-1] == f"interrupted; what was measured before is in {tmp_path / 'out'}"
    assert len(read(tmp_path / "out")) == 3


@pytest.mark.parametrize(("words", "said"), [
    (("--solver", "nobody"), "no solver 'nobody' is installed"),
    (("--at", "3 apples"), "--at"),
    (("--at", "5 um"), "is for scenes with a [passage]"),
])  # fmt: skip
def test_words_that_make_no_sense(words, said, mpad, scene_file, tmp_path):
    code, out, err = mpad("cost", scene_file, "-o", tmp_path / "out", *words)
    assert (code, out) == (2, "")
    assert said in err
    assert "Traceback" not in err


def test_a_file_where_the_directory_should_be(mpad, scene_file, tmp_path):
    (tmp_path / "file").write_text("mine")
    code, _, err = mpad("cost", scene_file, "-o", tmp_path / "file")
    assert code == 2
    assert err.count("\n") == 1
    assert "no directory can be made there" in err
