import numpy as np
import pytest

from mpad_core.interfaces.values import BOND_EVENT
from mpad_core.records.hdf5 import TrajectoryWriter
from mpad_core.records.reader import living_bonds, read_trajectory

FORMED, BROKEN, CHANGED = 0, 1, 2


@pytest.fixture
def recorded(toy, tmp_path):
    def recorded(rows):
        events = np.zeros(len(rows), dtype=BOND_EVENT)
        for event, (time, kind, cell, receptor) in zip(events, rows, strict=True):
            event["time"], event["kind"], event["cell"], event["receptor"] = time, kind, cell, receptor
        with TrajectoryWriter.create(tmp_path / "trajectory.h5", toy.header()) as writer:
            writer.append_events(events)
        return read_trajectory(writer.path)

    return recorded


def test_bonds_live_from_forming_to_breaking(recorded):
    trajectory = recorded([(1.0, FORMED, 0, 7), (2.0, FORMED, 1, 7), (3.0, BROKEN, 0, 7), (4.0, FORMED, 0, 7)])
    alive = {time: living_bonds(trajectory, time)["cell"].tolist() for time in (0.5, 1.0, 2.5, 3.0, 9.0)}
    assert alive == {0.5: [], 1.0: [0], 2.5: [0, 1], 3.0: [1], 9.0: [1, 0]}


def test_events_at_one_time_count_in_their_order(recorded):
    trajectory = recorded([(1.0, FORMED, 0, 1), (1.0, BROKEN, 0, 1), (1.0, FORMED, 0, 1), (1.0, FORMED, 0, 2)])
    assert living_bonds(trajectory, 1.0)["receptor"].tolist() == [1, 2]


def test_counts_agree_with_a_plain_replay(recorded):
    random, alive, rows, expected = np.random.default_rng(3), set(), [], {}
    for time in np.arange(400.0):
        bond = (int(random.integers(3)), int(random.integers(20)))
        rows.append((time, BROKEN if bond in alive else FORMED, *bond))
        alive ^= {bond}
        expected[time] = set(alive)
    trajectory = recorded(rows)
    for time in (0.0, 17.0, 250.0, 399.0):
        found = living_bonds(trajectory, time)
        assert {(int(bond["cell"]), int(bond["receptor"])) for bond in found} == expected[time]
        assert (found["kind"] == FORMED).all()


def test_a_living_bond_has_the_state_of_its_last_change(recorded):
    trajectory = recorded([(1.0, FORMED, 0, 7), (2.0, FORMED, 0, 8), (3.0, CHANGED, 0, 7)])
    trajectory.bond_events["state"][2] = 1
    assert living_bonds(trajectory, 2.5)["state"].tolist() == [0, 0]
    assert living_bonds(trajectory, 3.0)["state"].tolist() == [1, 0]
    assert living_bonds(trajectory, 3.0)["time"].tolist() == [1.0, 2.0]
