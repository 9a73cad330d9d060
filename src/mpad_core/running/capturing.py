"""Who is caught: bound without a break for a while, and slow over that while."""

import numpy as np
from attrs import evolve

from mpad_core.arrays import Array
from mpad_core.physics.coupling import lone_velocity
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import State

_SHORTEST = 1e-3  # s, of a while


def with_captures(problem: Problem, state: State) -> State:
    """Keep account of it over the outer step that ends in a state, whose memory of captures is still that of its start.

    Breaks are taken from the events, places from the way, so that nothing depends on how long outer steps are.
    """
    bound = state.bond_counts() > 0
    since = np.where(bound, np.minimum(state.bound_since, state.time), np.inf)
    at = np.where(np.isinf(state.bound_since) | ~bound, state.centres[:, 0], state.bound_at)
    caught = np.where(bound, state.caught_since, np.inf)
    for i, time in _unbroken_since(state).items():
        since[i], at[i], caught[i] = time, _place(state, i, time), np.inf
    for k in np.flatnonzero(bound):
        i = int(k)
        place = float(problem.radii[i]), float(state.centres[i, 2]), float(state.wall_gaps[i])
        slow = problem.caught.slower_than * lone_velocity(problem.setting, *place)
        while state.time - since[i] >= max(problem.caught.bound_for, _SHORTEST):
            end = since[i] + max(problem.caught.bound_for, _SHORTEST)
            x = _place(state, i, end)
            if abs(x - at[i]) < slow * (end - since[i]):
                caught[i] = min(caught[i], end)
            since[i], at[i] = end, x  # a new while begins
    return evolve(state, bound_since=since, bound_at=at, caught_since=caught)


def _unbroken_since(state: State) -> dict[int, float]:
    """Give since when (s) each cell that is bound, and was free at some time of the last outer step, has been bound."""
    events, after = state.events[state.events["kind"] < 2], state.bond_counts()
    changes = np.where(events["kind"] == 0, 1, -1)
    found = {}
    for i in set(events["cell"].tolist()) | set(events["partner"][events["partner"] >= 0].tolist()):
        own = (events["cell"] == i) | (events["partner"] == i)
        counts = after[i] - np.cumsum(changes[own][::-1])[::-1]  # before each of its events
        free = np.flatnonzero(counts == 0)
        if after[i] > 0 and len(free):
            found[i] = float(events["time"][own][free[-1]])
    return found


def _place(state: State, cell: int, time: float) -> float:
    """Give where a cell was along the flow (µm) at a time of the last outer step."""
    if state.way is None:
        return float(state.centres[cell, 0])
    xs: Array = state.way.centres[:, cell, 0]
    return float(np.interp(time, state.way.times, xs))
