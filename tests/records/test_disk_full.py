"""A full disk: refused while there is room for a checkpoint, survived without a crash where it comes by surprise."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mpad_core.interfaces.errors import DiskFullError
from mpad_core.records import hdf5, room, salvage
from mpad_core.records.checkpoint import read_checkpoint, write_checkpoint
from mpad_core.records.hdf5 import TrajectoryWriter
from mpad_core.records.reader import read_trajectory
from mpad_core.records.room import BrokenTrajectoryError, NearlyFullError

# A writer that fills whatever room it is given, and then ends as any program would.
FILL = """
import importlib.util, resource, sys
spec = importlib.util.spec_from_file_location("toy_run", sys.argv[1])
toy = importlib.util.module_from_spec(spec)
spec.loader.exec_module(toy)
import numpy as np
from mpad_core.records import hdf5
from mpad_core.interfaces.errors import DiskFullError
hdf5.free_bytes = lambda directory: 2**40  # told that there is room
if limit := int(sys.argv[3]):
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
try:
    with hdf5.TrajectoryWriter.create(sys.argv[2], toy.header(), toy.FIELDS, reserve=0) as writer:
        for step in range(100_000):
            writer.append(toy.frame(step, np.full((toy.CELLS, 3), float(step))), toy.values(step))
            writer.flush()
            print(writer.rows()["frames"], flush=True)
except DiskFullError as error:
    print(error, file=sys.stderr)
    sys.exit(error.exit_code)
"""


def fill(path, limit=0):
    command = [
        sys.executable,
        "-W",
        "error",
        "-c",
        FILL,
        str(Path(__file__).with_name("toy_run.py")),
        str(path),
        str(limit),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (74, f"{path}: disk full\n")
    return int(done.stdout.split()[-1])


def assert_kept(path, frames):
    found = read_trajectory(path)
    assert len(found) >= frames > 100
    np.testing.assert_array_equal(found.positions[:frames, 0, 0], np.arange(frames))


def test_a_file_that_can_grow_no_more_keeps_every_flushed_frame(tmp_path):
    path = tmp_path / "trajectory.h5"
    assert_kept(path, fill(path, 400_000))


def test_a_full_file_system_keeps_every_flushed_frame(tmp_path):
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=512k", "tmpfs", tmp_path], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("no right to mount a file system")
    try:
        path = tmp_path / "trajectory.h5"
        assert_kept(path, fill(path))
        with pytest.raises(DiskFullError, match="the one before is kept"):
            write_checkpoint(tmp_path / "checkpoint.npz", {"state": np.zeros(2**17)})
        assert [entry.name for entry in tmp_path.iterdir()] == ["trajectory.h5"]
    finally:
        subprocess.run(["umount", tmp_path], check=True)


@pytest.fixture
def free(monkeypatch):
    """Set the number of bytes that the disk claims to have free."""

    def free(number):
        for module in (hdf5, room):
            monkeypatch.setattr(module, "free_bytes", lambda directory: number)

    return free


@pytest.fixture
def writer(write, toy, tmp_path):
    writer = write(tmp_path / "trajectory.h5", steps=3)
    writer.append(toy.frame(3, np.zeros((toy.CELLS, 3))), toy.values(3))
    yield writer
    writer.abandon()


def test_below_the_reserve_the_rows_are_written_and_the_run_told_to_stop(writer, free):
    writer._reserve = 2**20
    free(2**20 - 1)
    with pytest.raises(NearlyFullError, match="nearly full"):
        writer.flush()
    assert writer.rows()["frames"] == 4
    writer.close()
    assert read_trajectory(writer.path).finished


def test_without_room_for_the_rows_nothing_is_tried(writer, free, toy):
    free(1000)
    with pytest.raises(BrokenTrajectoryError, match="disk full, 1000 bytes free") as raised:
        writer.flush()
    assert raised.value.exit_code == 74
    assert writer.rows()["frames"] == 3
    writer.close()  # says nothing more
    with pytest.raises(BrokenTrajectoryError, match="is closed"):
        writer.flush()
    assert len(read_trajectory(writer.path)) == 3
    free(2**40)
    with TrajectoryWriter.resume(writer.path, writer.rows()) as resumed:
        assert resumed.rows() == writer.rows()


def test_no_run_is_begun_or_resumed_without_room(writer, free, toy, tmp_path):
    writer.close()
    free(10)
    with pytest.raises(DiskFullError, match="are needed, 10 are free"):
        TrajectoryWriter.create(tmp_path / "other.h5", toy.header())
    with pytest.raises(DiskFullError, match="are needed, 10 are free"):
        TrajectoryWriter.resume(writer.path, {"frames": 1})
    assert [entry.name for entry in tmp_path.iterdir()] == ["trajectory.h5"]


def test_a_copy_that_finds_no_room_is_removed_and_the_old_file_kept(writer, monkeypatch):
    writer.close()
    before = writer.path.read_bytes()

    def full(*_):
        raise RuntimeError("file write failed: errno = 28, error message = 'No space left on device'")

    monkeypatch.setattr(salvage, "extend", full)
    with pytest.raises(DiskFullError, match="disk full, not begun"):
        TrajectoryWriter.resume(writer.path, {"frames": 2})
    assert writer.path.read_bytes() == before
    assert [entry.name for entry in writer.path.parent.iterdir()] == ["trajectory.h5"]


def test_other_failures_of_the_disk_are_not_called_full(writer, monkeypatch):
    def broken(*_):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(hdf5, "extend", broken)
    with pytest.raises(OSError, match="Input/output error"):
        writer.flush()
    writer.close()
    assert len(read_trajectory(writer.path)) == 3


def test_a_checkpoint_without_room_keeps_the_one_before(tmp_path, monkeypatch):
    path = tmp_path / "checkpoint.npz"
    write_checkpoint(path, {"step": np.array(1)})

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(DiskFullError, match="the one before is kept"):
        write_checkpoint(path, {"step": np.array(2)})
    assert int(read_checkpoint(path)["step"]) == 1
    assert [entry.name for entry in tmp_path.iterdir()] == ["checkpoint.npz"]
