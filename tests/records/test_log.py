import io
import json
import subprocess
import sys

import numpy as np
import pytest

from mpad_core.interfaces.errors import DiskFullError, InputError
from mpad_core.records import log as log_module
from mpad_core.records import progress as progress_module
from mpad_core.records.log import RunLog, read_log
from mpad_core.records.progress import progress


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.jsonl"


def test_each_line_has_time_event_and_data(path):
    with RunLog(path) as log:
        log.write("started", scene="µ", steps=np.int64(3), gaps=np.array([0.5, np.inf]), nested={"a": (1, None, True)})
    (line,) = read_log(path)
    assert line["time"].endswith("+00:00")
    assert line["event"] == "started"
    assert line["data"] == {"scene": "µ", "steps": 3, "gaps": [0.5, "inf"], "nested": {"a": [1, None, True]}}


@pytest.mark.parametrize("torn", ["", '{"time": "2', "{" * 200_000])
def test_a_torn_last_line_is_cut_off_on_resuming(torn, path):
    with RunLog(path) as log:
        log.write("started")
    with path.open("a") as stream:
        stream.write(torn)
    assert [line["event"] for line in read_log(path)] == ["started"]
    with RunLog(path, resume_at=1.5) as log:
        log.write("frame", step=1)
    lines = read_log(path)
    assert [line["event"] for line in lines] == ["started", "resumed", "frame"]
    assert lines[1]["data"] == {"simulated": 1.5}


def test_a_log_that_is_torn_in_its_first_line_begins_anew(path):
    path.write_bytes(b'{"time"')
    with RunLog(path) as log:
        log.write("started")
    assert len(read_log(path)) == 1


@pytest.mark.parametrize("content", [b"no json\n", b"[1]\n", b"\xff\n"])
def test_what_is_no_log_is_refused(content, path):
    path.write_bytes(content)
    with pytest.raises(InputError, match="cannot be read as a log"):
        read_log(path)


def test_an_absent_place_is_named(tmp_path):
    with pytest.raises(InputError, match="the log cannot be opened"):
        RunLog(tmp_path / "nowhere" / "run.jsonl")
    with pytest.raises(InputError, match="cannot be read as a log"):
        read_log(tmp_path / "run.jsonl")


def test_a_full_disk_leaves_no_half_line(path, monkeypatch):
    write = log_module.os.write
    with RunLog(path) as log:
        log.write("started")
        monkeypatch.setattr(log_module.os, "write", lambda descriptor, data: write(descriptor, data[:9]))
        with pytest.raises(DiskFullError):
            log.write("frame")
    assert path.read_bytes().count(b"\n") == 1
    assert path.read_bytes().endswith(b"\n")


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    """Let wall time pass only when told to."""

    class Clock:
        now = 0.0

        def monotonic(self):
            return self.now

    clock = Clock()
    monkeypatch.setattr(progress_module, "time", clock)
    return clock


def run(clock, **options):
    with progress(100.0, start=20.0, interval=10.0, **options) as shown:
        for step in range(1, 41):
            clock.now += 1.0
            shown.update(20.0 + 2.0 * step, step)


def test_without_a_terminal_a_line_comes_every_interval(path, clock):
    stream = io.StringIO()
    with RunLog(path) as log:
        run(clock, log=log, stream=stream)
    lines = [json.loads(line) for line in stream.getvalue().splitlines()]
    assert lines == read_log(path)
    assert [line["data"]["step"] for line in lines] == [10, 20, 30, 40]
    assert lines[1]["data"] == {"simulated": 60.0, "total": 100.0, "step": 20, "speed": 2.0, "left": 20.0}


def test_a_terminal_gets_a_bar_and_the_log_its_lines(path, clock):
    stream = Terminal()
    with RunLog(path) as log:
        run(clock, log=log, stream=stream)
    assert "{" not in stream.getvalue()
    assert "100/100 s, 2 s/s, 0:00:00 left" in stream.getvalue()
    assert [line["event"] for line in read_log(path)] == ["progress"] * 4


def test_before_anything_moves_no_time_is_promised(clock):
    stream = io.StringIO()
    with progress(1.0, stream=stream, interval=0.0) as shown:
        shown.update(0.0, 0)
    assert json.loads(stream.getvalue())["data"]["left"] == "inf"


def test_only_a_terminal_costs_the_import_of_tqdm():
    code = "import sys, mpad_core.records.progress; sys.exit('tqdm' in sys.modules or 'h5py' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
