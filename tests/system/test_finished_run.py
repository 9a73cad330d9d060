"""What a finished run leaves: readable by others, complete, and consistent with itself."""

import json
import subprocess
import sys
import warnings

import numpy as np
import pytest

from mpad_core import load_scene
from mpad_core.records.checkpoint import read_checkpoint
from mpad_core.records.reader import living_bonds, read_trajectory
from mpad_core.scene.compose import compose

pytestmark = pytest.mark.slow

NM, ANGSTROM = 1e3, 1e4  # in a µm
LARGEST_MEMORY = 600e6  # bytes


@pytest.fixture(scope="module", params=["", "control"])
def folder(request, finished):
    return finished / request.param


@pytest.fixture(scope="module")
def problem(finished):
    return compose(load_scene(finished / "scene.toml"))


def test_mdanalysis_opens_it(folder, tmp_path):
    trajectory = read_trajectory(folder / "trajectory.h5")
    (tmp_path / "run.h5md").symlink_to(folder / "trajectory.h5")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the libraries that it imports
        import MDAnalysis

        told = MDAnalysis.Universe.empty(len(trajectory.header.cells), trajectory=True)
        told.load_new(str(folder / "trajectory.h5"), format="H5MD")
        for universe in (told, MDAnalysis.Universe(str(tmp_path / "run.h5md"))):
            assert len(universe.trajectory) == len(trajectory)
            for i, frame in enumerate(universe.trajectory):
                assert frame.time == pytest.approx(1e12 * trajectory.times[i], abs=1e-3)
                assert np.allclose(frame.positions, ANGSTROM * trajectory.positions[i], rtol=1e-6)
            universe.trajectory.close()


def test_the_trajectory_is_finished_and_begins_at_zero(folder):
    trajectory = read_trajectory(folder / "trajectory.h5")
    assert trajectory.finished
    assert trajectory.times[0] == 0.0
    assert trajectory.steps[0] == 0
    assert (np.diff(trajectory.times) > 0).all()
    assert np.isfinite(trajectory.positions).all()
    assert (trajectory.wall_gaps > 0).all()
    assert np.allclose(np.linalg.norm(trajectory.orientations, axis=2), 1.0, rtol=0, atol=1e-12)


def test_frames_come_at_every_step_of_time_or_place(folder):
    trajectory = read_trajectory(folder / "trajectory.h5")
    every = load_scene(folder.parent / "scene.toml" if folder.name == "control" else folder / "scene.toml").record.every
    i = trajectory.header.cells.index("free")
    x = trajectory.positions[:, :, 0]
    apart = np.abs(np.diff(x[:, i] - x[:, trajectory.header.cells.index("roller")] if x.shape[1] > 1 else x[:, i]))
    lasted = np.diff(trajectory.times)
    assert (apart <= every.dx * (1 + 1e-9)).all()
    assert (lasted <= every.time * (1 + 1e-9)).all()
    due = np.isclose(apart, every.dx, rtol=1e-9) | np.isclose(lasted, every.time, rtol=1e-9)
    assert due[:-1].all()  # the last frame is that of the end


def test_the_overlap_is_the_height_above_zero_overlap(folder, problem):
    trajectory = read_trajectory(folder / "trajectory.h5")
    zero = [problem.zero_overlap[problem.names.index(name)] for name in trajectory.header.cells]
    assert np.array_equal(trajectory.overlaps, trajectory.positions[:, :, 2] - zero)
    assert trajectory.overlaps[0, trajectory.header.cells.index("free")] == pytest.approx(0.0, abs=1e-12)
    radii = np.array(trajectory.header.radii)
    assert np.allclose(trajectory.wall_gaps, trajectory.positions[:, :, 2] - radii, rtol=0, atol=1e-12)


def test_the_table_of_events_rebuilds_the_living_bonds(folder):
    trajectory = read_trajectory(folder / "trajectory.h5")
    kept = read_checkpoint(folder / "checkpoint.npz")
    rebuilt = living_bonds(trajectory, float(kept["state.time"]))
    order = np.lexsort((rebuilt["receptor"], rebuilt["cell"]))
    cells, sites = kept["bonds.cell"], kept["bonds.site"]
    assert len(rebuilt) == len(cells)
    if folder.name == "control":
        assert len(rebuilt) == 0
        return
    assert len(rebuilt) > 5
    same = np.lexsort((sites, cells))
    assert np.array_equal(rebuilt["cell"][order], cells[same])
    assert np.array_equal(rebuilt["receptor"][order], sites[same])  # the binding cell is the first: its sites too
    assert np.array_equal(rebuilt["species"][order], kept["bonds.species"][same])
    anchors = np.stack([rebuilt["anchor_x"], rebuilt["anchor_y"]], axis=1)
    assert np.array_equal(anchors[order], kept["bonds.anchor"][same, :2])


