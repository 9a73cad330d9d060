"""Files that are damaged, foreign or made to harm: each is refused in one line, before anything in it is followed."""

import os
import subprocess
import sys

import h5py
import numpy as np
import pytest

from mpad_core.interfaces.errors import InputError
from mpad_core.records.hdf5 import TrajectoryWriter
from mpad_core.records.reader import read_trajectory

POSITIONS = "mpad/positions"


def edited(change):
    """Make a kind of hostile file from a good one."""

    def edit(path):
        with h5py.File(path, "r+") as file:
            change(file)

    return edit


def replaced(name, **made):
    def change(file):
        del file[name]
        file.create_dataset(name, **made)

    return edited(change)


def linked(name, link):
    def change(file):
        del file[name]
        file[name] = link

    return edited(change)


def _absent(path):
    path.unlink()


def _directory(path):
    path.unlink()
    path.mkdir()


def _pipe(path):
    path.unlink()
    os.mkfifo(path)


def _text(path):
    path.write_text("[fluid]\nshear_rate = 1\n")


def _truncated(path):
    path.write_bytes(path.read_bytes()[:-3000])


def _other_program(path):
    path.unlink()
    with h5py.File(path, "x") as file:
        file["data"] = 1.0


def _external_storage(path):
    secret = path.with_name("secret")
    secret.write_bytes(b"s" * 9 * 9 * 8)
    replaced(POSITIONS, shape=(9, 3, 3), dtype="f8", external=[(str(secret), 0, 9 * 9 * 8)])(path)


def _virtual(path):
    layout = h5py.VirtualLayout(shape=(9, 3, 3), dtype="f8")
    layout[:] = h5py.VirtualSource("/etc/hostname", "x", shape=(9, 3, 3))

    def change(file):
        del file[POSITIONS]
        file.create_virtual_dataset(POSITIONS, layout)

    edited(change)(path)


def _loop(path):
    """Groups that hold each other are walked once; the missing dataset is what is told."""

    def change(file):
        file["mpad/cells/mpad"] = file["mpad"]
        del file["mpad/scene"]

    edited(change)(path)


def _crowd(path):
    def change(file):
        for index in range(10_001):
            file["mpad"].create_group(f"x{index}")

    edited(change)(path)


def _newer(file):
    file["mpad"].attrs["format"] = 3


def _no_seed(file):
    file["mpad"].attrs["seed"] = "many"


def _no_creator(file):
    file["h5md/creator"].attrs["name"] = "another"


def _uneven_cells(file):
    del file["mpad/cells/radii"]
    file["mpad/cells/radii"] = np.ones(4)


def _uneven_bonds(file):
    del file["mpad/bonds/reaches"]
    file["mpad/bonds/reaches"] = np.array([b"a", b"b"])


def _not_utf8(file):
    file["mpad/scene"][()] = b"\xff\xfe"


def _dangling_field(file):
    file["mpad/observers"].create_dataset("x", shape=(9,), dtype="f8")


def _group_for_dataset(file):
    del file["mpad/wall_gaps"]
    file.create_group("mpad/wall_gaps")


def _named_type(file):
    file["mpad/type"] = np.dtype("f8")


