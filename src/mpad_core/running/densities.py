"""The wall's local density inside the burst: a look at the lattice that `mpad_core.physics.wall_density` samples."""

import math

from mpad_core.numerics.compiled import compiled_inline, compiled_where_present
from mpad_core.physics.wall_density import Densities
from mpad_core.running.layout import Binding


@compiled_inline
def density_at(densities: Densities, cell: int, kind: int, x: float, y: float) -> float:
    """Give the density at a place (µm) near a cell, for a species, by the one that its on-rate is given at.

    Beyond the cell's window it is that at the window's edge: end the burst before, see `holds`.
    """
    size = densities.size[cell, kind]
    start = densities.start[cell, kind]
    if size == 1:
        return float(densities.value[start])
    spacing = densities.spacing[kind]
    i = min(max(math.floor(x / spacing) - densities.first_i[cell, kind], 0), size - 1)
    j = min(max(math.floor(y / spacing) - densities.first_j[cell, kind], 0), size - 1)
    return float(densities.value[start + i * size + j])


@compiled_where_present(otherwise=True)
def holds(binding: Binding, cell: int, x: float, y: float) -> bool:
    """Tell whether the windows of a cell centred at (x, y), in µm, hold all that its molecules may reach."""
    densities = binding.densities
    for kind in range(densities.spacing.shape[0]):
        size, spacing, reach = densities.size[cell, kind], densities.spacing[kind], densities.reach[cell, kind]
        if size == 1:
            continue
        low_x, low_y = densities.first_i[cell, kind] * spacing, densities.first_j[cell, kind] * spacing
        width = size * spacing
        if not (
            low_x <= x - reach and x + reach <= low_x + width and low_y <= y - reach and y + reach <= low_y + width
        ):
            return False
    return True
