"""One sub-step: Newton's answer against scipy's, stiffness against differences, and steps that are too long."""

from typing import Any

import numpy as np
import pytest
from attrs import evolve
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from mpad_core.numerics.streams import mixed, uniform
from mpad_core.physics.coupling import lone_cell
from mpad_core.running import assembly, moving
from mpad_core.running.moving import advance, commit, refresh_turns
from mpad_core.running.pulling import add_loads
from mpad_core.running.resisting import is_positive_definite, solve_in_place
from sub_steps import work_for

STIFFNESS, REST, STRENGTH, DECAY = 1e5, 0.03, 500.0, 565.0


class Bench:
    """One sub-step's data, laid out."""

    def __init__(self, machine: Any, state: Any, reach: float = 1.0) -> None:
        problem = machine.problem
        configuration = assembly_configuration(problem, state)
        coupling = machine.coupler.at(configuration, state.mean_loads, None)
        around = machine.rasters.at(state.centres)
        self.system = assembly.system(problem, machine.fixed, state, coupling, reach, around)
        self.bonds = assembly.room_for(machine.fixed, state.bonds, len(state.wall_gaps)).bonds
        self.motion = assembly.motion_of(state)
        self.turns = np.empty((len(state.wall_gaps), 3, 3))
        refresh_turns(self.motion, self.turns)

    def loads(self, group: int, moved: Any) -> tuple[Any, Any]:
        """Give loads and stiffness of a group displaced and turned."""
        work = work_for(group, self.system, self.motion, self.turns)
        work.moved[:] = moved
        add_loads(group, self.system, self.bonds, self.motion, self.turns, work)
        return work.load, work.stiffness

    def advance(self, dt: float, group: int = 0) -> float:
        """Try to move a group, and let it be there if it can; give the error."""
        work = work_for(group, self.system, self.motion, self.turns)
        error = float(advance(group, dt, self.system, self.bonds, self.motion, self.turns, work))
        if error < np.inf:
            commit(group, dt, self.system.groups, self.motion, self.turns, work)
        return error


def assembly_configuration(problem: Any, state: Any) -> Any:
    from mpad_core.running.march import configuration_of

    return configuration_of(problem, state)


def arms(directions: Any, shell: float = 5.175) -> Any:
    d = np.asarray(directions, float)
    return shell * d / np.linalg.norm(d, axis=1)[:, None]


@pytest.fixture(scope="module")
def rolling(lab: Any) -> Any:
    """One heavy cell in shear, close to the wall, with a slack bond and three taut ones."""
    made = lab.machine(
        {"a": 'height = "5.232 um"'}, shear=80.0, excess=50.0, repulsion=True, bond={"on_rate": 0, "off_rate": 0}
    )
    machine = lab.with_molecules(made, [arms([[0, 0, -1], [0.02, 0, -1], [-0.05, 0.01, -1], [0.04, -0.06, -1]])])
    arm = machine.fixed.molecules.arm
    under = machine.problem.start[0] + arm
    anchors = under + np.array([[0, 0, 0], [-0.0295, 0, 0], [-0.04, 0.01, 0], [0, -0.05, 0]])
    anchors[:, 2] = 0.05
    return machine, lab.bound(machine, range(4), anchors)


def balance(velocity: Any, dt: float, machine: Any, state: Any) -> Any:
    """Force and torque on the lone cell at the sub-step's end; the fluid's at its start. Closed forms only."""
    problem = machine.problem
    height, gap = float(state.centres[0, 2]), float(state.wall_gaps[0])
    resistance, ambient = lone_cell(problem.setting, 5.0, height, gap)
    total = ambient + problem.external[0] - resistance @ velocity
    turn = Rotation.from_rotvec(dt * velocity[3:])
    centre = state.centres[0] + dt * velocity[:3]
    if problem.contact is not None:
        tip = centre[2] - 5.175 - 0.05
        total[2] += STRENGTH * DECAY / np.expm1(DECAY * tip)
    for site, anchor in zip(state.bonds.site, state.bonds.anchor, strict=True):
        arm = turn.apply(machine.fixed.molecules.arm[site])
        along = centre + arm - anchor
        length = np.linalg.norm(along)
        force = -STIFFNESS * max(length - REST, 0) * along / length
        total[:3] += force
        total[3:] += np.cross(arm, force)
    return total


