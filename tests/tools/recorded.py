"""What a trajectory holds, for tests that compare runs bit for bit."""

import h5py
import numpy as np


def datasets(path):
    """Read every dataset of a finished trajectory: its type, its shape, its bytes."""
    found = {}

    def take(name, item):
        if isinstance(item, h5py.Dataset):
            found[name] = (str(item.dtype), item.shape, np.asarray(item[()]).tobytes())

    with h5py.File(path, "r") as file:
        file.visititems(take)
    return found


def assert_same(one, other):
    """Compare two trajectories, every dataset bit for bit."""
    first, second = datasets(one), datasets(other)
    assert first.keys() == second.keys()
    assert not [name for name in first if first[name] != second[name]]