def test_bond_counts_are_those_of_the_events(folder):
    trajectory = read_trajectory(folder / "trajectory.h5")
    for i, time in enumerate(trajectory.times):
        alive = living_bonds(trajectory, time)
        counted = np.bincount(alive["cell"], minlength=len(trajectory.header.cells))
        assert np.array_equal(counted, trajectory.bond_counts[i])


def test_no_receptor_holds_two_bonds_and_none_breaks_that_never_formed(folder):
    alive = set()
    for event in read_trajectory(folder / "trajectory.h5").bond_events:
        who = (int(event["cell"]), int(event["receptor"]))
        assert (who in alive) == bool(event["kind"])
        alive ^= {who}


def test_events_lie_in_order_within_the_run(folder):
    trajectory = read_trajectory(folder / "trajectory.h5")
    events = trajectory.bond_events
    end = float(read_checkpoint(folder / "checkpoint.npz")["state.time"])
    assert (np.diff(events["time"]) >= 0).all()
    if len(events):
        assert events["time"].min() >= 0
        assert events["time"].max() <= end
        assert (events["force"] >= 0).all()  # slack bonds only pull
        assert (events["length"] > 0).all()


def test_the_last_frame_is_that_of_the_end(folder):
    trajectory = read_trajectory(folder / "trajectory.h5")
    kept = read_checkpoint(folder / "checkpoint.npz")
    assert trajectory.times[-1] == float(kept["state.time"])
    assert np.array_equal(trajectory.positions[-1], kept["state.centres"])


def test_the_summary_says_what_the_files_say(finished):
    summary = json.loads((finished / "summary.json").read_text())
    for told in summary["runs"]:
        trajectory = read_trajectory(finished / told["folder"] / "trajectory.h5")
        kept = read_checkpoint(finished / told["folder"] / "checkpoint.npz")
        assert told["time_s"] == float(kept["state.time"])
        assert told["ended"] == str(kept["ended"])
        for i, name in enumerate(trajectory.header.cells):
            assert told["cells"][name]["bonds_at_end"] == np.count_nonzero(kept["bonds.cell"] == i)
            assert told["cells"][name]["least_overlap_nm"] == pytest.approx(NM * trajectory.overlaps[:, i].min())


def test_the_control_is_the_run_without_the_others(finished):
    control = read_trajectory(finished / "control" / "trajectory.h5")
    assert control.header.cells == ("free",)
    assert len(control.bond_events) == 0
    both = read_trajectory(finished / "trajectory.h5")
    assert np.array_equal(control.positions[0, 0], both.positions[0, both.header.cells.index("free")])


def test_how_often_frames_are_recorded_changes_no_run(finished, tools, tmp_path):
    base = ['stop.time="60 ms"', 'cells.roller.start.rolling_alone="100 ms"']
    tools.finish(
        tmp_path / "often", tools.settings(*base, 'record.every={ time = "0.3 ms" }'), "--checkpoint-every", "0"
    )
    one, other = (read_checkpoint(path / "checkpoint.npz") for path in (finished, tmp_path / "often"))
    own = [name for name in one if name.startswith(("state.", "bonds."))]
    assert len(own) > 10
    assert not [name for name in own if one[name].tobytes() != other[name].tobytes()]


def test_peak_memory(tools, tmp_path):
    code = (
        "import resource, subprocess, sys; words = [sys.executable, '-m', 'mpad_core', *sys.argv[1:]];"
        "code = subprocess.run(words, stdout=subprocess.DEVNULL).returncode;"
        "print(code, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    words = [sys.executable, "-c", code, "run", str(tools.scene), "-o", str(tmp_path / "run")]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    left, kilobytes = map(int, done.stdout.split())
    print(f"peak memory of the example: {kilobytes / 1024:.0f} MB")
    assert left == 0
    assert kilobytes * 1024 < LARGEST_MEMORY
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    print(f"wall time of the example: {summary['wall_s']:.1f} s")
