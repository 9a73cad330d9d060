"""The wall's site density at a place, by the one that on-rates are given at; compiled."""

from typing import NamedTuple

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled_inline


class Densities(NamedTuple):
    """Stub."""

    value: Array
    start: Indices
    first_i: Indices
    first_j: Indices
    size: Indices
    spacing: Array


@compiled_inline
def density_at(densities: Densities, cell: int, kind: int, x: float, y: float) -> float:
    """Give the density."""
    return float(densities.value[densities.start[cell, kind]])
