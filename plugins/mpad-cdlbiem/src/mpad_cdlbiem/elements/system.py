"""The completed and deflated equations of spheres on meshes: the dense operator and its right-hand sides.

Kim and Karrila, Microhydrodynamics, ch. 15 to 17; Power and Miranda, SIAM J. Appl. Math. 47 (1987) 689. The density q
on the spheres' elements obeys

    (1 + K + Σ φ<φ,·> - Σ n<n,·>) q = -b,    b = u_∞ + Σ_j (Stokeslet F_j + rotlet T_j),    U + Ω × r = -Σ φ<φ, q>

with φ the rigid motions of each sphere, orthonormal on its mesh, and n its unit normal. A wall adds its images to K and
to the completion. Everything is of the form (operator, right), a column of `right` for each component of each load, and
one for the ambient flow; parts for some of the spheres are cut out of it.
"""

import math

import numpy as np
from attrs import frozen

from mpad_cdlbiem.elements.kernels import add_completion, add_double_layer
from mpad_cdlbiem.elements.mesh import Mesh
from mpad_core.arrays import Array
from mpad_core.interfaces.values import Configuration, Setting


@frozen(kw_only=True, eq=False)
class System:
    """The equations of some of the spheres, `operator` @ q = `right`."""

    operator: Array  # (3 n N, 3 n N)
    right: Array  # (3 n N, 6 N + 1): forces and torques of 1 on each sphere, last the ambient flow

    def part(self, spheres: list[int]) -> "System":
        """Cut out the equations that hold for some of the spheres, were they alone."""
        count = (self.right.shape[1] - 1) // 6
        size = len(self.operator) // count
        rows = np.concatenate([np.arange(i * size, (i + 1) * size) for i in spheres])
        columns = np.concatenate([*(np.arange(6 * i, 6 * i + 6) for i in spheres), [6 * count]])
        return System(operator=self.operator[np.ix_(rows, rows)], right=self.right[np.ix_(rows, columns)])


def surface_points(mesh: Mesh, at: Configuration) -> Array:
    """Give the elements' centroids, (N, n, 3)."""
    points: Array = at.centres[:, None] + at.radii[:, None, None] * mesh.points
    return points


def seen(points: Array, at: Configuration, sphere: int, image: bool) -> Array:
    """Give points as `add_double_layer` wants them: from the sphere's centre, mirrored for the image, in its radii."""
    mirrored = points * (1.0, 1.0, -1.0) if image else points
    lengths = np.column_stack([mirrored - at.centres[sphere], points[:, 2]])
    return np.asarray(lengths / at.radii[sphere])


def _places(sphere: int, size: int) -> slice:
    return slice(sphere * size, (sphere + 1) * size)


def unbounded(mesh: Mesh, at: Configuration, setting: Setting) -> System:
    """Give the equations in unbounded fluid."""
    count, size = len(at.radii), len(mesh.own)
    operator, right = np.zeros((count * size, count * size)), np.zeros((count * size, 6 * count + 1))
    points = surface_points(mesh, at)
    for i in range(count):
        rows = _places(i, size)
        operator[rows, rows] = mesh.own
        right[rows.start : rows.start + len(mesh.points), -1] = -setting.shear_rate * points[i, :, 2]
    system = System(operator=operator, right=right)
    _add(system, mesh, at, setting.viscosity, False)
    return system


def at_wall(system: System, mesh: Mesh, at: Configuration, setting: Setting) -> System:
    """Give the equations with what a wall adds."""
    bounded = System(operator=system.operator.copy(), right=system.right.copy())
    _add(bounded, mesh, at, setting.viscosity, True)
    return bounded


def _add(system: System, mesh: Mesh, at: Configuration, viscosity: float, image: bool) -> None:
    """Add the completion, and what each sphere does to the others; or what each image does to all."""
    points, size, scale = surface_points(mesh, at), len(mesh.own), -1 / (8 * math.pi * viscosity)
    for j in range(len(points)):
        for i in range(len(points)):
            rows = _places(i, size)
            add_completion(points[i], at.centres[j], scale, image, system.right[rows, 6 * j : 6 * j + 6])
            if image or i != j:
                places, block = seen(points[i], at, j, image), system.operator[rows, _places(j, size)]
                add_double_layer(places, mesh.sources, mesh.blur, image, block)
