"""What a layout of molecules must be."""

from collections.abc import Callable
from typing import Protocol, TypeAlias

from mpad_core.arrays import Array

Draw: TypeAlias = Callable[[int, int, int], Array]
"""Gives a run of draws: (which sequence, its first pair, how many pairs) -> (n, 2) uniform numbers in (0, 1)."""


class Layout(Protocol):
    """Places of a given number of molecules on the shell of one cell."""

    def directions(self, number: int, radius: float, shell: float, draw: Draw) -> Array:
        """Give unit vectors (number, 3) from the cell's centre.

        Parameters
        ----------
        number
            How many molecules.
        radius
            Of the smooth sphere, µm; numbers per area are per area of this one.
        shell
            Radius on which the molecules lie, µm; lengths along the surface are lengths on this one.
        draw
            This cell's and this kind's own random numbers; no others may be used.

        Raises
        ------
        ValueError
            If there is no room for what is asked.
        """
        ...
