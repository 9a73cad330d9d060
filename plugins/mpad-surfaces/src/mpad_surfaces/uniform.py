"""A wall whose binding sites have the same density everywhere."""

from typing import ClassVar

import numpy as np
from attrs import frozen

from mpad_core import Array, Surface, hookimpl, quantity


@frozen(kw_only=True)
class Uniform:
    """The same site density everywhere.

    Attributes
    ----------
    site_density
        In 1/µm² (in scenes: ``density``).
    """

    name: ClassVar[str] = "uniform"
    site_density: float = quantity("1/um^2", alias="density", doc="binding sites per area")

    @site_density.validator
    def _not_negative(self, attribute: object, value: float) -> None:
        if not value >= 0:
            raise ValueError(f"must not be negative, but is {value:g}")

    def density(self, x: Array, y: Array) -> Array:
        """Give the density (1/µm²) at every place."""
        return np.full(np.broadcast_shapes(np.shape(x), np.shape(y)), self.site_density)

    def densest(self) -> float:
        """Give the density (1/µm²)."""
        return self.site_density

    def resolution(self) -> float:
        """Give infinity (µm): it does not vary."""
        return np.inf


@hookimpl
def mpad_surfaces() -> list[type[Surface]]:
    """Give the surface of this module."""
    return [Uniform]
