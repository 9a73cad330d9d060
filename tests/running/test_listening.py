"""Who listens to a march: schedules, frames, stop conditions, captures."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from attrs import evolve

from mpad_core.physics.coupling import lone_velocity
from mpad_core.physics.measures import hazards
from mpad_core.physics.state import State
from mpad_core.running.capturing import with_captures
from mpad_core.running.frames import frame_of, frames
from mpad_core.running.schedules import Cadence, Schedule
from mpad_core.running.stopping import StopWhen, first_that_holds

FREE = {"free": 'height = "6 um"'}
ROLLING: dict[str, Any] = {"shear": 80.0, "excess": 50.0, "repulsion": True, "bond": {"off_rate": 50}, "rate": 1e-2}


@pytest.fixture(scope="module")
def passed(lab: Any) -> tuple[Any, list[Any]]:
    """A free cell in shear: x = V t."""
    machine = lab.machine(FREE, shear=80.0, position=1e-3)
    return machine, lab.states(machine, 0.1)


def recorded(machine: Any, marched: list[Any], **cadence: Any) -> list[Any]:
    schedule = Schedule.starting(Cadence(**cadence), machine.problem, marched[0])
    felt = hazards(machine.problem)
    return [
        frame for before, after in pairwise(marched) for frame in frames(machine.problem, felt, schedule, before, after)
    ]


def test_frames_at_equal_times(passed: Any) -> None:
    machine, marched = passed
    found = recorded(machine, marched, time=0.0007)
    assert [frame.time for frame in found] == pytest.approx(0.0007 * np.arange(1, 143), abs=1e-12)
    speed = marched[-1].centres[0, 0] / marched[-1].time
    for frame in found:
        assert frame.centres[0] == pytest.approx([speed * frame.time, 0, 6.0], abs=1e-9)
        assert np.linalg.norm(frame.orientations[0]) == pytest.approx(1)


def test_frames_at_equal_steps_along_the_flow(passed: Any) -> None:
    machine, marched = passed
    found = recorded(machine, marched, time=1.0, dx=0.4)
    end = marched[-1].centres[0, 0]
    assert [frame.centres[0, 0] for frame in found] == pytest.approx(0.4 * np.arange(1, int(end / 0.4) + 1), abs=1e-9)


def test_whichever_comes_first(passed: Any) -> None:
    machine, marched = passed
    speed = marched[-1].centres[0, 0] / marched[-1].time
    for time, dx in ((0.001, 0.4), (0.002, 0.4), (0.0009, 10.0)):
        found = recorded(machine, marched, time=time, dx=dx)
        gaps = np.diff([0.0] + [frame.time for frame in found])
        assert gaps == pytest.approx(min(time, dx / speed), abs=1e-10)


def test_several_frames_in_one_outer_step(passed: Any) -> None:
    machine, marched = passed
    found = recorded(machine, marched, time=1e-5)
    assert len(found) == pytest.approx(marched[-1].time / 1e-5, abs=1)
    assert (np.diff([frame.time for frame in found]) > 0).all()


def test_a_cell_that_goes_to_and_fro_is_recorded_at_its_steps(passed: Any) -> None:
    """Steps count from the last frame, in either direction."""
    machine, marched = passed
    path = [0.0, 0.7, 1.3, 0.2, -0.9, -1.1]
    moved = [evolve(marched[0], time=float(i), centres=np.array([[x, 0, 6.0]])) for i, x in enumerate(path)]
    found = recorded(machine, moved, time=100.0, dx=1.0)
    assert [frame.centres[0, 0] for frame in found] == pytest.approx([1.0, 0.0, -1.0])
    assert [frame.time for frame in found] == pytest.approx([1.5, 3 + 2 / 11, 4.5])


def test_dx_of_a_cell_is_from_its_partner(lab: Any) -> None:
    """The scene speaks of steps in dx, and dx is the distance from the partner wherever that has gone."""
    cells = {"other": 'height = "6 um"', "free": 'x = "-40 um"\nheight = "7 um"'}
    machine = lab.machine(cells, shear=80.0, position=1e-3)
    found = recorded(machine, lab.states(machine, 0.1), time=10.0, dx=0.5, cell=1)
    assert len(found) > 5
    dx = np.array([frame.centres[1, 0] - frame.centres[0, 0] for frame in found])
    assert np.diff(dx) == pytest.approx(0.5, abs=1e-6)


def test_a_schedule_goes_on_from_what_it_kept(passed: Any) -> None:
    machine, marched = passed
    cadence, felt = Cadence(time=0.0007, dx=0.4), hazards(machine.problem)
    whole = [frame.time for frame in recorded(machine, marched, time=0.0007, dx=0.4)]
    schedule, found = Schedule.starting(cadence, machine.problem, marched[0]), []
    for before, after in pairwise(marched):
        schedule = Schedule.remembering(cadence, schedule.memory())
        found += [frame.time for frame in frames(machine.problem, felt, schedule, before, after)]
    assert found == whole


def test_recording_does_not_change_the_run(lab: Any, same: Any) -> None:
    machine = lab.machine({"a": 'overlap = "-20 nm"'}, **ROLLING)
    first, second = lab.states(machine, 0.02), lab.states(machine, 0.02)
    recorded(machine, first, time=1e-4)
    assert same(first[-1], second[-1])


def test_bond_counts_of_a_frame_follow_the_events(lab: Any) -> None:
    machine = lab.machine({"a": 'overlap = "-20 nm"'}, **ROLLING)
    marched = lab.states(machine, 0.03)
    events = np.concatenate([state.events for state in marched])
    found = recorded(machine, marched, time=3.1e-4)
    assert len(found) > 90
    for frame in found:
        past = events[events["time"] <= frame.time]
        assert frame.bond_counts[0] == (past["kind"] == 0).sum() - (past["kind"] == 1).sum()
    felt = hazards(machine.problem)
    for after in marched[1:]:
        frame = frame_of(machine.problem, felt, after)
        assert frame.bond_counts[0] == len(after.bonds)
        assert (frame.centres == after.centres).all()
        assert frame.overlaps == pytest.approx(after.centres[:, 2] - 5.255)


def test_frames_without_wall_or_bonds_say_so(lab: Any) -> None:
    machine = lab.machine(FREE, shear=80.0, wall=False)
    state = lab.start(machine)
    frame = frame_of(machine.problem, hazards(machine.problem), state)
    assert np.isinf(frame.wall_gaps).all()
    assert np.isnan(frame.overlaps).all()
    assert (frame.capture_hazards == 0).all()


# Stop conditions


def condition(quantity: str, value: float = 0.0, above: bool = True, cell: str = "free") -> StopWhen:
    return StopWhen(cell=cell, quantity=quantity, above=above, value=value, text=f"{cell}.{quantity}")


@pytest.mark.parametrize(
    ("quantity", "value"), [("dx", 13.0), ("x", 3.0), ("y", 1.0), ("z", 5.2), ("overlap", 5.2 - 5.255)]
)
def test_conditions_measure_what_they_name(lab: Any, quantity: str, value: float) -> None:
    cells = {"other": 'x = "-10 um"\nheight = "6 um"', "free": 'x = "3 um"\ny = "1 um"\nheight = "5.2 um"'}
    machine = lab.machine(cells, bond={})
    state = lab.start(machine)
    assert condition(quantity, value - 1e-9).holds(machine.problem, state)
    assert not condition(quantity, value + 1e-9).holds(machine.problem, state)
    assert condition(quantity, value + 1e-9, above=False).holds(machine.problem, state)
    assert not condition(quantity, value - 1e-9, above=False).holds(machine.problem, state)


def test_the_first_condition_that_holds(lab: Any) -> None:
    machine = lab.machine(FREE)
    state = lab.start(machine)
    asked = [condition("x", 1.0), condition("z", 5.0), condition("y", -1.0)]
    assert first_that_holds(asked, machine.problem, state) == "free.z"
    assert first_that_holds(asked[:1], machine.problem, state) is None
    assert not condition("z", 0.0, cell="taken away").holds(machine.problem, state)


def test_caught_counts_from_the_moment_on(lab: Any) -> None:
    machine = lab.machine(FREE)
    state = evolve(lab.start(machine), time=0.3)
    assert not condition("caught").holds(machine.problem, state)
    assert condition("caught").holds(machine.problem, evolve(state, caught_since=np.array([0.3])))


# Captures


@pytest.fixture(scope="module")
def bound(lab: Any) -> tuple[Any, Any]:
    made = lab.machine({"a": 'overlap = "-20 nm"'}, **ROLLING)
    machine = lab.with_molecules(made, [np.array([[0.0, 0.0, -5.175]])])
    return machine, lab.bound(machine, [0], [[0.0, 0.0, 0.05]])


def seen(machine: Any, states: list[Any]) -> list[Any]:
    """Let the account of captures hear states in turn, and give it after each."""
    found: list[Any] = []
    for state in states:
        if found:
            kept = {n: getattr(found[-1], n) for n in ("bound_since", "bound_at", "caught_since")}
            state = evolve(state, **kept)
        found.append(with_captures(machine.problem, state))
    return found


def lone_speed(machine: Any, state: State) -> float:
    """Give the speed at which the flow alone would carry the first cell."""
    radius, height, gap = machine.problem.radii[0], state.centres[0, 2], state.wall_gaps[0]
    return lone_velocity(machine.problem.setting, float(radius), float(height), float(gap))


def moving(state: Any, speed: float, times: Any) -> list[Any]:
    return [evolve(state, time=float(t), centres=state.centres + np.array([speed * t, 0, 0])) for t in times]


@pytest.mark.parametrize(("share", "expected"), [(0.05, True), (0.099, True), (0.101, False), (1.0, False)])
def test_caught_is_bound_for_a_while_and_slow(bound: Any, share: float, expected: bool) -> None:
    """The defaults: 100 ms, and slower than 0.1 of the cell's own free stream."""
    machine, state = bound
    speed = share * lone_speed(machine, state)
    found = seen(machine, moving(state, speed, np.arange(0, 0.2, 1e-3)))
    caught = [bool(np.isfinite(after.caught_since[0])) for after in found]
    assert not any(caught[:99])
    assert any(caught) == expected
    if expected:
        since = found[-1].caught_since[0]
        assert since == pytest.approx(0.1, abs=2e-3)


