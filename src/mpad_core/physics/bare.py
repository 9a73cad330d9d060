"""A wall without sites: what bonds between cells have for a surface."""

import math
from typing import ClassVar

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array


@frozen(kw_only=True)
class Bare:
    """A surface on which there is nothing to bind."""

    name: ClassVar[str] = "bare"

    def density(self, x: Array, y: Array) -> Array:
        """Give the density (1/µm²): zero."""
        return np.zeros(np.broadcast_shapes(np.shape(x), np.shape(y)))

    def resolution(self) -> float:
        """Give infinity: it is the same everywhere."""
        return math.inf

    def densest(self) -> float:
        """Give zero."""
        return 0.0