KINDS = {
    "absent": (_absent, "no such file"),
    "directory": (_directory, "not a regular file"),
    "pipe": (_pipe, "not a regular file"),
    "text": (_text, "not an HDF5 file"),
    "truncated": (_truncated, "cannot be read as a trajectory"),
    "other program": (_other_program, "not written by mpad"),
    "other creator": (edited(_no_creator), "not written by mpad"),
    "newer format": (edited(_newer), "has format 3, this mpad reads up to 2"),
    "external link": (linked(POSITIONS, h5py.ExternalLink("/etc/x.h5", "/x")), r"mpad/positions: is a link \(External"),
    "external root": (linked("mpad", h5py.ExternalLink("other.h5", "/mpad")), r"/mpad: is a link \(ExternalLink\)"),
    "soft link": (linked(POSITIONS, h5py.SoftLink("/particles/trajectory/position/value")), r"is a link \(SoftLink\)"),
    "external storage": (_external_storage, "lies in another file"),
    "virtual dataset": (_virtual, "is a virtual dataset"),
    "unknown filter": (
        replaced(POSITIONS, data=np.zeros((9, 3, 3)), compression="lzf"),
        r"unknown filter \(number 32000\)",
    ),
    "terabytes": (replaced(POSITIONS, shape=(10**11, 3, 3), chunks=(9, 3, 3), dtype="f8"), "declares shape"),
    "many cells": (replaced("mpad/cells/radii", shape=(10**12,), chunks=(9,), dtype="f8"), "declares shape"),
    "zip bomb": (
        replaced(POSITIONS, shape=(10**9, 3, 3), chunks=(9, 3, 3), dtype="f8", compression="gzip"),
        "declares shape",
    ),
    "wrong type": (
        replaced(POSITIONS, data=np.zeros((9, 3, 3), "f4")),
        "mpad/positions: holds float32, expected float64",
    ),
    "wrong rank": (replaced(POSITIONS, data=np.zeros((9, 9))), r"has shape \(9, 9\), expected \(rows, 3, 3\)"),
    "wrong cells": (replaced(POSITIONS, data=np.zeros((9, 4, 3))), r"has shape \(9, 4, 3\), expected \(rows, 3, 3\)"),
    "scalar": (replaced(POSITIONS, data=1.0), r"has shape \(\)"),
    "null": (replaced(POSITIONS, data=h5py.Empty("f8")), "has a type that mpad does not write"),
    "variable length": (
        replaced("mpad/scene", data="text", dtype=h5py.string_dtype()),
        "has a type that mpad does not",
    ),
    "references": (replaced(POSITIONS, shape=(9, 3, 3), dtype=h5py.ref_dtype), "has a type that mpad does not write"),
    "wrong events": (replaced("mpad/bond_events", data=np.zeros(3)), "mpad/bond_events: holds float64"),
    "missing dataset": (edited(lambda file: file.__delitem__(POSITIONS)), "/mpad/positions: dataset is missing"),
    "missing group": (edited(lambda file: file.__delitem__("mpad/observers")), "/mpad/observers: group is missing"),
    "group for dataset": (edited(_group_for_dataset), "/mpad/wall_gaps: dataset is missing"),
    "named type": (edited(_named_type), "/mpad/type: is neither group nor dataset"),
    "loop": (_loop, "/mpad/scene: dataset is missing"),
    "crowd": (_crowd, "holds more than 10000 objects"),
    "seed": (edited(_no_seed), "attribute seed is no whole number"),
    "cells": (edited(_uneven_cells), "radii: 4 given for 3 cells"),
    "bonds": (edited(_uneven_bonds), "differ in number"),
    "not utf-8": (edited(_not_utf8), "cannot be read as a trajectory"),
    "unnumbered field": (edited(_dangling_field), "attribute index is missing"),
}


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_refused_in_one_line(kind, finished):
    make, fault = KINDS[kind]
    make(finished)
    with pytest.raises(InputError, match=fault) as refused:
        read_trajectory(finished)
    assert len(str(refused.value).splitlines()) == 1
    assert str(refused.value).startswith(f"{finished}: ")
    assert str(refused.value).count(str(finished)) == 1
    assert len(str(refused.value)) < 400 + len(str(finished))


@pytest.mark.parametrize("kind", ["external link", "terabytes", "wrong rank", "truncated"])
def test_it_is_not_resumed_either_and_stays_as_it_was(kind, finished):
    KINDS[kind][0](finished)
    before = finished.read_bytes()
    with pytest.raises(InputError):
        TrajectoryWriter.resume(finished, {"frames": 2, "bond_events": 1})
    assert finished.read_bytes() == before
    assert not list(finished.parent.glob("*.tmp"))


def test_a_file_packed_anew_with_gzip_is_read(finished):
    def change(file):
        values = file[POSITIONS][()]
        del file[POSITIONS]
        file.create_dataset(POSITIONS, data=values, chunks=(9, 3, 3), compression="gzip", shuffle=True, fletcher32=True)

    before = read_trajectory(finished).positions
    edited(change)(finished)
    np.testing.assert_array_equal(read_trajectory(finished).positions, before)


