"""Straight stripes with sharp edges."""

import numpy as np
from attrs import Attribute, field, frozen

from mpad_core import Array
from mpad_surfaces.pattern.along import FINEST, along, positive


@frozen(kw_only=True)
class Stripes:
    """Dense for `duty` of every `period` along the direction at `angle`, from `offset` on."""

    period: float = field(validator=positive)  # µm
    duty: float = field(default=0.5)
    angle: float = 0.0  # degrees
    offset: float = 0.0  # µm

    @duty.validator
    def _within_one(self, attribute: "Attribute[float]", value: float) -> None:
        if not 0 < value < 1:
            raise ValueError(f"duty must lie between 0 and 1, but is {value:g}")

    def share(self, x: Array, y: Array) -> Array:
        """Give 1 within dense stripes, 0 between them."""
        periods = (along(x, y, self.angle) - self.offset) / self.period
        return np.where(periods - np.floor(periods) < self.duty, 1.0, 0.0)

    def resolution(self) -> float:
        """Give a fiftieth of the period, or less (µm)."""
        return min(FINEST, self.period / 50)
