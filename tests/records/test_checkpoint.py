import os
import zipfile

import numpy as np
import pytest

from mpad_core.interfaces.errors import InputError
from mpad_core.records.checkpoint import FORMAT_ENTRY, read_checkpoint, write_checkpoint


@pytest.fixture
def path(tmp_path):
    return tmp_path / "checkpoint.npz"


ARRAYS = {
    "positions": np.random.default_rng(1).normal(size=(4, 3)),
    "step": np.array(7),
    "file": np.array("a name that numpy's savez takes for itself"),
    "bonds": np.array([(1, 2.5)], dtype=[("cell", "i4"), ("length", "f8")]),
    "nothing": np.empty((0, 6)),
    "columns": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
    "odd": np.array([np.nan, -0.0, np.inf, 5e-324]),
}


def test_all_arrays_come_back_bit_for_bit(path):
    write_checkpoint(path, ARRAYS)
    found = read_checkpoint(path)
    assert found.keys() == ARRAYS.keys()
    for name, values in ARRAYS.items():
        assert found[name].dtype == values.dtype
        assert found[name].shape == values.shape
        assert found[name].tobytes() == values.tobytes()


def test_equal_states_give_equal_files(path, tmp_path):
    write_checkpoint(path, ARRAYS)
    write_checkpoint(tmp_path / "other.npz", ARRAYS)
    assert path.read_bytes() == (tmp_path / "other.npz").read_bytes()


def test_numpy_alone_can_read_it(path):
    write_checkpoint(path, ARRAYS)
    with np.load(path, allow_pickle=False) as found:
        assert found[FORMAT_ENTRY] == 1
        np.testing.assert_array_equal(found["positions"], ARRAYS["positions"])


@pytest.mark.parametrize("failing", ["os.fsync", "os.replace"])
def test_until_the_new_one_is_whole_the_old_one_stands(failing, path, monkeypatch):
    write_checkpoint(path, {"step": np.array(1)})

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(failing, interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_checkpoint(path, {"step": np.array(2)})
    assert int(read_checkpoint(path)["step"]) == 1
    assert os.listdir(path.parent) == [path.name]


def test_what_a_killed_writer_left_behind_is_no_hindrance(path):
    path.with_name("checkpoint.npz.tmp").write_bytes(b"half a check")
    write_checkpoint(path, {"step": np.array(2)})
    assert int(read_checkpoint(path)["step"]) == 2
    assert os.listdir(path.parent) == [path.name]


def test_python_objects_are_never_pickled(path):
    with pytest.raises(ValueError, match="Object arrays cannot be saved"):
        write_checkpoint(path, {"x": np.array([object()])})
    with pytest.raises(ValueError, match="the name is taken"):
        write_checkpoint(path, {FORMAT_ENTRY: np.array(1)})
    assert not os.listdir(path.parent)


class Trap:
    def __reduce__(self):
        return os.mkdir, ("trapped",)


def _pickled(path):
    np.savez(path, **{FORMAT_ENTRY: np.array(1), "x": np.array([Trap()], dtype=object)})


def _truncated(path):
    write_checkpoint(path, ARRAYS)
    path.write_bytes(path.read_bytes()[:-40])


def _flipped(path):
    write_checkpoint(path, ARRAYS)
    data = bytearray(path.read_bytes())
    data[data.index(ARRAYS["positions"].tobytes()) + 5] ^= 1
    path.write_bytes(data)


def _boasting(path):
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000000,), }"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("x.npy", b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header)


def _compressed(path):
    np.savez_compressed(path, **{FORMAT_ENTRY: np.array(1), "x": np.zeros(10**6)})


@pytest.mark.parametrize(
    ("make", "fault"),
    [
        (lambda path: None, "no checkpoint here"),
        (lambda path: path.mkdir(), "no checkpoint here"),
        (lambda path: path.write_bytes(b""), "damaged or not a checkpoint"),
        (lambda path: path.write_text("step = 7\n"), "damaged or not a checkpoint"),
        (lambda path: np.savez(path, step=7), "not an mpad checkpoint"),
        (lambda path: np.savez(path, **{FORMAT_ENTRY: np.array(99)}), "has format 99, this mpad reads up to 1"),
        (_pickled, "Object arrays cannot be loaded"),
        (_truncated, "damaged or not a checkpoint"),
        (_flipped, "Bad CRC-32"),
        (_boasting, "damaged or not a checkpoint"),
        (_compressed, "is compressed"),
    ],
)
def test_what_is_no_checkpoint_is_refused_in_one_line(make, fault, path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make(path)
    with pytest.raises(InputError, match=fault) as refused:
        read_checkpoint(path)
    assert len(str(refused.value).splitlines()) == 1
    assert str(refused.value).startswith(f"{path}: ")
    assert not (tmp_path / "trapped").exists()


def test_no_flipped_byte_gives_a_wrong_answer(path):
    write_checkpoint(path, {"x": np.arange(5.0)})
    sound, random = path.read_bytes(), np.random.default_rng(5)
    for place, bit in zip(random.integers(0, len(sound), 300), random.integers(0, 8, 300), strict=True):
        data = bytearray(sound)
        data[place] ^= 1 << bit
        path.write_bytes(data)
        try:
            found = read_checkpoint(path)
        except InputError:
            continue
        if "x" in found:
            np.testing.assert_array_equal(found["x"], np.arange(5.0))
