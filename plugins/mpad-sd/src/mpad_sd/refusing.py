"""What has no answer is refused by name before anything is computed; what touches is put to the least gap."""

import numpy as np

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import RefusedError, refuse_first
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.numerics.neighbours import closest_pair

TOUCHING = 1e-9
"""Radii: overlaps up to this are rounding of spheres that touch."""


def refuse_bad(configuration: Configuration, setting: Setting) -> None:
    """Refuse numbers that are not finite, and spheres that overlap each other or the wall.

    Raises
    ------
    RefusedError
        Naming the first sphere or pair at fault and its number.
    """
    centres, radii, gaps = configuration.centres, configuration.radii, configuration.wall_gaps
    refuse_first("sd", "centre {} is not finite", centres, ~np.isfinite(centres).all(axis=1))
    refuse_first("sd", "radius {} µm is not positive", radii, ~((radii > 0) & np.isfinite(radii)))
    if setting.wall:
        cut = ~((gaps >= -TOUCHING * radii) & (centres[:, 2] > 0) & np.isfinite(gaps))
        refuse_first("sd", "gap {} µm: the wall cuts it", gaps, cut)
    i, j, gap = closest_pair(centres, radii)
    if not gap >= -TOUCHING * min(radii[i], radii[j]):
        raise RefusedError(f"sd: spheres {i} and {j}: gap {gap} µm: they overlap")


def refuse_loads(loads: Array) -> None:
    """Refuse loads that are not finite."""
    if not np.isfinite(loads).all():
        raise RefusedError("sd: the loads are not finite")
