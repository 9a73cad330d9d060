"""No step carries smooth spheres through each other or through the wall; runs that must are stopped by name."""

import re
from typing import Any

import numpy as np
import pytest
from attrs import evolve

from mpad_core.interfaces.errors import RefusedError
from mpad_core.physics.coupling import lone_velocity
from mpad_core.physics.state import State, Way
from mpad_core.running.crossing import apart, crossing, refuse_overlaps
from mpad_core.running.initial import at_rest
from mpad_core.running.march import march

MEETING = {"a": 'x = "-10.5 um"\nheight = "8 um"', "b": 'height = "7 um"'}
PAIRS = np.array([[0, 1]])


def least(states: list[Any]) -> float:
    """Give the least gap between two beads on the way, its ends and all places noted between."""
    places = [c for s in states for c in ([s.centres] if s.way is None else s.way.centres)]
    return float(min(np.linalg.norm(c[0] - c[1]) - 10 for c in places))


@pytest.mark.parametrize("position", [1e-4, 1.0])
def test_lone_cells_head_on_stop_where_they_meet(lab: Any, position: float) -> None:
    """Isolated cells go at exact speeds, so the time of contact is known."""
    machine = lab.machine(MEETING, shear=80.0, position=position)
    speeds = [lone_velocity(machine.problem.setting, 5.0, h, h - 5) for h in (8.0, 7.0)]
    meeting = (10.5 - np.sqrt(99)) / (speeds[0] - speeds[1])
    with pytest.raises(RefusedError, match=r"cell 'a' and cell 'b' are driven through .* add \[repulsion\]") as said:
        lab.last(machine, 0.05)
    found = re.search(r"t = (\S+) s: .* at a gap of (\S+) um", str(said.value))
    assert found is not None
    assert float(found[1]) == pytest.approx(meeting, abs=2 * machine.pace.grain)
    assert 0 <= float(found[2]) < 2 * machine.pace.grain * (speeds[0] - speeds[1])


def test_what_went_before_is_kept_and_nowhere_overlaps(lab: Any) -> None:
    machine = lab.machine(MEETING, shear=80.0, solver="rpb")
    states: list[Any] = []
    with pytest.raises(RefusedError, match="solver 'rpb'"):
        states.extend(march(machine, lab.start(machine), 0.05))
    assert len(states) > 3
    assert 0 <= least(states) < 1e-3


@pytest.mark.parametrize("solver", ["isolated", "rpb", "sd"])
@pytest.mark.parametrize("position", [1e-4, 1.0])
def test_repulsion_keeps_cells_apart_at_any_step(lab: Any, solver: str, position: float) -> None:
    states = lab.states(lab.machine(MEETING, shear=80.0, solver=solver, repulsion=True, position=position), 0.01)
    assert 0.3 < least(states) < 0.5


def test_lubrication_keeps_cells_apart_without_repulsion(lab: Any) -> None:
    states = lab.states(lab.machine(MEETING, shear=80.0, solver="sd", position=1.0), 0.012)
    assert 0 < least(states) < 0.4


def test_explicit_steps_into_the_wall_are_cut(lab: Any) -> None:
    """They know of no bound by themselves: the first would carry this heavy cell through the wall."""
    problem = lab.problem({"a": 'height = "5.3 um"'}, excess=5000.0)
    problem = evolve(problem, tolerances=evolve(problem.tolerances, euler=0.5))
    machine = lab.ready(problem, sub_step=0.5, longest=0.5)
    states = lab.states(machine, 1.0)
    assert min(float(s.wall_gaps[0]) for s in states) > 0
    assert states[1].time < 0.5 < states[-1].time


def test_overlaps_are_refused_before_step_one(lab: Any) -> None:
    problem = lab.problem({"a": 'height = "6 um"', "b": 'x = "11 um"\nheight = "6 um"'})
    through = evolve(problem, start=np.array([[0, 0, 6], [9.9, 0, 6.0]]))
    with pytest.raises(RefusedError, match=r"cell 'a' and cell 'b' overlap by 0\.1 um at the start"):
        at_rest(lab.ready(through))
    cut = evolve(problem, start=np.array([[0, 0, 4.9], [11, 0, 6.0]]))
    with pytest.raises(RefusedError, match=r"cell 'a' and the wall overlap by 0\.1 um at the start"):
        at_rest(lab.ready(cut))


def test_touching_to_rounding_is_no_overlap(lab: Any) -> None:
    problem = lab.problem({"a": 'height = "6 um"', "b": 'x = "11 um"\nheight = "6 um"'})
    centres = np.array([[0, 0, 6], [10 - 1e-14, 0, 6.0]])
    refuse_overlaps(problem, centres, np.ones(2))
    with pytest.raises(RefusedError):
        refuse_overlaps(problem, centres - [[0, 0, 0], [1e-7, 0, 0]], np.ones(2))


def moved(state: State, ways: Any) -> State:
    """Give the state after a way of places (W, 2, 3)."""
    ways = np.asarray(ways, float)
    number = len(ways)
    way = Way(
        steps=np.arange(1, number + 1), times=np.arange(1.0, number + 1), centres=ways, wall_gaps=ways[:, :, 2] - 5,
        orientations=np.zeros((number, 2, 4)), turns=np.zeros((number, 2, 3)),
    )  # fmt: skip
    return evolve(state, centres=ways[-1], wall_gaps=ways[-1, :, 2] - 5, way=way)


def test_what_passes_through_between_two_places_is_found(lab: Any) -> None:
    """At neither end of the step do the two overlap; half way they are in one place."""
    machine = lab.machine({"a": 'height = "20 um"', "b": 'x = "20 um"\nheight = "20 um"'})
    start = at_rest(machine)
    after = moved(start, [[[20, 0, 20], [0, 0, 20]]])
    found = crossing(machine.problem, start, after)
    assert found is not None
    assert found.cells == (0, 1)
    assert found.gap == pytest.approx(10)
    assert found.depth == pytest.approx(-10)
    around = moved(start, [[[0, 10.1, 20], [20, 0, 20]], [[40, 10.1, 20], [20, 0, 20]], [[40, 0, 20], [20, 0, 20]]])
    assert crossing(machine.problem, start, around) is None


@pytest.mark.parametrize("gap", [1e-6, 0.1, 3.0])
def test_a_prediction_closes_no_gap_by_more_than_half(lab: Any, gap: float) -> None:
    problem = lab.problem({"a": 'height = "20 um"', "b": 'x = "30 um"\nheight = "20 um"'})
    centres = np.array([[0, 0, 20], [10 + gap, 0, 20.0]])
    for shift in ([[5.0, 3, 1], [0, 0, 0]], [[0.1 * gap, 0, 0], [0, 0, 0]], [[-4.0, 0, 0], [0, 0, 2]]):
        taken = apart(problem, PAIRS, centres, np.array(shift))
        left = np.linalg.norm(np.subtract(*(centres + taken))) - 10
        assert left >= 0.5 * gap * (1 - 1e-6)
    assert np.array_equal(taken, shift)  # the last one moves them apart: left as it is