def test_a_lost_bond_ends_a_capture_and_the_count(bound: Any, lab: Any) -> None:
    machine, state = bound
    free = lab.bound(machine, [], [])
    held_on = moving(state, 0.0, np.arange(0, 0.15, 1e-3))
    let_go = [evolve(free, time=0.15)]
    again = moving(state, 0.0, np.arange(0.151, 0.3, 1e-3))
    found = seen(machine, [*held_on, *let_go, *again])
    assert np.isfinite(found[149].caught_since[0])
    assert np.isinf(found[150].caught_since[0])
    assert np.isinf(found[150].bound_since[0])
    assert np.isinf(found[245].caught_since[0])
    assert found[-1].caught_since[0] == pytest.approx(0.251, abs=2e-3)


def test_a_cell_slow_at_first_sight_of_a_later_while_is_caught_then(bound: Any) -> None:
    """Fast over the first 100 ms, at rest from then on: caught at the end of the next while, not before."""
    machine, state = bound
    speed = 0.5 * lone_speed(machine, state)
    fast = moving(state, speed, np.arange(0, 0.1, 1e-3))
    rest = moving(evolve(state, centres=fast[-1].centres), 0.0, np.arange(0.1, 0.35, 1e-3))
    found = seen(machine, [*fast, *rest])
    assert found[-1].caught_since[0] == pytest.approx(0.2, abs=3e-3)


def test_a_rolling_cell_is_caught_and_a_free_one_never(lab: Any) -> None:
    cells = {"roller": 'overlap = "-20 nm"', "probe": 'y = "30 um"\noverlap = "-20 nm"\nbinds = false'}
    last = lab.last(lab.machine(cells, shear=80.0, excess=50.0, repulsion=True, bond={}, rate=1e-2), 0.25)
    assert 0.1 <= last.caught_since[0] <= last.time
    assert np.isinf(last.caught_since[1])
    assert last.bond_counts()[1] == 0
