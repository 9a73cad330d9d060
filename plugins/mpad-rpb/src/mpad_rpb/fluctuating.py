"""Thermal motion: a root of the mobility, and its divergence by differences."""

import numpy as np
from attrs import evolve

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import RefusedError
from mpad_core.numerics.fluctuations import dense_root, divergence, preconditioned_root, room_to_move
from mpad_core.numerics.stokeslets import self_mobilities
from mpad_rpb.configured import Plan
from mpad_rpb.dense import Dense
from mpad_rpb.matrix_free import Lone, MatrixFree, corrected, product
from mpad_rpb.scene import Spheres

TOLERANCE = 1e-9  # of a root by Lanczos, whose products are good to 1e-10


def root(prepared: Dense | MatrixFree, noise: Array) -> Array:
    """Multiply noise (N, 6) or (N, 6, k) with a root of the mobility.

    Raises
    ------
    RefusedError
        If the mobility is not positive definite, or the iteration does not converge.
    """
    try:
        if isinstance(prepared, Dense):
            return dense_root(prepared.mobility, noise)
        return _root_of_many(prepared.spheres, noise)
    except np.linalg.LinAlgError as error:
        raise RefusedError("rpb: the mobility is not positive definite: " + prepared.spheres.closest()) from error


def _root_of_many(spheres: Spheres, noise: Array) -> Array:
    """Multiply by Lanczos; near contact with the wall each sphere's own exact mobility preconditions."""
    still = Spheres.of(spheres.configuration, evolve(spheres.setting, shear_rate=0.0), spheres.exact)
    if still.exact:
        lone = Lone.of(still)
        blocks = lone.mobility
    else:
        blocks = self_mobilities(still.centres, still.radii, still.setting.viscosity, still.setting.wall)
        if still.damping is not None:
            blocks = still.damping[:, None, None] * blocks

    def apply(load: Array) -> Array:
        return corrected(still, lone, load, None)[0] if still.exact else product(still, load)

    found = preconditioned_root(apply, blocks, noise, tolerance=TOLERANCE)
    if not found.change <= TOLERANCE:
        raise RefusedError(
            f"rpb: no root of the mobility after {found.products} products (change {found.change:.1e}, wanted "
            f"{TOLERANCE:.0e}): " + spheres.closest()
        )
    return found.x


def drift(prepared: Dense | MatrixFree, noise: Array | None) -> Array:
    """Give ∇·M (N, 6), by differences over all coordinates or by one random difference."""
    spheres, at = prepared.spheres, prepared.spheres.configuration
    still = Plan(setting=evolve(spheres.setting, shear_rate=0.0), exact=spheres.exact)

    def product_at(shift: Array, loads: Array) -> Array:
        return still.prepared(at.moved(shift), None).solve(loads).velocity

    gaps = at.wall_gaps if still.setting.wall else None
    return divergence(product_at, room_to_move(at.centres, at.radii, gaps), noise)
