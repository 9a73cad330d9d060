"""Frames: what is recorded of the way between two states."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from mpad_core.arrays import Array
from mpad_core.interfaces.observer import Frame
from mpad_core.physics.measures import Hazards
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import State, Waypoint
from mpad_core.running.schedules import Schedule


def frame_of(problem: Problem, hazards: Hazards, state: State) -> Frame:
    """Give the frame of a state."""
    return _frame(problem, hazards, state, state, state.step - state.zero, 1.0, state.bond_counts())


def _frame(
    problem: Problem, hazards: Hazards, before: State | Waypoint, after: State | Waypoint, step: int, share: float,
    counts: Any,
) -> Frame:  # fmt: skip
    """Give the frame at a share of the way from one place to the next; positions are interpolated linearly."""

    def between(a: Array, b: Array) -> Array:
        return b if share == 1.0 else a + share * (b - a)

    time = float(between(np.array(before.time), np.array(after.time)))
    turn = between(before.orientations, after.orientations)
    centres = between(before.centres, after.centres)
    gaps = between(before.wall_gaps, after.wall_gaps)
    return Frame(
        step=step,
        time=time,
        cells=problem.names,
        centres=centres,
        orientations=turn / np.linalg.norm(turn, axis=1, keepdims=True),
        velocities=after.drift,
        wall_gaps=gaps if problem.setting.wall else np.full(len(gaps), np.inf),
        overlaps=centres[:, 2] - problem.zero_overlap,
        bond_counts=counts.astype(float),
        capture_hazards=hazards.at(centres),
    )


def _bond_counts(before: State, after: State, time: float) -> Any:
    """Count each cell's bonds at a time: those before, and the events since."""
    counts = before.bond_counts()
    past = after.events[(after.events["time"] <= time) & (after.events["kind"] < 2)]
    changes = np.where(past["kind"] == 0, 1, -1)
    bridges = past["partner"] >= 0
    np.add.at(counts, past["cell"], changes)
    np.add.at(counts, past["partner"][bridges], changes[bridges])
    return counts


def frames(problem: Problem, hazards: Hazards, schedule: Schedule, before: State, after: State) -> Iterator[Frame]:
    """Yield the frames that are due between two states, from waypoint to waypoint."""
    start: State | Waypoint = before
    for point in after.way.points(before) if after.way else (after,):
        for share in schedule.due(problem, start, point):
            step = start.step + round(share * (point.step - start.step)) - after.zero
            counts = _bond_counts(before, after, start.time + share * (point.time - start.time))
            yield _frame(problem, hazards, start, point, step, share, counts)
        start = point
