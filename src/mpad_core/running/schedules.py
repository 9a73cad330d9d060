"""When a frame is due: at multiples of a time, and at every step of a cell's Δx, whichever comes first.

Recording never shortens a step: a frame between two states is interpolated, so another cadence gives the same run.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from attrs import define, frozen

from mpad_core.physics.measures import dx_of
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import State, Waypoint


@frozen(kw_only=True)
class Cadence:
    """How often frames are recorded."""

    time: float  # s
    dx: float | None = None  # µm
    cell: int = 0  # whose steps along the flow count


@define
class Schedule:
    """Says which times between two states are due; its memory is two numbers, which a checkpoint keeps."""

    cadence: Cadence
    last_time: float
    last_dx: float

    @classmethod
    def starting(cls, cadence: Cadence, problem: Problem, state: State) -> "Schedule":
        """Begin with a frame at this state."""
        return cls(cadence, state.time, float(dx_of(problem, state.centres)[cadence.cell]))

    def due(self, problem: Problem, before: State | Waypoint, after: State | Waypoint) -> Iterator[float]:
        """Yield the shares (0, 1] of the way from one place to the next at which a frame is due."""
        x0, x1 = (float(dx_of(problem, state.centres)[self.cadence.cell]) for state in (before, after))
        span = after.time - before.time
        while True:
            by_time = (self.last_time + self.cadence.time - before.time) / span
            by_place = np.inf
            if self.cadence.dx is not None and x1 != x0:
                target = self.last_dx + np.sign(x1 - x0) * self.cadence.dx
                by_place = (target - x0) / (x1 - x0)
            share = min(by_time, by_place if by_place > 0 else np.inf)
            if share > 1 + 1e-12:
                return
            self.last_time = before.time + min(share, 1.0) * span
            self.last_dx = x0 + min(share, 1.0) * (x1 - x0)
            yield min(share, 1.0)

    def memory(self) -> dict[str, Any]:
        """Give what must be kept, as arrays."""
        return {"schedule.last_time": np.array(self.last_time), "schedule.last_dx": np.array(self.last_dx)}

    @classmethod
    def remembering(cls, cadence: Cadence, arrays: Mapping[str, Any]) -> "Schedule":
        """Go on from what was kept."""
        return cls(cadence, float(arrays["schedule.last_time"]), float(arrays["schedule.last_dx"]))
