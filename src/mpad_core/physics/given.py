"""What a plain question is given, checked: numbers in the right shapes, finite, and above the wall."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.errors import InputError
from mpad_core.interfaces.values import Configuration, Setting


def numbers_of(what: str, values: Any) -> Array:
    """Give an array of numbers.

    Raises
    ------
    InputError
        For what makes no sense.
    """
    try:
        return np.asarray(values, float)
    except (ValueError, TypeError) as error:
        raise InputError(f"{what} must be numbers in a regular array: {error}") from error


def setting_of(viscosity: float, shear_rate: float, wall: bool) -> Setting:
    """Give the fluid's setting.

    Raises
    ------
    InputError
        For what makes no sense.
    """
    if not (np.isfinite(viscosity) and viscosity > 0):
        raise InputError(f"viscosity must be positive and finite, not {viscosity}")
    if not np.isfinite(shear_rate):
        raise InputError(f"shear_rate must be finite, not {shear_rate}")
    return Setting(viscosity=viscosity, shear_rate=shear_rate, wall=wall)


def held_of(held: Sequence[int], n: int) -> Indices:
    """Give the numbers of held spheres, ascending.

    Raises
    ------
    InputError
        For what makes no sense.
    """
    chosen = np.asarray(held)
    if chosen.size and chosen.dtype.kind not in "iu":
        raise InputError(f"held must list the numbers of spheres, not {held!r}")
    if chosen.size and (chosen.min() < 0 or chosen.max() >= n):
        raise InputError(f"held must name spheres 0 to {n - 1}, not {held!r}")
    return np.unique(chosen.astype(np.int64))


def configuration_of(centres: Any, radii: Any, wall: bool) -> Configuration:
    """Give where the spheres are.

    Raises
    ------
    InputError
        For what makes no sense.
    """
    centres = np.atleast_2d(numbers_of("centres", centres))
    radii = numbers_of("radii", radii)
    if radii.shape not in ((), (len(centres),)):
        raise InputError(f"radii must be one number or one for each of the {len(centres)} spheres, not {radii.shape}")
    radii = np.broadcast_to(radii, (len(centres),))
    if centres.ndim != 2 or centres.shape[1] != 3 or len(centres) == 0:
        raise InputError(f"centres must be (N, 3) with N at least 1, not {centres.shape}")
    if not (np.isfinite(centres).all() and np.isfinite(radii).all() and (radii > 0).all()):
        raise InputError("centres must be finite and radii positive")
    if wall and (centres[:, 2] <= 0).any():
        i = int(np.argmin(centres[:, 2]))
        raise InputError(f"sphere {i} has its centre at z = {centres[i, 2]:g}, not above the wall z = 0")
    return Configuration(centres=centres, radii=radii)


def loads_of(n: int, forces: Any, torques: Any) -> Array:
    """Put forces and torques, either of which may be left out, into loads (n, 6)."""
    loads = np.zeros((n, 6))
    for part, given, what in ((slice(0, 3), forces, "forces"), (slice(3, 6), torques, "torques")):
        if given is not None:
            numbers = numbers_of(what, given)
            if numbers.shape != (n, 3):
                raise InputError(f"{what} must be ({n}, 3), not {numbers.shape}")
            loads[:, part] = numbers
    if not np.isfinite(loads).all():
        raise InputError("forces and torques must be finite")
    return loads
