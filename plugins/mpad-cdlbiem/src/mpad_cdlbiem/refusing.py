"""What has no answer is refused by name before anything is computed."""

import numpy as np

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import RefusedError, refuse_first
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.numerics.neighbours import closest_pair


def refuse_bad(configuration: Configuration, setting: Setting) -> None:
    """Refuse numbers that are not finite, and spheres that touch.

    Raises
    ------
    RefusedError
        Naming the first sphere or pair at fault and its number.
    """
    centres, radii, gaps = configuration.centres, configuration.radii, configuration.wall_gaps
    refuse_first("cdl-biem", "centre {} is not finite", centres, ~np.isfinite(centres).all(axis=1))
    refuse_first("cdl-biem", "radius {} µm is not positive", radii, ~((radii > 0) & np.isfinite(radii)))
    if setting.wall:
        refuse_first("cdl-biem", "gap {} µm: it touches or cuts the wall", gaps, ~((gaps > 0) & np.isfinite(gaps)))
    i, j, gap = closest_pair(centres, radii)
    if not gap > 0:
        raise RefusedError(f"cdl-biem: spheres {i} and {j}: gap {gap} µm: they touch or overlap")


def refuse_loads(loads: Array) -> None:
    """Refuse loads that are not finite."""
    if not np.isfinite(loads).all():
        raise RefusedError("cdl-biem: the loads are not finite")
