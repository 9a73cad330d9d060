"""SIGKILL at random times: the run goes on from its checkpoint and ends with the very same bits."""

import json
import random
import time

import pytest

from mpad_core.records.checkpoint import read_checkpoint
from mpad_core.records.reader import read_trajectory

pytestmark = pytest.mark.slow

CHAINS, KILLS = 3, 7
OFTEN = ("--checkpoint-every", "0.2")
FEW = ['stop.time="400 ms"', "stop.when=[]", 'cells.roller.start.rolling_alone="20 ms"']
VARIANTS = {
    "isolated": [*FEW[1:], 'stop.time="120 ms"', 'solver="isolated"'],
    "thermal": [*FEW[1:], 'stop.time="120 ms"', 'effects.thermal="on"'],
    "auto": [
        *FEW[1:],
        'stop.time="120 ms"',
        'solver={name="auto", accuracy=1e-2, levels=["rpb lone_sphere=exact", "cdl-biem accuracy=0.01"]}',
    ],
    "pairs": [*FEW[1:], 'stop.time="120 ms"', 'bonds.tether.reach="pairs"'],
}


def log(directory):
    path = directory / "run.jsonl"
    lines = path.read_text().splitlines() if path.exists() else []
    return [json.loads(line)["event"] for line in lines]


def marking(directory):
    """Give what tells that the trajectory at work has been written to: its file's number and its time."""
    files = [path.stat() for path in directory.rglob("trajectory.h5")]
    newest = max(files, key=lambda found: found.st_mtime_ns, default=None)
    return newest and (newest.st_ino, newest.st_mtime_ns)


def wait_for_the_loop(directory, seen, process):
    """Wait until a process that found `seen` lines in the log has begun and then written to one file twice."""
    writes, last = 0, None
    while writes < 2:
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.003)
        if not {"resumed", "preparing"} & set(log(directory)[seen:]):
            continue
        mark = marking(directory)
        writes += bool(mark and last and mark[0] == last[0] and mark != last)
        last = mark


def frames(directory):
    """Count the frames that the checkpoints of run and control stand for, and those that are in the files."""
    kept = written = 0
    for folder in (directory, directory / "control"):
        if (folder / "checkpoint.npz").exists():
            kept += int(read_checkpoint(folder / "checkpoint.npz")["rows.frames"])
            written += len(read_trajectory(folder / "trajectory.h5"))
    return kept, written


def kill(tools, directory, arguments, wait, from_the_start):
    """Start or go on, and kill after `wait`, counted from the time loop's beginning or from the process's own.

    Give whether the run had ended by then, and whether frames had been added: the kill fell into the time loop.
    """
    seen = len(log(directory))
    before, _ = frames(directory)
    with tools.start(directory, arguments, *OFTEN, "--resume") as process:
        if not from_the_start:
            wait_for_the_loop(directory, seen, process)
        time.sleep(wait)
        ended = process.poll() is not None
        process.kill()
        process.communicate()
    _, after = frames(directory)
    return ended, not ended and not from_the_start and after > before


@pytest.fixture(scope="module")
def whole(tools, tmp_path_factory):
    directory = tmp_path_factory.mktemp("whole") / "run"
    tools.finish(directory, tools.settings(*FEW))
    return directory


@pytest.fixture(scope="module")
def in_the_loop():
    return []


@pytest.mark.parametrize("chain", range(CHAINS))
def test_killed_again_and_again(chain, whole, in_the_loop, tools, tmp_path):
    dice = random.Random(chain)
    directory = tmp_path / "run"
    arguments = tools.settings(*FEW)
    for number in range(KILLS):
        from_the_start = number == chain + 1
        wait = dice.uniform(0.3, 2.0) if from_the_start else dice.uniform(0.0, 0.25)
        ended, inside = kill(tools, directory, arguments, wait, from_the_start)
        in_the_loop.append(inside)
        if ended:
            break
    tools.finish(directory, arguments, "--resume")
    tools.assert_same_runs(whole, directory)


def test_most_kills_fell_into_the_time_loop(in_the_loop):
    print(f"{sum(in_the_loop)} of {len(in_the_loop)} kills fell into the time loop")
    if len(in_the_loop) < CHAINS:
        pytest.skip("the chains ran elsewhere")
    assert len(in_the_loop) >= 20
    assert sum(in_the_loop) >= 15


@pytest.mark.parametrize("variant", VARIANTS)
def test_killed_once(variant, tools, tmp_path):
    arguments = tools.settings(*VARIANTS[variant])
    tools.finish(tmp_path / "whole", arguments)
    ended, inside = kill(tools, tmp_path / "cut", arguments, 0.05, from_the_start=False)
    assert inside or ended
    tools.finish(tmp_path / "cut", arguments, "--resume")
    tools.assert_same_runs(tmp_path / "whole", tmp_path / "cut")
