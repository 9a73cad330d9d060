"""A density that changes linearly between two places."""

import numpy as np
from attrs import Attribute, field, frozen

from mpad_core import Array
from mpad_surfaces.pattern.along import FINEST, along


@frozen(kw_only=True)
class Gradient:
    """Linear from `start` to `end` along the direction at `angle`, constant before and behind."""

    start: float  # µm
    end: float = field()  # µm
    angle: float = 0.0  # degrees

    @end.validator
    def _behind_start(self, attribute: "Attribute[float]", value: float) -> None:
        if not value > self.start:
            raise ValueError(f"end must lie behind start, {self.start:g} um, but is {value:g} um; angle turns it round")

    def share(self, x: Array, y: Array) -> Array:
        """Give how far from start to end places are."""
        share: Array = np.clip((along(x, y, self.angle) - self.start) / (self.end - self.start), 0.0, 1.0)
        return share

    def resolution(self) -> float:
        """Give a fiftieth of its length, or less (µm)."""
        return min(FINEST, (self.end - self.start) / 50)
