"""The fluid's velocity around the spheres, from densities made smooth over each sphere."""

import math
from functools import cache

import numpy as np
from attrs import frozen

from mpad_cdlbiem.elements.kernels import add_completion, add_double_layer
from mpad_cdlbiem.elements.mesh import mesh_of, packed
from mpad_cdlbiem.elements.system import seen
from mpad_core.arrays import Array
from mpad_core.interfaces.values import Configuration, Setting

CHUNK = 128  # points at a time: some ten megabytes of kernel
INNER = 3  # points each way on an element
NEIGHBOURS = 12  # elements that a smooth density is fitted to, by a quadratic


@frozen(kw_only=True, eq=False)
class Smooth:
    """Many points on the unit sphere, and how their densities follow from those of the n elements."""

    points: Array  # (m, 3)
    sources: Array  # (tiles, 1, 4 TILE)
    weights: Array  # (m, n)


@cache
def smooth(side: int) -> Smooth:
    """Fit a quadratic in the tangent plane of each point to the nearest elements."""
    centroids, fine = mesh_of(side, 1).points, mesh_of(side * INNER, 1)
    weights = np.zeros((len(fine.points), len(centroids)))
    for row, point in zip(weights, fine.points, strict=True):
        near = np.argsort(-centroids @ point)[:NEIGHBOURS]
        x, y = np.linalg.svd(point[None])[2][1:] @ centroids[near].T
        row[near] = np.linalg.pinv(np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y]))[0]
    return Smooth(points=fine.points, sources=packed(fine.points[:, None], fine.weights[:, None]), weights=weights)


@frozen(kw_only=True, eq=False)
class Moving:
    """Spheres under forces, in motion, and the densities on their elements."""

    at: Configuration
    setting: Setting
    velocity: Array  # (N, 6)
    forces: Array  # (N, 6)
    density: Array  # (N, 3, n)

    def flow(self, points: Array) -> Array:
        """Give the fluid's velocity (n, 3) at points (n, 3); in a sphere, the sphere's own."""
        points = np.ascontiguousarray(points, dtype=np.float64)
        chunks = [points[i : i + CHUNK] for i in range(0, len(points), CHUNK)]
        flow = np.concatenate([np.empty((0, 3)), *(self._around(chunk) for chunk in chunks)])
        for centre, radius, velocity in zip(self.at.centres, self.at.radii, self.velocity, strict=True):
            r = points - centre
            inside = np.linalg.norm(r, axis=1) <= radius
            flow[inside] = velocity[:3] + np.cross(velocity[3:], r[inside])
        return flow

    def _around(self, points: Array) -> Array:
        flow = np.zeros((3, len(points)))
        flow[0] = self.setting.shear_rate * points[:, 2]
        for sphere in range(len(self.forces)):
            for image in (False, True)[: 1 + self.setting.wall]:
                flow += self._completion(points, sphere, image) + self._layer(points, sphere, image)
        return flow.T

    def _completion(self, points: Array, sphere: int, image: bool) -> Array:
        block, scale = np.zeros((3 * len(points), 6)), 1 / (8 * math.pi * self.setting.viscosity)
        add_completion(points, self.at.centres[sphere], scale, image, block)
        return np.asarray((block @ self.forces[sphere]).reshape(3, -1))

    def _layer(self, points: Array, sphere: int, image: bool) -> Array:
        """Give the double layer's velocity (3, m).

        A density that is constant over a sphere moves nothing outside; taking the nearest point's off before summing
        keeps the sum good down to the surface.
        """
        density = self.density[sphere]
        fine, places = smooth(math.isqrt(density.shape[1] // 6)), seen(points, self.at, sphere, image)
        q = density @ fine.weights.T
        kernel = np.zeros((3 * len(points), q.size))
        add_double_layer(places, fine.sources, 0.0, image, kernel)
        parts = kernel.reshape(3, len(points), 3, -1)
        nearest = q[:, np.argmax(places[:, :3] @ fine.points.T, axis=1)]
        return np.asarray((kernel @ q.ravel()).reshape(3, -1) - np.einsum("itk,kt->it", parts.sum(axis=3), nearest))
