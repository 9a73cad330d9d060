"""A scene's run, kept in memory: where the cells went, and how long it took."""

import time
from collections.abc import Callable, Sequence

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import State
from mpad_core.running.initial import initial_state
from mpad_core.running.march import Machine, march

Ends = Callable[[State], bool]


@frozen(kw_only=True, eq=False)
class Way:
    """What a run came to."""

    problem: Problem
    times: Array  # (T,) s
    centres: Array  # (T, N, 3) µm
    last: State
    steps: int  # outer ones, preparations included
    took: float  # s, without getting ready

    def dx(self, cell: int) -> Array:
        """Give a cell's distance (µm) along the flow from the one that it passes, or from its own start."""
        other, x = self.problem.partner[cell], self.centres[..., 0]
        found: Array = x[:, cell] - (x[:, other] if other >= 0 else self.problem.dx_from[cell])
        return found

    def overlap(self, cell: int) -> Array:
        """Give δ of a cell (µm); its height in scenes without bonds."""
        zero = float(self.problem.zero_overlap[cell])
        found: Array = self.centres[:, cell, 2] - (zero if np.isfinite(zero) else 0.0)
        return found

    def caught_dx(self, cell: int) -> float:
        """Give Δx (µm) at which a cell was caught; NaN if it was not."""
        caught = float(self.last.caught_since[cell])
        return float(np.interp(caught, self.times, self.dx(cell))) if np.isfinite(caught) else np.nan


class Clock:
    """Counts the time (s) that is ours: CPU time where other programs hold us up, else what has passed."""

    def __init__(self) -> None:
        self._began = time.perf_counter(), time.process_time()

    def read(self) -> float:
        """Give the time since it was made."""
        return min(time.perf_counter() - self._began[0], time.process_time() - self._began[1])


def travel(machine: Machine, until: float, ends: Ends = lambda state: False) -> Way:
    """Run a problem from its start to its end, and keep where the cells were.

    Parameters
    ----------
    machine
        A problem made ready.
    until, ends
        When the run ends: a time (s), and whether a state is its last.

    Raises
    ------
    RefusedError, PartError
        As the march does.
    """
    clock, prepared = Clock(), [0]

    def hear(name: str, state: State) -> None:
        prepared[0] += 1

    state = start = initial_state(machine, hear)
    times, centres = [np.array([start.time])], [start.centres[None]]
    for state in march(machine, start, until):
        if state.way is not None:
            times.append(state.way.times)
            centres.append(state.way.centres)
        if ends(state):
            break
    return Way(
        problem=machine.problem, times=np.concatenate(times), centres=np.concatenate(centres), last=state,
        steps=prepared[0] + len(times) - 1, took=clock.read(),
    )  # fmt: skip


@frozen(kw_only=True, eq=False)
class AtPlaces:
    """δ of a cell where it first comes to some Δx."""

    cell: int
    dx: tuple[float, ...]  # µm

    def names(self) -> list[str]:
        """Name the numbers."""
        return [f"delta (nm) at dx = {x:g} um" for x in self.dx]

    def of(self, way: Way) -> Array:
        """Give δ (µm) at these places; NaN where the cell never came."""
        farthest = np.maximum.accumulate(way.dx(self.cell))
        fresh = np.concatenate([[True], np.diff(farthest) > 0])
        found: Array = np.interp(self.dx, farthest[fresh], way.overlap(self.cell)[fresh], left=np.nan, right=np.nan)
        return found


@frozen(kw_only=True, eq=False)
class AtTime:
    """Where some cells are at a time."""

    cells: tuple[int, ...]
    time: float  # s
    called: tuple[str, ...]

    def names(self) -> list[str]:
        """Name the numbers."""
        return [f"{axis} (nm) of {name} at t = {self.time:g} s" for name in self.called for axis in "xyz"]

    def of(self, way: Way) -> Array:
        """Give x, y, z (µm) of each."""
        places = [np.interp(self.time, way.times, way.centres[:, i, k]) for i in self.cells for k in range(3)]
        return np.array(places)


Outcome = AtPlaces | AtTime


def first_free(problem: Problem, names: Sequence[str] = ()) -> int:
    """Give the first of the cells named, or of all, that is not held."""
    order = [problem.names.index(name) for name in names] or range(len(problem.names))
    return next((i for i in order if not problem.held[i]), order[0])
