import os
import signal
import subprocess
import sys

import pytest

from mpad_core.interfaces.errors import BusyError, InputError
from mpad_core.records.lock import locked

HOLD = """
import sys, time
from mpad_core.records.lock import locked
with locked(sys.argv[1]):
    print("locked", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path):
    with subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "locked\n"
        yield process
        process.kill()


def test_a_second_writer_is_refused_until_the_first_is_killed(holder, tmp_path):
    with (
        pytest.raises(BusyError, match=f"{tmp_path}: run directory in use .*{holder.pid}") as refused,
        locked(tmp_path),
    ):
        pass
    assert refused.value.exit_code == 75
    os.kill(holder.pid, signal.SIGKILL)
    holder.wait()
    with locked(tmp_path):
        pass


def test_the_lock_holds_within_one_process_and_ends_with_its_block(tmp_path):
    with locked(tmp_path), pytest.raises(BusyError), locked(tmp_path):
        pass
    with locked(tmp_path):
        pass


def test_an_absent_directory_is_named(tmp_path):
    with pytest.raises(InputError, match="nowhere: cannot be locked"), locked(tmp_path / "nowhere"):
        pass


def test_a_lock_that_is_a_link_is_not_followed(tmp_path):
    victim = tmp_path / "victim"
    victim.write_text("precious")
    (tmp_path / "run.lock").symlink_to(victim)
    with pytest.raises(InputError, match="cannot be locked"), locked(tmp_path):
        pass
    assert victim.read_text() == "precious"


@pytest.mark.parametrize(("setting", "warned"), [("FALSE", True), ("0", True), ("TRUE", False), (None, False)])
def test_switched_off_file_locking_is_warned_of(setting, warned, tmp_path, monkeypatch, caplog):
    monkeypatch.delenv("HDF5_USE_FILE_LOCKING", raising=False)
    if setting is not None:
        monkeypatch.setenv("HDF5_USE_FILE_LOCKING", setting)
    with locked(tmp_path):
        pass
    assert ("HDF5_USE_FILE_LOCKING" in caplog.text) == warned
