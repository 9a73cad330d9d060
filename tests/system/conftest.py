"""Whole runs of the example, cut short, in processes of their own."""

import subprocess
import sys
from pathlib import Path

import pytest

from recorded import assert_same, datasets

RECRUITMENT = Path(__file__).parents[2] / "examples" / "recruitment.toml"


def start(directory, arguments, *more):
    """Begin a run of the example as a process."""
    words = [sys.executable, "-m", "mpad_core", "run", RECRUITMENT, "-o", directory, *arguments, *more]
    return subprocess.Popen([str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def settings(*pairs):
    """Write settings as arguments."""
    return [word for pair in pairs for word in ("--set", pair)]


@pytest.fixture(scope="session")
def tools():
    """Hand the helpers above to tests, which cannot import them."""

    class Tools:
        scene = RECRUITMENT
        start = staticmethod(start)
        settings = staticmethod(settings)
        datasets = staticmethod(datasets)

        @staticmethod
        def finish(directory, arguments, *more):
            with start(directory, arguments, *more) as process:
                out, err = process.communicate(timeout=280)
            assert process.returncode == 0, err
            return out

        @staticmethod
        def assert_same_runs(one, other):
            first = sorted(path.relative_to(one) for path in one.rglob("trajectory.h5"))
            assert first == sorted(path.relative_to(other) for path in other.rglob("trajectory.h5"))
            for name in first:
                assert_same(one / name, other / name)
                kept = name.with_name("checkpoint.npz")
                assert (one / kept).read_bytes() == (other / kept).read_bytes(), kept

    return Tools


@pytest.fixture(scope="session")
def finished(tools, tmp_path_factory):
    """A run of the example, cut short, of which every file is there."""
    directory = tmp_path_factory.mktemp("finished") / "run"
    tools.finish(directory, settings('stop.time="60 ms"', 'cells.roller.start.rolling_alone="100 ms"'))
    return directory
