"""Resistance of spheres and the load of the ambient flow on them when held: by elements, and exact for one and two."""

from collections.abc import Iterable

import numpy as np
from attrs import frozen

from mpad_cdlbiem.elements.mesh import Mesh
from mpad_cdlbiem.elements.system import System
from mpad_core.arrays import Array
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.numerics.pair_functions import PairFunctions, pair_resistance, pair_strain_load
from mpad_core.numerics.wall_functions import wall_resistance, wall_shear_load


@frozen(kw_only=True, eq=False)
class Friction:
    """Resistance and load: `resistance` @ U = F + `load` for spheres that move with U under F."""

    resistance: Array  # (6 N, 6 N), symmetric
    load: Array  # (6 N,), of the ambient flow on spheres held

    def plus(self, other: "Friction") -> "Friction":
        """Give the sum."""
        return Friction(resistance=self.resistance + other.resistance, load=self.load + other.load)

    def less(self, other: "Friction") -> "Friction":
        """Give the difference."""
        return Friction(resistance=self.resistance - other.resistance, load=self.load - other.load)

    def velocity(self, loads: Array) -> Array:
        """Give the velocities (6 N, k) under loads (6 N, k)."""
        return np.asarray(np.linalg.solve(self.resistance, loads + self.load[:, None]))


def gathered(count: int, parts: Iterable[tuple[list[int], Friction]]) -> Friction:
    """Sum what holds for some of the spheres each."""
    resistance, load = np.zeros((6 * count, 6 * count)), np.zeros(6 * count)
    for spheres, part in parts:
        rows = np.concatenate([np.arange(6 * i, 6 * i + 6) for i in spheres])
        resistance[np.ix_(rows, rows)] += part.resistance
        load[rows] += part.load
    return Friction(resistance=resistance, load=load)


def velocities(density: Array, mesh: Mesh, radii: Array) -> Array:
    """Read the velocities (6 N, k) off densities (3 n N, k)."""
    rows = mesh.velocity @ density.reshape(len(radii), -1, density.shape[1])
    rows[:, 3:] /= radii[:, None, None]
    return np.asarray(rows.reshape(-1, density.shape[1]))


def friction_of(density: Array, mesh: Mesh, radii: Array) -> Friction:
    """Turn the densities of all right-hand sides of a `System` into resistance and load.

    Elements give a mobility that is not quite symmetric; its symmetric part is taken, which is as good.
    """
    answers = velocities(density, mesh, radii)
    mobility = answers[:, :-1]
    resistance = np.linalg.inv((mobility + mobility.T) / 2)
    resistance = (resistance + resistance.T) / 2
    return Friction(resistance=resistance, load=resistance @ answers[:, -1])


def friction_alone(system: System, mesh: Mesh, radii: Array) -> Friction:
    """Give the resistance and load by elements, of few spheres."""
    return friction_of(np.asarray(np.linalg.solve(system.operator, system.right)), mesh, radii)


def exact_wall(at: Configuration, sphere: int, setting: Setting) -> Friction:
    """Give the exact resistance and load of a sphere alone at the wall."""
    resistance, load = np.empty((6, 6)), np.empty(6)
    height, gap, radius = at.centres[sphere, 2], at.wall_gaps[sphere], at.radii[sphere]
    wall_resistance(height, gap, radius, setting.viscosity, resistance)
    wall_shear_load(height, gap, radius, setting.viscosity, setting.shear_rate, load)
    return Friction(resistance=resistance, load=load)


def exact_pair(at: Configuration, pair: list[int], setting: Setting) -> Friction:
    """Give the exact resistance and load of two spheres alone in unbounded fluid, the larger first.

    The load is R times the velocities of the ambient flow at the centres and half its vorticity, and a part by strain.
    """
    (a, b), (x1, x2) = at.radii[pair].tolist(), at.centres[pair]
    apart = x2 - x1
    distance = float(np.linalg.norm(apart))
    functions = PairFunctions.of(b / a)((distance - a - b) * (a + b) / (2 * a * b))
    resistance, load, strain, carried = np.empty((12, 12)), np.empty(12), np.zeros((3, 3)), np.zeros((2, 6))
    pair_resistance(functions, apart / distance, a, b, setting.viscosity, resistance)
    strain[0, 2] = strain[2, 0] = setting.shear_rate / 2
    pair_strain_load(functions, apart / distance, a, setting.viscosity, strain, load)
    carried[:, 0] = setting.shear_rate * at.centres[pair, 2]
    carried[:, 4] = setting.shear_rate / 2
    return Friction(resistance=resistance, load=load + resistance @ carried.ravel())
