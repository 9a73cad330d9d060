"""Root and divergence of a level's mobility, for thermal motion; the equations stand in `numerics.fluctuations`."""

from collections.abc import Callable

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.fluctuations import dense_root, divergence, preconditioned_root, room_to_move
from mpad_core.numerics.harmonics.levels import Level, Scene
from mpad_core.numerics.harmonics.products import product
from mpad_core.numerics.wall_functions import wall_mobility

FEW = 4
"""Spheres up to which a root is Cholesky's: 6N products; Lanczos takes some ten to twenty."""

PRODUCT = 1e-8
"""Residual of the products that a root is made of."""

ROOT = 1e-7
"""Tolerance of a root by Lanczos."""

DIFFERENCE = 1e-10
"""Residual of products whose difference is taken over a thousandth of the gap."""

UNBOUNDED = 1e12
"""Radii: as good as no wall."""


def root_of(level: Level, viscosity: float, noise: Array) -> Array:
    """Multiply noise (N, 6) or (N, 6, k) with a root of the mobility.

    Raises
    ------
    FloatingPointError
        If an iteration does not converge, or the mobility is not positive definite.
    """
    n = len(level.scene.radii)
    if n <= FEW:
        columns = product(level, np.eye(6 * n).reshape(-1, n, 6) * level.units, PRODUCT).reshape(6 * n, 6 * n)
        mobility = columns / level.units.ravel()[:, None]
        try:
            return dense_root(0.5 * (mobility + mobility.T) / viscosity, noise)
        except np.linalg.LinAlgError as error:
            raise FloatingPointError(f"the mobility is not positive definite ({error})") from error
    found = preconditioned_root(
        lambda load: product(level, load[None] / viscosity, PRODUCT)[0],
        _lone_mobilities(level.scene, viscosity),
        noise,
        tolerance=ROOT,
    )
    if not found.change <= ROOT:
        raise FloatingPointError(f"no root of the mobility after {found.products} products")
    return found.x


def divergence_of(level: Level, level_at: Callable[[Array], Level], viscosity: float, noise: Array | None) -> Array:
    """Give ∇·M (N, 6), by all differences or by one random difference.

    Parameters
    ----------
    level
        The level at the spheres' places.
    level_at
        Of displacements (N, 3): the level there, at the same degrees.
    viscosity
        Of the fluid.
    noise : (N, 3) or None
        Of the random difference.
    """
    scene = level.scene
    gaps = scene.gaps if scene.wall else None

    def product_at(shift: Array, loads: Array) -> Array:
        velocity: Array = product(level_at(shift), loads[None] / viscosity, DIFFERENCE)[0]
        return velocity

    return divergence(product_at, room_to_move(scene.centres, scene.radii, gaps), noise)


def _lone_mobilities(scene: Scene, viscosity: float) -> Array:
    """Give the exact mobilities (N, 6, 6) of lone spheres; without a wall it is as if one were too far to be felt."""
    lone = np.empty((len(scene.radii), 6, 6))
    for i, (centre, radius, gap) in enumerate(zip(scene.centres, scene.radii, scene.gaps, strict=True)):
        wall_mobility(centre[2], gap if scene.wall else UNBOUNDED * radius, radius, viscosity, lone[i])
    return lone
