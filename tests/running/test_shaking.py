"""Thermal motion within a burst: paths, the mean and covariance of a sub-step, independence of what else happens."""

from typing import Any

import numpy as np
import pytest
from attrs import evolve
from scipy.linalg import hadamard

from mpad_core import mobility_matrix
from mpad_core.numerics.streams import key_of
from mpad_core.numerics.wall_functions import wall_drift
from mpad_core.physics import fluctuations
from mpad_core.physics.couplers import NoDrift
from mpad_core.physics.state import from_arrays, to_arrays
from mpad_core.running import assembly
from mpad_core.running.march import configuration_of
from mpad_core.running.moving import advance, refresh_turns
from mpad_core.running.shaking import TICKS, draw, path
from sub_steps import work_for

KT = 0.00411433402  # pN µm, at 298 K
KEY = key_of(5)
PAIR = {"a": 'height = "5.9 um"', "b": 'x = "10.6 um"\ny = "2 um"\nheight = "6.6 um"'}
FREE_AND_HELD = {**PAIR, "c": 'x = "2 um"\ny = "11 um"\nheight = "6 um"\nheld = true'}
FIVE_SIGMA = 5.3  # two-sided: 1.2e-7


def test_paths_are_brownian() -> None:
    ticks = [1, 5, TICKS // 4, TICKS // 4 + 1, 40_000, TICKS - 1, TICKS]
    number = 20_000
    samples = np.array([[path(KEY, 77, 1, step, tick) for tick in ticks] for step in range(number)])
    t = np.array(ticks) / TICKS
    expected = np.minimum(t[:, None], t[None])
    scale = np.sqrt(np.outer(t, t))
    for part in (samples[:, :, 0], samples[:, :, 1]):
        off = (part.T @ part / number - expected) / scale
        assert np.abs(off).max() < FIVE_SIGMA * np.sqrt(2 / number)
    assert abs(np.mean(samples[:, -1, 0] * samples[:, -1, 1])) < FIVE_SIGMA / np.sqrt(number)
    assert path(KEY, 77, 1, 3, 0) == (0.0, 0.0)


class Shaken:
    """One sub-step of a machine from its start, under chosen noise."""

    def __init__(self, machine: Any, state: Any) -> None:
        configuration = configuration_of(machine.problem, state)
        coupling = machine.coupler.at(configuration, state.mean_loads, None)
        coupling = machine.drift.added(coupling, configuration, state.step)
        self.machine, self.state = machine, state
        self.system = assembly.system(
            machine.problem, machine.fixed, state, coupling, -np.inf, machine.rasters.at(state.centres)
        )

    def displacement(self, noise: Any, dt: float) -> Any:
        motion, turn = assembly.motion_of(self.state), np.empty((len(self.state.wall_gaps), 3, 3))
        refresh_turns(motion, turn)
        work = work_for(0, self.system, motion, turn)
        bonds = assembly.room_for(self.machine.fixed, self.state.bonds, len(self.state.wall_gaps)).bonds
        work.noise[:] = noise
        assert advance(0, dt, self.system, bonds, motion, turn, work) < np.inf
        moved = np.hstack([work.centre - self.state.centres, work.rotation])
        return moved[~self.machine.problem.held].ravel()

    def moments(self, dt: float) -> Any:
        """Give mean and covariance over noises that have those of Gaussian noise up to the third moments."""
        m = 6 * int((~self.machine.problem.held).sum())
        far = np.sqrt(m * dt)
        moved = np.array([self.displacement(sign * far * e, dt) for e in np.eye(m) for sign in (1.0, -1.0)])
        return moved.mean(axis=0), moved.T @ moved / len(moved)


@pytest.mark.parametrize("height", [5.002, 5.235, 7.0])
def test_a_lone_cell_drifts_as_its_mobility_changes(lab: Any, height: float) -> None:
    machine = lab.machine({"a": f'height = "{height} um"'}, thermal="on")
    gap = height - 5
    slope = wall_drift(gap, 5.0, 1e-3)
    dt = (1e-3 * gap) ** 2 / (2 * KT * slope * gap)
    mean, covariance = Shaken(machine, lab.start(machine)).moments(dt)
    assert mean / (KT * slope * dt) == pytest.approx([0, 0, 1, 0, 0, 0], abs=1e-4)
    mobility = mobility_matrix(machine.problem.solver, machine.problem.start, 5.0, viscosity=1e-3)
    scale = np.sqrt(np.diag(mobility))
    expected = 2 * KT * dt * mobility
    assert np.abs((covariance - expected) / (2 * KT * dt * np.outer(scale, scale))).max() < 1e-4


def constrained(problem: Any, configuration: Any) -> Any:
    """Give the mobility of the free cells, the others held."""
    full = mobility_matrix(problem.solver, configuration.centres, problem.radii, viscosity=1e-3)
    free = np.repeat(~problem.held, 6)
    return np.linalg.inv(np.linalg.inv(full)[np.ix_(free, free)])


@pytest.mark.parametrize("cells", [PAIR, FREE_AND_HELD], ids=["pair", "with a held cell"])
def test_coupled_cells_drift_by_the_whole_divergence(lab: Any, cells: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A sub-step with the load k_d, averaged over noise and over signs that are orthogonal, moves by kT ∇·M dt."""
    machine = lab.machine(cells, thermal="on", solver="rpb")
    problem, state = machine.problem, lab.start(machine)
    at, free = configuration_of(problem, state), np.flatnonzero(~problem.held)
    expected = np.zeros(6 * len(free))
    for place, cell in enumerate(free):
        for k in range(3):
            shift = np.zeros((len(problem.radii), 3))
            shift[cell, k] = 1e-3
            for times, weight in ((1, 8 / 12), (-1, -8 / 12), (2, -1 / 12), (-2, 1 / 12)):
                expected += weight / 1e-3 * constrained(problem, at.moved(times * shift))[:, 6 * place + k]
    dt = 1e-6
    means, burst_alone = [], Shaken(evolve(machine, drift=NoDrift()), state).moments(dt)[0]
    for signs in hadamard(8)[:, 1:7].reshape(8, 2, 3).astype(float):
        monkeypatch.setattr(fluctuations.CouplingDrift, "_signs", lambda self, group, step, s=signs: s)
        means.append(Shaken(machine, state).moments(dt)[0])
    scale = np.tile(np.repeat([1, 1 / 5], 3), 2) * np.abs(expected).max()
    assert np.abs((np.mean(means, axis=0) / (KT * dt) - expected) / scale).max() < 1e-3
    assert np.abs((burst_alone / (KT * dt) - expected) / scale).max() > 0.05  # k_d is needed


def test_the_coupling_drift_of_a_lone_exact_cell_is_not_asked_for(lab: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = lab.machine({"a": 'height = "5.3 um"'}, thermal="on", solver="rpb")
    monkeypatch.setattr(fluctuations.CouplingDrift, "_missing", None)
    assert lab.last(machine, 2e-3).step > 0
    cool = lab.machine({"a": 'height = "5.3 um"'}, solver="rpb")
    assert isinstance(cool.drift, NoDrift)


def test_increments_over_parts_add_up_to_the_whole(lab: Any) -> None:
    machine = lab.machine(PAIR, thermal="on", solver="rpb")
    shaken = Shaken(machine, lab.start(machine))
    thermal, groups = shaken.system.thermal, shaken.system.groups
    whole, part, total = np.empty(12), np.empty(12), np.zeros(12)
    draw(thermal, 0, groups, KEY, 9, 0, TICKS, 2e-3, whole)
    for first, last in ((0, 7), (7, TICKS // 2), (TICKS // 2, TICKS - 3), (TICKS - 3, TICKS)):
        draw(thermal, 0, groups, KEY, 9, first, last, 2e-3, part)
        total += part
    assert total == pytest.approx(whole, abs=1e-14)
    assert len(set(np.abs(whole))) == 12


def test_a_cell_shakes_the_same_whoever_else_is_there(lab: Any) -> None:
    both = {"a": 'height = "5.4 um"', "b": 'x = "60 um"\nheight = "5.3 um"'}
    alone = lab.states(lab.machine({"a": both["a"]}, thermal="on"), 0.02)
    beside = lab.states(lab.machine(both, thermal="on"), 0.02)
    assert alone[-1].time == beside[-1].time
    assert (alone[-1].centres[0] == beside[-1].centres[0]).all()
    assert np.abs(alone[-1].centres[0] - [0, 0, 5.4]).min() > 1e-4


@pytest.mark.parametrize("solver", ["rpb", "isolated"])
def test_going_on_from_a_stored_state_takes_the_same_steps(lab: Any, same: Any, solver: str) -> None:
    machine = lab.machine(PAIR, thermal="on", solver=solver, shear=80.0, excess=50.0, repulsion=True)
    states = lab.states(machine, 0.02)
    middle = states[len(states) // 2]
    stored = from_arrays(to_arrays(middle), 2, len(machine.fixed.molecules.kind))
    again = lab.states(machine, 0.02, stored)
    assert len(again) == len(states) - len(states) // 2
    assert all(same(a, b) for a, b in zip(again, states[len(states) // 2 :], strict=True))


def test_many_cells_in_several_groups_diffuse(lab: Any) -> None:
    """More cells than are solved together; near each other and the wall they move less than Stokes' law says."""
    places = [(14.0 * (i % 4), 14.0 * (i // 4), 5.5 + 0.4 * i) for i in range(11)]
    cells = {f"c{i}": f'x = "{x} um"\ny = "{y} um"\nheight = "{z} um"' for i, (x, y, z) in enumerate(places)}
    machine = lab.machine(cells, thermal="on", solver="rpb")
    start = lab.start(machine)
    coupling = machine.coupler.at(configuration_of(machine.problem, start), start.mean_loads, None)
    assert len(coupling.groups) > 1
    last = lab.last(machine, 0.02, start)
    normal = (last.centres - start.centres) / np.sqrt(2 * KT / (6 * np.pi * 1e-3 * 5) * last.time)
    assert np.abs(normal).max() < FIVE_SIGMA
    assert 33 * 0.05 < (normal**2).sum() < 33 * 3.0  # χ²: above 1e-8; below 1e-15 were Stokes right, and M is a third


def test_mean_loads_are_without_the_random_ones(lab: Any) -> None:
    machine = lab.machine({"a": 'height = "5.6 um"'}, thermal="on", excess=50.0)
    last = lab.last(machine, 0.01)
    assert last.mean_loads[0] == pytest.approx(machine.problem.external[0], rel=1e-12)


@pytest.mark.parametrize("height", [5.002, 5.01])
def test_no_cell_is_shaken_into_the_wall_however_long_the_steps(lab: Any, height: float) -> None:
    """Sub-steps in which heat carries a cell many gaps far are split."""
    problem = lab.problem({"a": f'height = "{height} um"'}, thermal="on")
    machine = lab.ready(problem, sub_step=1e-3, longest=0.1)
    gaps = np.array([state.wall_gaps[0] for state in lab.states(machine, 0.5)])
    assert (gaps > 0).all()
    assert len(set(gaps)) > 5
