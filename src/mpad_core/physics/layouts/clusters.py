"""Molecules in clusters: a Thomas process (Thomas, Biometrika 36:18, 1949) on the sphere."""

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.physics.layouts.around import around
from mpad_core.physics.layouts.layout import Draw
from mpad_core.physics.layouts.uniform import on_sphere

_PLACES, _WHICH, _WHERE = 0, 1, 2  # sequences of draws


@frozen(kw_only=True)
class Clusters:
    """Clusters anywhere on the sphere; about each, molecules scattered by a Gaussian along the surface.

    A cell has a given number of molecules, so each belongs to a cluster chosen at random: what Poisson numbers of
    molecules in each cluster are, given their sum. Clusters may overlap.
    """

    cluster_size: float  # molecules in a cluster, in the mean
    cluster_radius: float  # µm along the shell, standard deviation in either direction

    def count(self, number: int) -> int:
        """Give how many clusters so many molecules make."""
        return max(round(number / self.cluster_size), 1)

    def directions(self, number: int, radius: float, shell: float, draw: Draw) -> Array:
        """Give unit vectors (number, 3); see `Layout`."""
        clusters = self.count(number)
        centres = on_sphere(draw(_PLACES, 0, clusters))
        chosen = (draw(_WHICH, 0, number)[:, 0] * clusters).astype(np.int64)
        first, second = draw(_WHERE, 0, number).T
        distance = self.cluster_radius * np.sqrt(-2 * np.log(first))  # of two normal numbers, by Box and Muller
        return around(centres[chosen], distance / shell, 2 * np.pi * second)
