"""Killed at random moments, a run goes on as if nothing had been: every dataset equal, bit for bit."""

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest

from mpad_core.interfaces.errors import InputError
from mpad_core.records.hdf5 import TrajectoryWriter
from mpad_core.records.log import read_log
from mpad_core.records.reader import read_trajectory
from mpad_core.records.salvage import repair

STEPS = 60
KILLS = 20


@pytest.fixture(scope="module")
def server():
    command = [sys.executable, "-W", "error", str(Path(__file__).with_name("toy_run.py"))]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1) as process:
        yield process
        process.stdin.close()


def asked(server, line, answer):
    server.stdin.write(f"{line}\n")
    server.stdin.flush()
    word, number = server.stdout.readline().split()
    assert word == answer  # before the number is taken for a process
    return int(number)


def begin(server, directory):
    return asked(server, f"{directory} {STEPS}", "child")


def ended(server):
    return asked(server, "wait", "ended")


@pytest.fixture(scope="module")
def uninterrupted(server, tmp_path_factory):
    for _ in range(2):  # the first also waits for the server's start
        directory = tmp_path_factory.mktemp("uninterrupted")
        started = time.monotonic()
        begin(server, directory)
        assert ended(server) == 0
    return directory / "trajectory.h5", time.monotonic() - started


def acknowledged(directory):
    path = directory / "acknowledged"
    counts = path.read_bytes().split() if path.exists() else []
    return tuple(map(int, counts)) if len(counts) == 2 else (0, 0)


def assert_nothing_acknowledged_is_lost(directory, whole):
    path = directory / "trajectory.h5"
    if not path.exists():
        assert acknowledged(directory) == (0, 0)
        return
    found, (frames, happened) = read_trajectory(path), acknowledged(directory)
    assert len(found) >= frames
    assert len(found.bond_events) >= happened
    np.testing.assert_array_equal(found.positions, whole.positions[: len(found)])
    np.testing.assert_array_equal(found.velocities, whole.velocities[: len(found)])
    np.testing.assert_array_equal(found.bond_events, whole.bond_events[: len(found.bond_events)])


def lives(server, directory, moment, whole, longest):
    """Live on until the run is through; count the violent deaths."""
    deaths = 0
    while True:
        child = begin(server, directory)
        time.sleep(moment.uniform(0.0, longest))
        os.kill(child, signal.SIGKILL)
        if ended(server) == 0:
            return deaths
        deaths += 1
        assert_nothing_acknowledged_is_lost(directory, whole)


def test_killed_runs_end_like_one_that_was_not(server, uninterrupted, tmp_path, assert_same):
    (expected, duration), moment, deaths = uninterrupted, random.Random(20), 0
    whole = read_trajectory(expected)
    while deaths < KILLS:
        directory = Path(tempfile.mkdtemp(dir=tmp_path))
        deaths += lives(server, directory, moment, whole, 0.7 * duration)
        assert_same(directory / "trajectory.h5", expected)
        assert {line["event"] for line in read_log(directory / "run.jsonl")} == {"resumed", "frame"}
        assert not list(directory.glob("*.tmp"))


@pytest.fixture
def cut_off(server, uninterrupted, tmp_path):
    """Leave what a killed run leaves."""
    child = begin(server, tmp_path)
    while acknowledged(tmp_path)[0] < STEPS // 3:
        time.sleep(1e-3)
    os.kill(child, signal.SIGKILL)
    assert ended(server) == -signal.SIGKILL
    return tmp_path / "trajectory.h5"


def test_repair_makes_a_finished_file_of_all_whole_rows(cut_off, uninterrupted):
    before = read_trajectory(cut_off)
    rows = repair(cut_off)
    after = read_trajectory(cut_off)
    assert (before.finished, after.finished) == (False, True)
    assert rows == {"frames": len(after), "bond_events": len(after.bond_events)}
    np.testing.assert_array_equal(after.positions, read_trajectory(uninterrupted[0]).positions[: len(after)])


def test_a_copy_is_cut_to_the_rows_asked_for(cut_off):
    TrajectoryWriter.resume(cut_off, {"frames": 4, "bond_events": 3}, reserve=0).close()
    found = read_trajectory(cut_off)
    assert (len(found), len(found.bond_events)) == (4, 3)


def test_more_rows_than_there_are_cannot_be_asked_for(cut_off):
    before = cut_off.read_bytes()
    with pytest.raises(InputError, match=r"holds .* frames, the checkpoint counts 1000"):
        TrajectoryWriter.resume(cut_off, {"frames": 1000, "bond_events": 0})
    assert cut_off.read_bytes() == before
    assert not cut_off.with_name("trajectory.h5.tmp").exists()


def test_a_finished_trajectory_can_be_gone_on_with(finished, write, toy, tmp_path, assert_same):
    with TrajectoryWriter.resume(finished, {"frames": 9, "bond_events": 12}) as writer:
        writer.append(toy.frame(9, np.zeros((toy.CELLS, 3))), toy.values(9))
    straight = tmp_path / "straight.h5"
    with write(straight) as writer:
        writer.append(toy.frame(9, np.zeros((toy.CELLS, 3))), toy.values(9))
    assert_same(finished, straight)
