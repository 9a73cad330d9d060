"""Whole marches against what is known exactly: free motion, settling, tethers, symmetry, reversal."""

from itertools import pairwise
from typing import Any

import numba
import numpy as np
import pytest
from attrs import evolve
from scipy.integrate import quad
from scipy.optimize import brentq, least_squares
from scipy.spatial.transform import Rotation

from mpad_core.interfaces.errors import RefusedError
from mpad_core.numerics.wall_functions import FPERP, wall_functions_array
from mpad_core.physics.coupling import lone_cell, lone_velocity
from mpad_core.physics.state import from_arrays, to_arrays
from mpad_core.running import march as marching
from mpad_core.running.scenes import states

PASSING = {"held": 'height = "5.4 um"\nheld = true', "free": 'x = "-12 um"\ny = "3 um"\nheight = "6 um"'}


@pytest.mark.parametrize("solver", ["isolated", "rpb"])
@pytest.mark.parametrize("height", [5.01, 5.235, 9.0, 400.0])
def test_a_lone_neutral_cell_goes_with_the_free_stream(lab: Any, solver: str, height: float) -> None:
    machine = lab.machine({"a": f'height = "{height} um"'}, shear=80.0, solver=solver)
    last = lab.last(machine, 0.05)
    resistance, load = lone_cell(machine.problem.setting, 5.0, height, height - 5.0)
    velocity = np.linalg.solve(resistance, load)
    assert last.centres[0] == pytest.approx([velocity[0] * last.time, 0, height], rel=1e-9, abs=1e-9)
    turn = Rotation.from_rotvec([0, velocity[4] * last.time, 0]).as_quat(scalar_first=True)
    assert abs(last.orientations[0] @ turn) == pytest.approx(1, abs=1e-12)
    assert last.drift[0] == pytest.approx(velocity, rel=1e-9, abs=1e-7)
    assert lone_velocity(machine.problem.setting, 5.0, height, height - 5.0) == pytest.approx(velocity[0])


def test_the_paper_speed_at_the_reactive_height(lab: Any) -> None:
    """U / γz = 0.665688 at z = 5.255 µm: target T1 of the physics notes."""
    last = lab.last(lab.machine({"a": 'height = "5.255 um"'}, shear=80.0), 0.1)
    assert last.centres[0, 0] / last.time / (80 * 5.255) == pytest.approx(0.665688, abs=1e-6)


def test_an_unbounded_cell_goes_with_the_flow_at_its_centre(lab: Any) -> None:
    for solver in ("isolated", "rpb"):
        last = lab.last(lab.machine({"a": 'height = "-7 um"'}, shear=80.0, wall=False, solver=solver), 0.01)
        assert last.centres[0] == pytest.approx([-7 * 80 * last.time, 0, -7], rel=1e-9)


def settled(drop: tuple[float, float], weight: float) -> float:
    """The time to fall from one gap to another: ∫ ζ dz / W."""

    def drag(gap: float) -> float:
        return float(6 * np.pi * 1e-3 * 5 * wall_functions_array(np.array([gap / 5]))[0, FPERP])

    return float(quad(drag, drop[1], drop[0], epsrel=1e-10)[0] / weight)


@pytest.mark.parametrize("position", [1e-4, 1e-5])
def test_settling_follows_the_integral_of_the_drag(lab: Any, position: float) -> None:
    machine = lab.machine({"a": 'height = "6 um"'}, excess=50.0, position=position)
    weight = -machine.problem.external[0, 2]
    assert weight == pytest.approx(4 / 3 * np.pi * 125 * 50e-12 * 9.81e6)
    assert settled((1.0, 0.255), weight) == pytest.approx(2.90, abs=0.005)  # the physics notes, section 3, item 7
    last = lab.last(machine, 1.5)
    gap = brentq(lambda g: settled((1.0, g), weight) - last.time, 0.1, 0.999, xtol=1e-12)
    assert abs(last.wall_gaps[0] - gap) < position
    fallen = settled((1.0, float(last.wall_gaps[0])), weight)
    assert fallen == pytest.approx(last.time, rel=1e-4)


