"""Molecules anywhere on a cell, each independently of the others."""

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.physics.layouts.layout import Draw


def on_sphere(draws: Array) -> Array:
    """Give points (n, 3), uniform on the unit sphere, of pairs (n, 2) of uniform numbers (Archimedes)."""
    cosine, azimuth = 2 * draws[:, 0] - 1, 2 * np.pi * draws[:, 1]
    sine = np.sqrt(1 - cosine**2)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1)


@frozen
class Uniform:
    """Uniformly at random over the whole sphere."""

    def directions(self, number: int, radius: float, shell: float, draw: Draw) -> Array:
        """Give unit vectors (number, 3); see `Layout`."""
        return on_sphere(draw(0, 0, number))
