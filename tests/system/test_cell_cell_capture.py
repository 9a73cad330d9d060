"""A cell that meets a held one, binds it and the wall: run, recorded and measured from the command line."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mpad_core.records.reader import living_bonds, read_trajectory

pytestmark = pytest.mark.slow

SCENE = Path(__file__).parents[1] / "data" / "two_cells.toml"


def mpad(*arguments):
    words = [sys.executable, "-m", "mpad_core", *map(str, arguments)]
    return subprocess.run(words, capture_output=True, text=True, check=True, timeout=280).stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pair") / "run"
    mpad("run", SCENE, "-o", folder)
    return folder


def test_the_capture_is_one_by_a_cell(folder):
    captures = json.loads(mpad("measure", folder, "--json"))["captures"]
    assert [capture["kind"] for capture in captures if capture["cell"] == "comer"] == ["cell-cell"]


def test_recorded_bond_counts_are_those_of_both_cells(folder):
    trajectory = read_trajectory(folder / "trajectory.h5")
    for index in range(0, len(trajectory), 7):
        frame = trajectory.frame(index)
        alive = living_bonds(trajectory, frame.time)
        both = [((alive["cell"] == c) | (alive["partner"] == c)).sum() for c in (0, 1)]
        assert np.array_equal(frame.bond_counts, both)
    assert (alive["partner"] == 0).sum() > 3
    assert (alive["cell"][alive["partner"] >= 0] == 1).all()  # kept by the one that is not held
