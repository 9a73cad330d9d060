"""When a frame is due: at multiples of a time, and at every step of a cell along the flow, whichever comes first.

Recording never shortens a step: a frame between two states is interpolated, so another cadence gives the same run.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from attrs import define, frozen

from mpad_core.physics.state import State


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
    last_x: float

    @classmethod
    def starting(cls, cadence: Cadence, state: State) -> "Schedule":
        """Begin with a frame at this state."""
        return cls(cadence, state.time, float(state.centres[cadence.cell, 0]))

    def due(self, before: State, after: State) -> Iterator[float]:
        """Yield the shares (0, 1] of the way from one state to the next at which a frame is due."""
        x0, x1 = float(before.centres[self.cadence.cell, 0]), float(after.centres[self.cadence.cell, 0])
        span = after.time - before.time
        while True:
            by_time = (self.last_time + self.cadence.time - before.time) / span
            by_place = np.inf
            if self.cadence.dx is not None and x1 != x0:
                target = self.last_x + np.sign(x1 - x0) * self.cadence.dx
                by_place = (target - x0) / (x1 - x0)
            share = min(by_time, by_place if by_place > 0 else np.inf)
            if share > 1 + 1e-12:
                return
            self.last_time = before.time + min(share, 1.0) * span
            self.last_x = x0 + min(share, 1.0) * (x1 - x0)
            yield min(share, 1.0)

    def memory(self) -> dict[str, Any]:
        """Give what must be kept, as arrays."""
        return {"schedule.last_time": np.array(self.last_time), "schedule.last_x": np.array(self.last_x)}

    @classmethod
    def remembering(cls, cadence: Cadence, arrays: Mapping[str, Any]) -> "Schedule":
        """Go on from what was kept."""
        return cls(cadence, float(arrays["schedule.last_time"]), float(arrays["schedule.last_x"]))