@pytest.mark.parametrize("dt", [1e-7, 1e-5, 2e-4])
def test_newton_balances_all_loads(rolling: Any, dt: float) -> None:
    """Against scipy's root of the same balance in closed form: tables are good to 1e-6, their loads cancel to 1e-2."""
    machine, state = rolling
    lengths, _ = machine.lengths_and_tensions(state)
    assert (lengths < REST).any()
    assert (lengths > REST).sum() >= 2
    bench = Bench(machine, state)
    assert bench.advance(dt) < np.inf
    found = bench.motion.velocity[0]
    scale = np.array([1, 1, 1, 5, 5, 5.0])
    solved = root(lambda v: balance(v / scale, dt, machine, state) / scale, np.zeros(6), tol=1e-13, method="hybr")
    expected = solved.x / scale
    assert np.abs(balance(expected, dt, machine, state)).max() < 1e-6
    close = 1e-4 * np.abs(expected * scale).max() + 2e-8 / dt  # Newton ends at steps of 1e-8 µm
    assert np.abs((found - expected) * scale).max() < close
    assert bench.motion.centre[0] == pytest.approx(state.centres[0] + dt * found[:3], abs=1e-15)
    assert bench.motion.gap[0] == pytest.approx(state.wall_gaps[0] + dt * found[2], abs=1e-15)


def test_impulse_is_the_loads_times_the_time(rolling: Any) -> None:
    machine, state = rolling
    bench = Bench(machine, state)
    dt = 1e-5
    assert bench.advance(dt) < np.inf
    height, gap = float(state.centres[0, 2]), float(state.wall_gaps[0])
    resistance, ambient = lone_cell(machine.problem.setting, 5.0, height, gap)
    others = resistance @ bench.motion.velocity[0] - ambient
    # a step of 1e-8 µm, where Newton ends, changes the loads by 1e-8 of the stiffness: 4e-3 pN
    assert bench.motion.impulse[0] / dt == pytest.approx(others, abs=0.05)


def differences(bench: Bench, group: int, size: int, step: float = 1e-7) -> Any:
    """Minus the derivative of the loads by displacement and turn, by central differences."""
    matrix = np.zeros((size, size))
    for k in range(size):
        moved = np.zeros(size)
        moved[k] = step
        matrix[:, k] = (bench.loads(group, -moved)[0] - bench.loads(group, moved)[0]) / (2 * step)
    return matrix


def test_stiffness_of_bonds_and_wall_contact(rolling: Any) -> None:
    machine, state = rolling
    bench = Bench(machine, state)
    stiffness = bench.loads(0, np.zeros(6))[1]
    expected = differences(bench, 0, 6)
    scale = np.sqrt(np.abs(np.diag(expected)))
    assert np.abs((stiffness - expected) / np.outer(scale, scale)).max() < 1e-5


@pytest.mark.parametrize("held", [None, 0, 1])
def test_stiffness_and_third_law_of_pair_contact(lab: Any, held: int | None) -> None:
    """Three cells whose bumps touch: tip gaps of 4 and 6 nm."""
    first, second = np.array([1, 0.2, 0.3]), np.array([0.1, 1, -0.2])
    first, second = first / np.linalg.norm(first), second / np.linalg.norm(second)
    places = [np.array([0, 0, 8.0]), np.array([0, 0, 8.0]) + 10.354 * first]
    places.append(places[1] + 10.356 * second)
    cells = {
        name: "\n".join(
            f'{axis} = "{at!r} um"' for axis, at in zip(("x", "y", "height"), map(float, place), strict=True)
        )
        + ("\nheld = true" if i == held else "")
        for i, (name, place) in enumerate(zip("abc", places, strict=True))
    }
    machine = lab.machine(cells, solver="rpb", repulsion=True)
    bench = Bench(machine, lab.start(machine))
    size = 18 if held is None else 12
    load, stiffness = bench.loads(0, np.zeros(size))
    expected = differences(bench, 0, size)
    assert np.abs(stiffness - expected).max() < 1e-4 * np.abs(expected).max()
    push = [STRENGTH * DECAY / np.expm1(DECAY * e) for e in (0.004, 0.006)]
    forces = np.array([-push[0] * first, push[0] * first - push[1] * second, push[1] * second])
    free = [i for i in range(3) if i != held]
    assert load.reshape(-1, 6)[:, :3] == pytest.approx(forces[free], rel=1e-5)
    if held is None:
        assert np.abs(load.reshape(-1, 6)[:, :3].sum(axis=0)).max() < 1e-9 * np.abs(load).max()


def test_pair_contact_between_free_cells_of_no_coupling(lab: Any) -> None:
    """Without coupling two free cells still push each other apart."""
    cells = {"a": 'height = "8 um"', "b": 'x = "10.354 um"\nheight = "8 um"'}
    machine = lab.machine(cells, solver="isolated", repulsion=True)
    state = lab.start(machine)
    after = lab.last(machine, 1e-3, state)
    apart = np.linalg.norm(after.centres[0] - after.centres[1])
    assert apart > 10.354
    assert after.centres.sum(axis=0) == pytest.approx(state.centres.sum(axis=0), abs=1e-9)


