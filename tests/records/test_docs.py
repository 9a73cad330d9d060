"""The page on the run directory says what is so: its blocks are run, its table held against a file."""

import re
from pathlib import Path

import h5py
import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "run-directory.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"<!-- run -->\n```python\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # MDAnalysis and what it imports
@pytest.mark.filterwarnings("ignore::UserWarning:MDAnalysis")  # no masses and types to guess from
@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_its_blocks_run(number, finished, monkeypatch):
    monkeypatch.chdir(finished.parent)
    exec(compile(BLOCKS[number], f"block {number}", "exec"), {})


def test_it_names_every_dataset_and_no_other(finished):
    with h5py.File(finished) as file:
        found = set()
        file.visititems(lambda name, item: found.add(f"/{name}") if isinstance(item, h5py.Dataset) else None)
        found |= {f"/particles/trajectory/position/{name}" for name in ("time", "step")}  # visited under one name only
    rows = [line.split("|")[1] for line in PAGE.splitlines() if line.startswith("| `/")]
    told = {path for row in rows for path in re.findall(r"`(/[^`…]+)`", row)}
    assert told == {path for path in found if not path.startswith("/mpad/observers/")}


def test_its_units_are_those_of_the_file(finished):
    rows = [[cell.strip() for cell in line.split("|")] for line in PAGE.splitlines() if line.startswith("| `/")]
    units = {path: row[3] for row in rows for path in re.findall(r"`(/[^`…]+)`", row[1])}
    with h5py.File(finished) as file:
        assert {path: file[path].attrs.get("unit", "") for path in units if not path.endswith("step")} == {
            path: unit for path, unit in units.items() if not path.endswith("step")
        }
