"""Squares, dense and bare by turns."""

import numpy as np
from attrs import field, frozen

from mpad_core import Array
from mpad_surfaces.pattern.along import FINEST, along, positive


@frozen(kw_only=True)
class Checkerboard:
    """Squares of half a `period`, with their sides along the direction at `angle` and across it.

    The square that begins at the origin, in both directions, is dense.
    """

    period: float = field(validator=positive)  # µm
    angle: float = 0.0  # degrees

    def share(self, x: Array, y: Array) -> Array:
        """Give 1 within dense squares, 0 in the others."""
        side = 0.5 * self.period
        column = np.floor(along(x, y, self.angle) / side)
        row = np.floor(along(x, y, self.angle + 90) / side)
        pairs = 0.5 * (column + row)
        return np.where(pairs == np.floor(pairs), 1.0, 0.0)  # where their sum is even; remainders take thrice as long

    def resolution(self) -> float:
        """Give a fiftieth of the period, or less (µm)."""
        return min(FINEST, self.period / 50)
