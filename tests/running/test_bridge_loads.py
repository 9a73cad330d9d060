"""What a bond between cells does to both: its loads by formula, Newton's third law, its stiffness by differences."""

from typing import Any

import numpy as np
import pytest
from attrs import evolve
from scipy.spatial.transform import Rotation

from bridged import SHELL, bond_loads, bonded, matrices_of, problem_of, with_molecules
from mpad_core.physics.coupling import Coupling, contact_range, joined
from mpad_core.running import assembly
from mpad_core.running.layout import Work
from mpad_core.running.march import configuration_of, make_ready
from mpad_core.running.pulling import add_loads


class Bench:
    """The loads of the first group of cells and their stiffness, displaced and turned as one likes."""

    def __init__(self, machine: Any, state: Any) -> None:
        problem, fixed = machine.problem, machine.fixed
        coupling = machine.coupler.at(configuration_of(problem, state), state.mean_loads, None)
        coupling = joined(coupling, state.bonds.pairs())
        around = machine.rasters.at(state.centres)
        self.system = assembly.system(problem, fixed, state, coupling, contact_range(problem), around)
        self.motion, self.cells = assembly.motion_of(state), coupling.groups[0]
        self.bonds = assembly.room_for(fixed, state.bonds, len(problem.radii)).bonds
        turn, m = matrices_of(state), 6 * len(self.cells)
        vectors = [np.zeros(m) for _ in range(6)]
        poses = state.orientations.copy(), np.zeros_like(state.centres), turn.copy()
        self.turn = turn
        self.work = Work(
            problem.radii[self.cells], np.zeros((m, m)), np.zeros((m, m)), *vectors, np.zeros(m), np.zeros(8),
            np.zeros(m), np.zeros(m), state.wall_gaps.copy(), state.centres.copy(), *poses,
        )  # fmt: skip

    def loads(self, moved: Any) -> tuple[Any, Any]:
        self.work.moved[:] = moved
        add_loads(0, self.system, self.bonds, self.motion, self.turn, self.work)
        return self.work.load.copy(), self.work.stiffness.copy()


def random_pose(rng: Any, held: Any = ()) -> tuple[Any, Any]:
    """Three cells in a chain at random, each bound to the next by three bonds of 5 to 90 nm."""
    turns = Rotation.random(3, rng=rng)
    way = rng.normal(size=(2, 3))
    way *= (10.36 / np.linalg.norm(way, axis=1))[:, None]
    centres = np.array([[0.0, 0.0, 60.0], 60 * np.eye(3)[2] + way[0], 60 * np.eye(3)[2] + way[0] + way[1]])
    if np.linalg.norm(centres[2] - centres[0]) < 10.4:
        return random_pose(rng, held)
    machine = make_ready(problem_of(centres, held=held, on=0, off=0))
    arms: list[list[Any]] = [[], [], []]
    pairs = []
    for i in (0, 1):
        for _ in range(3):
            towards = way[i] / 10.36 + 0.05 * rng.normal(size=3)
            end = SHELL * towards / np.linalg.norm(towards)
            shift = rng.normal(size=3)
            shift *= rng.uniform(0.005, 0.09) / np.linalg.norm(shift)
            pairs.append((i, len(arms[i]), i + 1, len(arms[i + 1])))
            arms[i].append(turns[i].inv().apply(end))
            arms[i + 1].append(turns[i + 1].inv().apply(centres[i] + end + shift - centres[i + 1]))
    machine = with_molecules(machine, [np.array(a) for a in arms], [0, 0, 0])
    first = machine.fixed.molecules.first
    state = bonded(machine, [(first[i] + m, first[j] + n) for i, m, j, n in pairs])
    return machine, evolve(state, orientations=turns.as_quat(scalar_first=True))


def test_loads_of_bonds_between_cells_and_newtons_third_law() -> None:
    rng = np.random.default_rng(5)
    for _ in range(4):
        machine, state = random_pose(rng)
        lengths, tensions = machine.lengths_and_tensions(state)
        assert ((tensions > 0) == (lengths > 0.03)).all()
        bench = Bench(machine, state)
        loads = bench.loads(np.zeros(18))[0].reshape(3, 6)
        assert bench.cells.tolist() == [0, 1, 2]
        expected = bond_loads(machine, state)
        size = np.abs(expected).max()
        assert np.abs(loads - expected).max() < 1e-5 * size  # tables are good to 1e-6
        assert np.abs(loads[:, :3].sum(axis=0)).max() < 1e-12 * size
        about_origin = loads[:, 3:] + np.cross(state.centres, loads[:, :3])
        assert np.abs(about_origin.sum(axis=0)).max() < 1e-11 * size


@pytest.mark.parametrize("held", [(), (0,), (1,), (2,)])
def test_stiffness_of_bonds_between_cells(held: Any) -> None:
    """Against central differences of the loads, all cells moved and turned at once."""
    machine, state = random_pose(np.random.default_rng(8), held)
    bench = Bench(machine, state)
    size = 6 * len(bench.cells)
    stiffness, step = bench.loads(np.zeros(size))[1], 1e-7
    expected = np.zeros((size, size))
    for k in range(size):
        moved = step * (np.arange(size) == k)
        expected[:, k] = (bench.loads(-moved)[0] - bench.loads(moved)[0]) / (2 * step)
    assert set(bench.cells) <= {0, 1, 2} - set(held)
    assert size == (18 if not held else 6 if held == (1,) else 12)
    assert np.abs(stiffness - expected).max() < 1e-5 * np.abs(expected).max()


def test_groups_that_bonds_link_become_one() -> None:
    """In any order; what is held is in no group, and what coupled the cells of each group stays."""
    groups = tuple(np.array(g) for g in ([0, 3], [1], [2, 5]))
    matrices = tuple(np.full((6 * len(g), 6 * len(g)), 1.0 + k) for k, g in enumerate(groups))
    coupling = Coupling(groups=groups, matrices=matrices, loads=np.zeros((6, 6)))
    same = joined(coupling, np.array([[0, 3], [1, 4]]))
    assert [g.tolist() for g in same.groups] == [[0, 3], [1], [2, 5]]
    one = joined(coupling, np.array([[5, 1], [1, 2], [2, 0]]))
    assert sorted(one.groups[0].tolist()) == [0, 1, 2, 3, 5]
    places = one.groups[0].tolist().index
    assert one.matrices[0].shape == (30, 30)
    for i, j, wanted in ((0, 3, 1.0), (1, 1, 2.0), (2, 5, 3.0), (0, 1, 0.0), (3, 5, 0.0), (1, 2, 0.0)):
        o, p = 6 * places(i), 6 * places(j)
        assert (one.matrices[0][o : o + 6, p : p + 6] == wanted).all()