@pytest.mark.parametrize("size", [1, 6, 24])
def test_solve_in_place(size: int) -> None:
    rng = np.random.default_rng(size)
    matrix, right = rng.normal(size=(size, size)) * 10 ** rng.uniform(-3, 3, (size, 1)), rng.normal(size=size)
    expected = np.linalg.solve(matrix, right)
    left, answer = matrix.copy(), right.copy()
    solve_in_place(left, answer)
    assert answer == pytest.approx(expected, rel=1e-8 * np.linalg.cond(matrix / matrix.max(axis=1)[:, None]))


def test_solve_in_place_exchanges_rows() -> None:
    matrix, right = np.array([[0.0, 2.0], [4.0, 1.0]]), np.array([2.0, 9.0])
    solve_in_place(matrix, right)
    assert right.tolist() == [2.0, 1.0]


@pytest.mark.parametrize("size", [1, 6, 24])
def test_is_positive_definite(size: int) -> None:
    rng = np.random.default_rng(size)
    for lowest in (1e-6, -1e-6, -1.0):
        basis = np.linalg.qr(rng.normal(size=(size, size)))[0]
        spectrum = np.concatenate([[lowest], rng.uniform(0.1, 10, size - 1)])
        matrix = basis * spectrum @ basis.T
        assert is_positive_definite(0.5 * (matrix + matrix.T)) == (lowest > 0)
    assert not is_positive_definite(np.full((size, size), np.nan))


@pytest.mark.parametrize("height", [5.3, 5.2301])
def test_no_sphere_crosses_the_wall_however_long_the_steps(lab: Any, height: float) -> None:
    """A very heavy cell without repulsion, at sub-steps of 3 and 30 times that in which its gap falls to 1/e.

    After 5 s the gap is e^−270 times the first, still a number.
    """
    problem = lab.problem({"a": f'height = "{height} um"'}, excess=5000.0, shear=80.0)
    chosen = lab.ready(problem).pace.sub_step
    for factor in (100, 1000):
        machine = lab.ready(problem, sub_step=factor * chosen, longest=factor * chosen)
        for state in lab.states(machine, 5.0):
            assert state.wall_gaps[0] > 0
            assert state.centres[0, 2] - 5 == pytest.approx(state.wall_gaps[0], abs=1e-12)


def test_a_step_too_long_is_refused_and_nothing_changes(lab: Any) -> None:
    machine = lab.machine({"a": 'height = "5.1 um"'}, excess=5000.0, shear=80.0)
    bench = Bench(machine, lab.start(machine))
    before = [part.copy() for part in bench.motion]
    assert bench.advance(1.0) == np.inf
    assert all((a == b).all() for a, b in zip(before, bench.motion, strict=True))
    assert bench.advance(1e-6) < np.inf


def test_a_split_sub_step_equals_the_parts(lab: Any) -> None:
    """Rotation at 80/2 rad/s may turn 0.1 rad a part: a sub-step of 4 ms is made of two."""
    problem = lab.problem({"a": 'height = "30 um"'}, shear=80.0)
    long = lab.ready(problem, sub_step=4e-3, longest=4e-3)
    short = lab.ready(problem, sub_step=2e-3, longest=2e-3)
    a, b = lab.last(long, 0.04), lab.last(short, 0.04)
    assert (a.step, b.step) == (40_000, 40_000)  # of 1 µs
    assert a.centres == pytest.approx(b.centres, rel=1e-13)
    assert a.orientations == pytest.approx(b.orientations, abs=1e-13)


def test_without_a_wall_nothing_repels_from_where_none_is(lab: Any) -> None:
    """Repulsion between cells is a law of its own; a scene without a wall has none to be repelled from."""
    machine = lab.machine({"a": 'height = "0 um"', "b": 'x = "40 um"\nheight = "5.2 um"'}, wall=False, repulsion=True)
    after = lab.last(machine, 0.02)
    assert after.centres == pytest.approx(machine.problem.start, abs=1e-12)


def test_a_move_that_is_no_number_is_not_small() -> None:
    """Newton must not take a step of NaN for convergence."""
    radii = np.ones(1)
    assert not moving._surface_move(np.array([np.nan, 0, 0, 0, 0, 0.0]), 1.0, radii) < moving._CLOSE


def test_draws_of_different_purposes_are_apart(lab: Any) -> None:
    """A molecule's draws for rupture and formation in one sub-step are not the same number."""
    machine = lab.machine({"a": 'overlap = "-20 nm"'}, bond={})
    who = mixed(machine.fixed.molecules.owner[0], 5)
    assert uniform(machine.fixed.key, 1, who, 7) != uniform(machine.fixed.key, 2, who, 7)


def test_a_cell_pressed_into_the_wall_layer_is_pushed_out(lab: Any) -> None:
    """The law goes on by its tangent below 1 nm of tip gap, also below zero."""
    problem = evolve(lab.problem({"a": 'height = "5.22 um"'}, repulsion=True))
    after = lab.last(lab.ready(problem), 0.05)
    assert after.wall_gaps[0] > 0.225