def test_settling_through_a_solver_that_couples(lab: Any) -> None:
    machine = lab.machine({"a": 'height = "6 um"'}, excess=50.0, solver="rpb", position=1e-5)
    last = lab.last(machine, 0.3)
    weight = -machine.problem.external[0, 2]
    assert settled((1.0, float(last.wall_gaps[0])), weight) == pytest.approx(last.time, rel=1e-4)


def test_a_tethered_cell_comes_to_the_balance_of_loads(lab: Any) -> None:
    """One unbreakable bond in shear; force and torque vanish at the root of the balance, found on its own."""
    made = lab.machine(
        {"a": 'height = "5.24 um"'}, shear=80.0, excess=50.0, repulsion=True,
        bond={"on_rate": 0, "off_rate": 0, "compliance": 0},
    )  # fmt: skip
    machine = lab.with_molecules(made, [5.175 * np.array([[0.0, 0.0, -1.0]])])
    last = lab.last(machine, 1.0, lab.bound(machine, [0], [[0.0, 0.0, 0.05]]))
    assert np.abs(last.velocities[0, :3]).max() < 1e-5
    weight = machine.problem.external[0, 2]

    def balance(unknown: Any) -> Any:
        x, z, angle = unknown[0], unknown[1], unknown[2]
        _, load = lone_cell(machine.problem.setting, 5.0, z, z - 5.0)
        arm = 5.175 * np.array([-np.sin(angle), 0, -np.cos(angle)])
        along = np.array([x, 0, z]) + arm - [0, 0, 0.05]
        length = np.linalg.norm(along)
        pull = -1e5 * (length - 0.03) * along / length
        push = 500 * 565 / np.expm1(565 * (z - 5.225))
        torque = load[4] + np.cross(arm, pull)[1]
        return [load[0] + pull[0], weight + push + pull[2], torque / 5]

    # a first guess from lever arms: the tether is tilted by sqrt(2 L / a), the cell lies a lever downstream
    solved = least_squares(balance, [0.55, 5.2285, 0.10], x_scale=[0.1, 1e-3, 0.01], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert np.abs(solved.fun).max() < 1e-6
    x, z, angle = solved.x
    assert last.centres[0] == pytest.approx([x, 0, z], abs=1e-6)
    length, tension = machine.lengths_and_tensions(last)
    arm = 5.175 * np.array([-np.sin(angle), 0, -np.cos(angle)])
    expected = np.linalg.norm(np.array([x, 0, z]) + arm - [0, 0, 0.05])
    assert length[0] == pytest.approx(expected, rel=1e-6)
    assert tension[0] == pytest.approx(1e5 * (expected - 0.03), rel=1e-4)
    assert tension[0] > 500  # about 1 nN, target T16


def test_a_fall_onto_the_repulsion_ends_where_it_carries_the_weight(lab: Any) -> None:
    machine = lab.machine({"a": 'height = "5.26 um"'}, excess=50.0, repulsion=True)
    last = lab.last(machine, 3.0)
    weight = -machine.problem.external[0, 2]
    tip = np.log1p(500 * 565 / weight) / 565
    assert last.wall_gaps[0] - 0.225 == pytest.approx(tip, abs=2e-6)


def test_no_on_rate_is_no_bonds_bit_for_bit(lab: Any, same: Any) -> None:
    words: dict[str, Any] = {"shear": 80.0, "excess": 50.0, "solver": "rpb", "repulsion": True}
    with_bonds = lab.states(lab.machine(PASSING, bond={"on_rate": 0}, **words), 0.02)
    without = lab.states(lab.machine(PASSING, **words), 0.02)
    assert len(with_bonds) == len(without)
    assert all(same(a, b) for a, b in zip(with_bonds, without, strict=True))


@pytest.mark.parametrize("solver", ["rpb", "isolated"])
def test_mirror_images_have_mirror_paths(lab: Any, solver: str) -> None:
    words: dict[str, Any] = {"shear": 80.0, "excess": 50.0, "solver": solver, "repulsion": True}
    mirrored = {name: keys.replace('y = "3', 'y = "-3') for name, keys in PASSING.items()}
    a = lab.last(lab.machine(PASSING, **words), 0.06)
    b = lab.last(lab.machine(mirrored, **words), 0.06)
    assert a.step == b.step
    assert b.centres == pytest.approx(a.centres * [1, -1, 1], abs=1e-9)
    assert b.drift == pytest.approx(a.drift * [1, -1, 1, -1, 1, -1], abs=1e-5)


def test_two_free_cells_are_equal_before_the_law(lab: Any) -> None:
    """The cells' order in the scene does not matter."""
    cells = {"a": 'height = "5.6 um"', "b": 'x = "-12 um"\ny = "3 um"\nheight = "9 um"'}
    words: dict[str, Any] = {"shear": 80.0, "excess": 50.0, "solver": "rpb", "repulsion": True}
    a = lab.last(lab.machine(cells, **words), 0.05)
    b = lab.last(lab.machine(dict(reversed(cells.items())), **words), 0.05)
    assert b.centres[::-1] == pytest.approx(a.centres, abs=1e-9)


@pytest.mark.parametrize("how", ["held", "free"])
@pytest.mark.parametrize("solver", ["isolated", "rpb"])
def test_bumps_never_pass_through_each_other(lab: Any, solver: str, how: str) -> None:
    """Head on, at the pace that the run chooses: the repulsion at a tip gap of 1 nm is 0.37 µN."""
    other = 'x = "0 um"\ny = "1 um"\nheight = "6 um"' + ("\nheld = true" if how == "held" else "")
    cells = {"fast": 'x = "-12 um"\nheight = "9 um"', "slow": other}
    least = np.inf
    for state in lab.states(lab.machine(cells, shear=100.0, repulsion=True, solver=solver), 0.12):
        least = min(least, np.linalg.norm(state.centres[0] - state.centres[1]) - 10.35)
    assert 0 < least < 0.1


@pytest.fixture(scope="module")
def reversed_path(lab: Any) -> tuple[Any, Any]:
    """A neutral cell past a held one, without contact: Stokes flow runs backward as it runs forward."""
    cells = {"held": 'height = "5.4 um"\nheld = true', "free": 'x = "-30 um"\ny = "8 um"\nheight = "6 um"'}
    machine = lab.machine(cells, shear=80.0, solver="rpb")
    path = [(s.centres[1, 0], *s.centres[1, 1:]) for s in lab.states(machine, 0.2)]
    return machine, np.array(path)


def test_a_passage_is_the_same_backward(reversed_path: Any) -> None:
    machine, path = reversed_path
    assert path[-1, 0] > 30
    tolerance = 10 * machine.problem.tolerances.position
    x = np.linspace(0.5, 30, 60)
    for column in (1, 2):
        before, after = (np.interp(at, path[:, 0], path[:, column]) for at in (-x, x))
        assert np.abs(before - after).max() < tolerance
    assert np.interp(30, path[:, 0], path[:, 2]) == pytest.approx(6.0, abs=tolerance)


def test_a_neutral_cell_rises_past_a_held_one(reversed_path: Any) -> None:
    """The notes, section 2: up at every dx < 0, down at every dx > 0, never below its start."""
    _, path = reversed_path
    height = path[:, 2]
    top = int(np.argmax(height))
    assert abs(path[top, 0]) < 1
    assert height[top] > 6.01
    assert (np.diff(height[:top]) > -1e-9).all()
    assert (np.diff(height[top:]) < 1e-9).all()


def test_halving_the_tolerance_changes_less_than_it_allows(lab: Any) -> None:
    cells = {"held": 'height = "5.4 um"\nheld = true', "free": 'x = "-20 um"\ny = "8 um"\nheight = "6 um"'}
    position, heights = 1e-3, []
    dx = np.linspace(-18, 18, 100)
    for asked in (position, position / 2):
        machine = lab.machine(cells, shear=80.0, excess=50.0, solver="rpb", position=asked)
        path = np.array([s.centres[1] for s in lab.states(machine, 0.13)])
        heights.append(np.interp(dx, path[:, 0], path[:, 2]))
        assert path[-1, 0] > 18
    assert 0 < np.abs(heights[0] - heights[1]).max() < 3 * position


ROLLING: dict[str, Any] = {"shear": 80.0, "excess": 50.0, "repulsion": True, "bond": {}, "rate": 1e-2}


def test_a_state_goes_through_arrays_and_on(lab: Any, same: Any) -> None:
    cells = {"a": 'overlap = "-20 nm"', "b": 'x = "-14 um"\ny = "2 um"\nheight = "6 um"'}
    machine = lab.machine(cells, solver="rpb", **ROLLING)
    whole = lab.states(machine, 0.02)
    assert len(whole[-1].bonds) > 5
    middle = len(whole) // 2
    stored = {name: np.array(value) for name, value in to_arrays(whole[middle]).items()}
    again = lab.machine(cells, solver="rpb", **ROLLING)
    rest = lab.states(again, 0.02, from_arrays(stored, 2, len(again.fixed.molecules.kind)))
    assert len(rest) == len(whole) - middle
    assert all(same(a, b) for a, b in zip(rest, whole[middle:], strict=True))
    assert all((a.events == b.events).all() for a, b in zip(rest[1:], whole[middle + 1 :], strict=True))


def test_the_number_of_threads_does_not_matter(lab: Any, same: Any) -> None:
    cells = {"a": 'overlap = "-20 nm"', "b": 'x = "-14 um"\ny = "2 um"\nheight = "6 um"'}
    machine = lab.machine(cells, solver="rpb", **ROLLING)
    ends = []
    for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        before = numba.get_num_threads()
        numba.set_num_threads(threads)
        ends.append(lab.last(machine, 0.01))
        numba.set_num_threads(before)
    assert same(*ends)


def test_the_march_ends_at_the_time_asked_for(lab: Any) -> None:
    """To half a sub-step, which is what the clock can tell."""
    machine = lab.machine({"a": 'height = "6 um"'}, shear=80.0)
    for until in (0.01, 0.0123, 0.02003, 7.1 * machine.pace.sub_step, 0.4 * machine.pace.sub_step):
        last = lab.last(machine, until)
        assert abs(last.time - until) <= 0.5 * machine.pace.sub_step * (1 + 1e-9)


def test_mean_loads_of_a_settling_cell_are_its_weight(lab: Any) -> None:
    machine = lab.machine({"a": 'height = "6 um"'}, excess=50.0)
    last = lab.last(machine, 0.02)
    assert last.mean_loads == pytest.approx(machine.problem.external)


def test_a_held_cell_stays(lab: Any) -> None:
    last = lab.last(lab.machine(PASSING, shear=80.0, excess=50.0, solver="rpb", repulsion=True), 0.02)
    assert (last.centres[0] == [0, 0, 5.4]).all()
    assert (last.drift[0] == 0).all()
    assert (last.orientations[0] == [1, 0, 0, 0]).all()


@pytest.mark.parametrize("solver", ["isolated", "rpb"])
def test_nothing_moves_where_all_are_held(lab: Any, solver: str) -> None:
    cells = {"a": 'height = "6 um"\nheld = true', "b": 'x = "12 um"\nheight = "6 um"\nheld = true'}
    last = lab.last(lab.machine(cells, shear=80.0, solver=solver), 0.01)
    assert last.time == pytest.approx(0.01)
    assert last.centres[:, 0].tolist() == [0, 12]


def test_gap_and_height_stay_together(lab: Any) -> None:
    last = lab.last(lab.machine({"a": 'overlap = "-20 nm"'}, **ROLLING), 0.2)
    assert last.centres[0, 2] - 5 == pytest.approx(last.wall_gaps[0], abs=1e-10)
    assert np.linalg.norm(last.orientations[0]) == pytest.approx(1, abs=1e-12)


def test_drift_is_displacement_and_turn_over_the_outer_step(lab: Any) -> None:
    """Of a rolling cell, whose velocity changes at every bond's birth and death."""
    marched = lab.states(lab.machine({"a": 'overlap = "-20 nm"'}, **ROLLING), 0.05)
    for before, after in pairwise(marched[5:]):
        lasted = after.time - before.time
        assert after.drift[0, :3] * lasted == pytest.approx(after.centres[0] - before.centres[0], abs=1e-12)
        turn = Rotation.from_quat(after.orientations[0], scalar_first=True)
        turn = turn * Rotation.from_quat(before.orientations[0], scalar_first=True).inv()
        vector = turn.as_rotvec()  # turns do not add up like vectors, by the square of the whole turn
        assert after.drift[0, 3:] * lasted == pytest.approx(vector, abs=0.5 * vector @ vector + 1e-9)


def test_states_of_a_scene(lab: Any, same: Any) -> None:
    scene = lab.scene({"a": 'overlap = "-20 nm"'}, stop='time = "4 ms"', **ROLLING)
    first, again, other = (list(states(scene, replicate=r)) for r in (0, 0, 1))
    assert first[0].time == 0
    assert first[-1].time == pytest.approx(4e-3, abs=1e-4)
    assert same(first[-1], again[-1])
    assert not same(first[-1], other[-1])


def test_a_cell_that_first_rolls_alone_comes_back_with_its_bonds(lab: Any) -> None:
    cells = {
        "probe": 'x = "-20 um"\noverlap = "0 nm"\nbinds = false',
        "roller": 'x = "3 um"\ny = "-1 um"\noverlap = "-20 nm"\nstart = { rolling_alone = "30 ms" }',
    }
    machine = lab.machine(cells, **ROLLING)
    state = lab.start(machine)
    assert state.centres[1, :2].tolist() == [3, -1]
    assert state.bond_counts()[0] == 0
    assert state.bond_counts()[1] > 5
    assert (state.time, state.step) == (0.0, state.zero)
    assert state.zero > 0
    assert state.caught_since[1] in (0.0, np.inf)
    lengths, tensions = machine.lengths_and_tensions(state)
    assert lengths.max() < 0.06  # the bonds moved with their cell
    assert (tensions >= 0).all()
    alone = lab.machine({"roller": cells["roller"]}, **ROLLING)
    lone = lab.start(alone)
    assert (lone.centres[0] == state.centres[1]).all()
    assert (alone.lengths_and_tensions(lone)[0] == lengths).all()
    following = lab.last(machine, 2e-3, state)
    assert following.time == pytest.approx(2e-3, abs=1e-4)


def test_a_solver_whose_answer_no_step_can_balance_is_named(lab: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = lab.machine({"a": 'height = "6 um"'}, shear=80.0, solver="rpb")
    state = lab.start(machine)
    monkeypatch.setattr(marching, "burst", lambda *_: (marching.NO_BALANCE, 0))
    with pytest.raises(RefusedError, match=r"step 0, t = 0 s: no sub-step.*a \(gap to the wall 1 um\).*rpb"):
        lab.last(machine, 0.01, state)


def test_a_coupling_that_is_not_definite_is_refused(lab: Any) -> None:
    machine = lab.machine({"a": 'height = "6 um"'}, shear=80.0)
    state = lab.start(machine)
    coupling = machine.coupler.at(marching.configuration_of(machine.problem, state), state.mean_loads, None)
    spoilt = evolve(coupling, matrices=(-np.eye(6),))

    class Spoilt:
        plan = None

        def at(self, *_: Any) -> Any:
            return spoilt

    with pytest.raises(RefusedError, match=r"step 0, t = 0 s: resistance is not positive definite for a"):
        lab.last(evolve(machine, coupler=Spoilt()), 0.01, state)
