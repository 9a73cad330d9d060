import importlib.util
from pathlib import Path

import h5py
import numpy as np
import pytest

from mpad_core.records.hdf5 import TrajectoryWriter

TOY = Path(__file__).with_name("toy_run.py")


@pytest.fixture(scope="session")
def toy():
    spec = importlib.util.spec_from_file_location("toy_run", TOY)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def write(toy):
    """Write a toy trajectory of some frames, and leave its writer open."""

    def written(path, steps=9, **changes):
        writer = TrajectoryWriter.create(path, toy.header(**changes), toy.FIELDS, reserve=0)
        state = np.arange(3.0 * toy.CELLS).reshape(toy.CELLS, 3)
        for step in range(steps):
            writer.append(toy.frame(step, state), toy.values(step))
            writer.append_events(toy.events(step))
            state = toy.moved(state, step)
        writer.flush()
        return writer

    return written


@pytest.fixture
def finished(write, tmp_path):
    path = tmp_path / "trajectory.h5"
    write(path).close()
    return path


def _items(path):
    found = {}
    with h5py.File(path, "r") as file:
        file.visititems(lambda name, item: found.__setitem__(name, _content(item)))
    return found


def _content(item):
    attributes = {name: np.asarray(value).tolist() for name, value in item.attrs.items()}
    if not isinstance(item, h5py.Dataset):
        return attributes
    return attributes, str(item.dtype), item.shape, item[()].tobytes()


@pytest.fixture(scope="session")
def assert_same():
    """Hold two finished files against each other, bit for bit, attributes and all."""

    def compare(one, other):
        first, second = _items(one), _items(other)
        assert first.keys() == second.keys()
        different = [name for name in first if first[name] != second[name]]
        assert not different

    return compare