@pytest.mark.parametrize(("lost", "most"), [(1, 40), (200, 40), (3_000, 39), (20_000, 30)])
def test_a_live_file_that_lost_its_end_gives_what_is_whole(lost, most, toy, tmp_path):
    with TrajectoryWriter.create(tmp_path / "live.h5", toy.header(), toy.FIELDS, chunk_bytes=500) as writer:
        for step in range(40):
            writer.append(toy.frame(step, np.full((toy.CELLS, 3), step + 1.0)), toy.values(step))
            writer.flush()
        cut = tmp_path / "cut.h5"
        cut.write_bytes(writer.path.read_bytes()[:-lost])
    found = read_trajectory(cut)
    assert not found.finished
    assert 0 < len(found) <= most
    np.testing.assert_array_equal(found.positions[:, 0, 0], np.arange(len(found)) + 1.0)
    np.testing.assert_array_equal(found.observed["contacts"], np.arange(len(found)))


@pytest.mark.parametrize("name", ["mpad/velocities", "mpad/time", "mpad/bond_events", "mpad/observers/tilt"])
def test_a_changed_number_is_found_by_its_rows_sum(name, finished):
    def change(file):
        rows = file[name][()]
        rows[2] = rows[5]
        file[name][()] = rows

    edited(change)(finished)
    with pytest.raises(InputError, match="row 2 is damaged"):
        read_trajectory(finished)


def test_a_changed_header_is_found_by_its_sum(finished):
    edited(lambda file: file["mpad/cells/radii"].__setitem__(0, 6.0))(finished)
    with pytest.raises(InputError, match="what is written once is damaged"):
        read_trajectory(finished)


def test_a_killed_file_with_a_changed_number_ends_before_it(write, tmp_path):
    with write(tmp_path / "live.h5") as writer:
        data = bytearray(writer.path.read_bytes())
        whole = read_trajectory(writer.path)
    place = data.rindex(whole.positions[5].tobytes())
    data[place] ^= 1
    cut = tmp_path / "cut.h5"
    cut.write_bytes(data)
    found = read_trajectory(cut)
    assert (len(found), len(found.bond_events), found.finished) == (5, 12, False)
    np.testing.assert_array_equal(found.positions, whole.positions[:5])


# In a process of its own, since HDF5 is trusted with the damage: a crash or a hang would be a finding.
FLIP = """
import sys
from pathlib import Path
import numpy as np
from mpad_core.interfaces.errors import InputError
from mpad_core.records.reader import read_trajectory

def agree(found, sound):
    rows, events = len(found), len(found.bond_events)
    assert found.header == sound.header
    assert found.fields == sound.fields
    assert found.bond_events.tobytes() == sound.bond_events[:events].tobytes()
    for name in ("steps", "times", "positions", "orientations", "velocities", "overlaps", "capture_hazards"):
        assert getattr(found, name).tobytes() == getattr(sound, name)[:rows].tobytes(), name
    for name, values in found.observed.items():
        assert values.tobytes() == sound.observed[name][:rows].tobytes(), name
    assert not found.finished or (rows, events) == (len(sound), len(sound.bond_events))

path = Path(sys.argv[1])
data, sound, random, refused = path.read_bytes(), read_trajectory(path), np.random.default_rng(int(sys.argv[2])), 0
for place in random.integers(0, len(data), int(sys.argv[3])):
    flipped = bytearray(data)
    flipped[place] ^= 1 << int(random.integers(8))
    path.write_bytes(flipped)
    try:
        agree(read_trajectory(path), sound)
    except InputError as error:
        assert len(str(error).splitlines()) == 1, str(error)
        refused += 1
print(refused)
"""


def flip(path):
    command = [sys.executable, "-W", "error", "-c", FLIP, str(path), "7", "150"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert 0 < int(done.stdout) < 150


def test_a_flipped_byte_gives_a_refusal_or_the_right_answer(finished):
    flip(finished)


def test_so_it_does_in_a_file_that_was_cut_off(write, tmp_path):
    with write(tmp_path / "live.h5") as writer:
        (tmp_path / "cut.h5").write_bytes(writer.path.read_bytes())
    flip(tmp_path / "cut.h5")
