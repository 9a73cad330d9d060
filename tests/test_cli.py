"""The command line: every exit code, with one clear line on stderr and never a traceback."""

import fcntl
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from mpad_core.records import room
from recorded import assert_same

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
RECRUITMENT = ROOT / "examples" / "recruitment.toml"
SHORT = ("--set", 'stop.time="2 ms"', "--set", 'cells.roller.start.rolling_alone="5 ms"')
LONG = ("--set", 'stop.time="100 s"', "--set", "stop.when=[]", "--set", 'cells.roller.start.rolling_alone="5 ms"')

MIDDLING = ("--set", 'stop.time="1 s"', "--set", "stop.when=[]", "--set", 'cells.roller.start.rolling_alone="20 ms"')


def command(*words, **options):
    """Run the command line in a process of its own."""
    made = [sys.executable, "-m", "mpad_core", *map(str, words)]
    return subprocess.run(made, capture_output=True, text=True, check=False, **options)


def said(text):
    """Leave out the lines of progress, which are JSON."""
    return [line for line in text.splitlines() if not line.startswith("{")]


def events(directory):
    log = directory / "run.jsonl"
    lines = log.read_text().splitlines() if log.exists() else []
    return [json.loads(line)["event"] for line in lines]


def until(condition, seconds=200.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A short run of the example, finished; tests may look but not write."""
    directory = tmp_path_factory.mktemp("cli") / "finished"
    done = command("run", RECRUITMENT, "-o", directory, *SHORT)
    assert done.returncode == 0, done.stderr
    return directory, done


def contents_of(directory):
    return {path: path.read_bytes() for path in sorted(directory.rglob("*")) if path.is_file()}


class TestWell:
    def test_help_names_the_commands(self, mpad):
        code, out, _ = mpad("--help")
        assert code == 0
        assert all(name in out for name in ("run", "check", "parts"))

    def test_without_a_command_there_is_help(self, mpad):
        code, out, err = mpad()
        assert code in (0, 2)
        assert "Commands:" in out + err

    def test_version(self, mpad):
        assert mpad("--version")[1].startswith("mpad, version ")

    def test_the_console_script_is_the_module(self):
        script = Path(sys.executable).with_name("mpad")
        one = subprocess.run([script, "--help"], capture_output=True, text=True, check=True)
        assert one.stdout == command("--help").stdout

    @pytest.mark.parametrize("name", ["recruitment", "capture"])
    def test_check_of_an_example(self, name, mpad):
        code, out, err = mpad("check", ROOT / "examples" / f"{name}.toml")
        assert (code, err) == (0, "")
        assert "solver rpb (mpad-rpb" in out
        assert "thermal      off" in out

    def test_parts(self, mpad):
        code, out, err = mpad("parts")
        assert (code, err) == (0, "")
        assert "BROKEN" not in out
        assert [line[:-1] for line in out.splitlines() if not line.startswith(" ")] == [
            "solver", "bond", "surface", "force",
        ]  # fmt: skip

    def test_a_run_leaves_what_it_promises(self, finished):
        directory, done = finished
        names = {str(path.relative_to(directory)) for path in contents_of(directory)}
        own = {"trajectory.h5", "checkpoint.npz"}
        assert names == {
            *own, *(f"control/{name}" for name in own), "scene.toml", "summary.json", "run.jsonl", "run.lock",
            "passage.png",
        }  # fmt: skip
        assert done.stdout.splitlines()[-1] == f"written to {directory}"
        assert json.loads((directory / "summary.json").read_text())["runs"][0]["ended"] == "time"
        assert events(directory)[0] == "started"
        assert events(directory)[-1] == "finished"

    def test_set_reaches_the_run(self, finished):
        directory, _ = finished
        assert json.loads((directory / "summary.json").read_text())["runs"][0]["time_s"] == pytest.approx(
            2e-3, rel=0.02
        )

    def test_the_resolved_scene_gives_the_same_run(self, finished, mpad, tmp_path):
        directory, _ = finished
        assert mpad("run", directory / "scene.toml", "-o", tmp_path / "again")[0] == 0
        for name in ("trajectory.h5", "control/trajectory.h5"):
            assert_same(directory / name, tmp_path / "again" / name)

    def test_the_directory_left_out_is_named_after_the_scene(self, finished, mpad, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        assert mpad("run", RECRUITMENT, *SHORT)[0] == 0
        assert (tmp_path / "runs" / "recruitment" / "summary.json").exists()

    def test_resuming_what_is_finished_changes_no_result(self, finished, mpad, tmp_path):
        directory, done = finished
        kept = shutil.copytree(directory, tmp_path / "kept")
        before = contents_of(directory)
        code, out, _ = mpad("run", RECRUITMENT, "-o", directory, *SHORT, "--resume")
        assert code == 0
        assert out == done.stdout
        after = contents_of(directory)
        assert after.keys() == before.keys()
        different = {path.name for path in before if before[path] != after[path]}
        assert different <= {"summary.json", "run.jsonl", "run.lock", "trajectory.h5"}
        for name in ("trajectory.h5", "control/trajectory.h5"):
            assert_same(kept / name, directory / name)

    def test_resume_of_what_never_began_begins(self, mpad, tmp_path):
        assert mpad("run", RECRUITMENT, "-o", tmp_path / "new", *SHORT, "--resume")[0] == 0

    def test_a_file_of_any_name_in_the_directory_is_left_alone(self, mpad, tmp_path):
        (tmp_path / "notes.txt").write_text("mine")
        assert mpad("run", RECRUITMENT, "-o", tmp_path, *SHORT)[0] == 0
        assert (tmp_path / "notes.txt").read_text() == "mine"


class TestBadInput:
    """Exit code 2, one line on stderr."""

    @pytest.mark.parametrize("text", [
        'solver = "rpb"', "x", "solver = 1", "[[", "\x00", "", "=" * 5, "a = 1\na = 2",
    ])  # fmt: skip
    @pytest.mark.parametrize("name", ["check", "run"])
    def test_a_scene_that_makes_no_sense(self, name, text, mpad, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        scene = tmp_path / "scene.toml"
        scene.write_text(text)
        code, out, err = mpad(name, scene)
        assert (code, out) == (2, "")
        assert all(line.startswith(f"{scene}:") for line in err.splitlines())
        assert err
        assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]

    @pytest.mark.parametrize("where", ["nowhere.toml", ".", "a\nb.toml"])
    def test_a_scene_that_cannot_be_read(self, where, mpad, tmp_path):
        code, _, err = mpad("check", tmp_path / where)
        assert code == 2
        assert "cannot be read" in err
        assert err.count("\n") == 1

    @pytest.mark.parametrize("setting", [
        "cells.free.y", "cells.free.y=", "=1", "", "cells.free.y=7.5", 'cells.nobody.y="1 um"', "stop=1", "seed=-1",
        'solver="rbp"', 'cells.free.y="7.5 s"', "a.b.c.d=1", "[x]=1", "seed=1\nseed=2", 'solver.name="rpb"=1',
        "cells.free.height=nan", 'bonds.tether.model.off_rate="-1 1/s"', 'effects.thermal="hot"',
        'effects.coupling="perhaps"', 'wall.sites.p-selectin.density="-1 1/um^2"', 'fluid.viscosity="0 Pa s"',
    ])  # fmt: skip
    def test_a_setting_that_makes_no_sense(self, setting, mpad):
        code, out, err = mpad("check", RECRUITMENT, "--set", setting)
        assert (code, out) == (2, "")
        assert err.count("\n") <= 3
        assert err.strip()

    @pytest.mark.parametrize("words", [
        ("frobnicate",), ("run",), ("check",), ("run", "a", "b"), ("run", "a", "--what"), ("check", "--set"),
        ("run", RECRUITMENT, "--checkpoint-every", "-1"), ("run", RECRUITMENT, "--checkpoint-every", "often"),
        ("parts", "more"),
    ])  # fmt: skip
    def test_words_that_make_no_sense(self, words, mpad):
        code, _, err = mpad(*words)
        assert code == 2
        assert err.strip()

    def test_a_run_is_not_written_over(self, finished, mpad):
        directory, _ = finished
        before = contents_of(directory)
        code, _, err = mpad("run", RECRUITMENT, "-o", directory, *SHORT)
        assert code == 2
        assert "--resume" in err
        assert err.count("\n") == 1
        after = contents_of(directory)
        assert {p.name for p in before if before[p] != after[p]} <= {"run.lock"}

    def test_resume_with_another_scene(self, finished, mpad):
        directory, _ = finished
        before = contents_of(directory)
        code, _, err = mpad("run", RECRUITMENT, "-o", directory, *SHORT, "--set", "seed=2", "--resume")
        assert code == 2
        assert "very same scene" in err
        after = contents_of(directory)
        assert {p.name for p in before if before[p] != after[p]} <= {"run.lock"}

    def test_a_trajectory_without_its_scene(self, mpad, tmp_path):
        (tmp_path / "trajectory.h5").write_bytes(b"precious")
        code, _, err = mpad("run", RECRUITMENT, "-o", tmp_path, *SHORT)
        assert code == 2
        assert err.count("\n") == 1
        assert (tmp_path / "trajectory.h5").read_bytes() == b"precious"

    def test_a_file_where_the_directory_should_be(self, mpad, tmp_path):
        (tmp_path / "file").write_text("mine")
        for output in (tmp_path / "file", tmp_path / "file" / "below"):
            code, _, err = mpad("run", RECRUITMENT, "-o", output, *SHORT)
            assert code == 2
            assert err.count("\n") == 1
            assert str(tmp_path / "file") in err

    def test_a_directory_that_cannot_be_made(self, mpad):
        code, _, err = mpad("run", RECRUITMENT, "-o", "/proc/nowhere/run", *SHORT)
        assert code == 2
        assert err.count("\n") == 1

    @pytest.mark.parametrize("damage", [b"", b"nonsense", b"PK\x03\x04"])
    def test_a_damaged_checkpoint(self, damage, finished, mpad, tmp_path):
        self.copied(finished, tmp_path)
        (tmp_path / "run" / "checkpoint.npz").write_bytes(damage)
        code, _, err = mpad("run", RECRUITMENT, "-o", tmp_path / "run", *SHORT, "--resume")
        assert code == 2
        assert "checkpoint.npz" in err
        assert err.count("\n") == 1

    @pytest.mark.parametrize("damage", [b"", b"nonsense", b"\x89HDF\r\n\x1a\n"])
    def test_a_damaged_trajectory(self, damage, finished, mpad, tmp_path):
        self.copied(finished, tmp_path)
        (tmp_path / "run" / "trajectory.h5").write_bytes(damage)
        code, _, err = mpad("run", RECRUITMENT, "-o", tmp_path / "run", *SHORT, "--resume")
        assert code == 2
        assert "trajectory.h5" in err
        assert err.count("\n") == 1

    @pytest.mark.parametrize("lost", ["trajectory.h5", "scene.toml"])
    def test_a_lost_file(self, lost, finished, mpad, tmp_path):
        self.copied(finished, tmp_path)
        (tmp_path / "run" / lost).unlink()
        code, _, err = mpad("run", RECRUITMENT, "-o", tmp_path / "run", *SHORT, "--resume")
        assert code == 2
        assert lost.partition(".")[0] in err
        assert err.count("\n") == 1

    @pytest.mark.parametrize("damage", [b"\xff\xfe\x00", b""])
    def test_a_damaged_copy_of_the_scene(self, damage, finished, mpad, tmp_path):
        self.copied(finished, tmp_path)
        (tmp_path / "run" / "scene.toml").write_bytes(damage)
        code, _, err = mpad("run", RECRUITMENT, "-o", tmp_path / "run", *SHORT, "--resume")
        assert code == 2
        assert "scene.toml" in err
        assert err.count("\n") == 1

    @pytest.mark.parametrize("broken", ["state.centres", "state.wall_gaps", "bonds.site", "rows.frames", "ended"])
    def test_a_checkpoint_that_does_not_fit_the_scene(self, broken, finished, mpad, tmp_path):
        from mpad_core.records.checkpoint import read_checkpoint, write_checkpoint

        self.copied(finished, tmp_path)
        path = tmp_path / "run" / "checkpoint.npz"
        arrays = read_checkpoint(path)
        arrays["ended"] = np.array("")
        for lie in (None, np.array([[1e9]]), np.array("text")):
            told = arrays | {broken: lie} if lie is not None else {k: v for k, v in arrays.items() if k != broken}
            write_checkpoint(path, told)
            longer = ("run", RECRUITMENT, "-o", tmp_path / "run", *SHORT, "--resume")
            code, _, err = mpad(*longer)
            assert code == 2, (lie, err)
            assert "checkpoint" in err
            assert err.count("\n") == 1

    @staticmethod
    def copied(finished, tmp_path):
        shutil.copytree(finished[0], tmp_path / "run")


class TestInUse:
    """Exit code 75."""

    def test_a_second_writer(self, mpad, tmp_path):
        with (tmp_path / "run.lock").open("w") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            code, _, err = mpad("run", RECRUITMENT, "-o", tmp_path, *SHORT)
        assert code == 75
        assert "in use" in err
        assert err.count("\n") == 1
        assert [path.name for path in tmp_path.iterdir()] == ["run.lock"]

    def test_a_second_process_beside_a_live_one(self, tmp_path):
        live = [sys.executable, "-m", "mpad_core", "run", str(RECRUITMENT), "-o", str(tmp_path / "run"), *LONG]
        with subprocess.Popen(live, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as first:
            until((tmp_path / "run" / "checkpoint.npz").exists)
            for resume in ((), ("--resume",)):
                second = command("run", RECRUITMENT, "-o", tmp_path / "run", *LONG, *resume)
                assert second.returncode == 75
                assert len(said(second.stderr)) == 1
                assert str(first.pid) in second.stderr
            assert first.poll() is None
            first.terminate()
            first.communicate(timeout=60)
            assert first.returncode == 143


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    directory = tmp_path_factory.mktemp("whole") / "run"
    done = command("run", RECRUITMENT, "-o", directory, *MIDDLING)
    assert done.returncode == 0, done.stderr
    return directory


class TestInterrupted:
    """Exit codes 130 and 143, with a checkpoint; going on gives the very same run."""

    @pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
    def test_in_the_middle_of_the_march(self, number, code, whole, tmp_path):
        directory = tmp_path / "run"
        order = [sys.executable, "-m", "mpad_core", "run", str(RECRUITMENT), "-o", str(directory), *MIDDLING]
        with subprocess.Popen(order, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            until((directory / "checkpoint.npz").exists)
            time.sleep(0.3)
            first = (directory / "checkpoint.npz").stat().st_mtime_ns
            sent = time.monotonic()
            process.send_signal(number)
            _, err = process.communicate(timeout=60)
            took = time.monotonic() - sent
        assert process.returncode == code, err
        assert took < 5
        assert len(said(err)) == 1
        assert "--resume" in err
        assert (directory / "checkpoint.npz").stat().st_mtime_ns > first
        assert "run ended" not in events(directory)
        done = command("run", RECRUITMENT, "-o", directory, *MIDDLING, "--resume")
        assert done.returncode == 0, done.stderr
        for name in ("trajectory.h5", "control/trajectory.h5"):
            assert_same(whole / name, directory / name)

    @pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
    def test_while_a_cell_first_rolls_alone(self, number, code, tmp_path):
        directory = tmp_path / "run"
        rolling = ("--set", 'cells.roller.start.rolling_alone="100 s"')
        order = [sys.executable, "-m", "mpad_core", "run", str(RECRUITMENT), "-o", str(directory), *rolling]
        with subprocess.Popen(order, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            until(lambda: "preparing" in events(directory))
            time.sleep(1.0)
            process.send_signal(number)
            _, err = process.communicate(timeout=60)
        assert process.returncode == code, err
        assert len(said(err)) == 1
        assert "roll" in err

    @pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
    def test_before_anything_has_begun(self, number, code, tmp_path):
        """The signal falls while tables are made: still no traceback."""
        directory = tmp_path / "run"
        order = [sys.executable, "-m", "mpad_core", "run", str(RECRUITMENT), "-o", str(directory), *LONG]
        for wait in (0.0, 0.05, 0.2, 0.5):
            with subprocess.Popen(order, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
                until(directory.exists)
                time.sleep(wait)
                process.send_signal(number)
                _, err = process.communicate(timeout=60)
            assert process.returncode in (code, -number), err
            assert "Traceback" not in err, (wait, err)
            shutil.rmtree(directory)

    def test_a_second_signal_does_no_harm(self, whole, tmp_path):
        directory = tmp_path / "run"
        order = [sys.executable, "-m", "mpad_core", "run", str(RECRUITMENT), "-o", str(directory), *MIDDLING]
        with subprocess.Popen(order, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            until((directory / "checkpoint.npz").exists)
            for _ in range(5):
                process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=60)
        assert process.returncode == 130
        assert "Traceback" not in err
        done = command("run", RECRUITMENT, "-o", directory, *MIDDLING, "--resume")
        assert done.returncode == 0, done.stderr
        assert_same(whole / "trajectory.h5", directory / "trajectory.h5")


class TestDiskFull:
    """Exit code 74, resumable where anything was kept."""

    def test_nearly_full_at_the_start(self, mpad, tmp_path, monkeypatch):
        monkeypatch.setattr(room, "free_bytes", lambda directory: 1000)
        monkeypatch.setattr(os, "_exit", sys.exit)
        code, _, err = mpad("run", RECRUITMENT, "-o", tmp_path / "run", *SHORT)
        assert code == 74
        assert len(said(err)) == 1

    @pytest.mark.skipif(os.geteuid() != 0, reason="only root may mount")
    @pytest.mark.parametrize("size", ["20k", "300k", "17m"])
    def test_a_small_disk(self, size, tmp_path):
        disk = tmp_path / "disk"
        disk.mkdir()
        kind = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(disk)]
        if subprocess.run(kind, capture_output=True, check=False).returncode:
            pytest.skip("mounting is not allowed here")
        try:
            every = ("--set", 'record.every={ time = "10 us" }', "--checkpoint-every", "0.2")
            short = ("--set", 'stop.time="100 ms"', "--set", 'cells.roller.start.rolling_alone="5 ms"')
            done = command("run", RECRUITMENT, "-o", disk / "run", *short, *every)
            assert done.returncode == 74, done.stderr
            assert len(said(done.stderr)) == 1
            kept = (disk / "run" / "checkpoint.npz").exists()
            grown = ["mount", "-o", "remount,size=200m", str(disk)]
            subprocess.run(grown, capture_output=True, check=True)
            again = command("run", RECRUITMENT, "-o", disk / "run", *short, *every, "--resume")
            assert again.returncode == 0, again.stderr
            assert ("resumed" in events(disk / "run")) == kept
        finally:
            subprocess.run(["umount", "-l", str(disk)], check=True)
