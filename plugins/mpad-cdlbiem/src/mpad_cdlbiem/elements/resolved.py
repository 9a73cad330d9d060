"""Which spheres elements can resolve."""

import math

import numpy as np

from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.values import Configuration

SMALLEST = 0.1
"""Of the side of an element: a smaller sphere beside it is not felt where it is.

Half of this in the corner of a cell and the wall, a hundredth of the cell's radius, moved wrong by a third while the
estimate said a per cent.
"""


def refuse_unresolved(configuration: Configuration, elements: int, wall: bool) -> None:
    """Refuse a sphere much smaller than the elements of one nearby, but for two in unbounded fluid, which are exact.

    Raises
    ------
    RefusedError
        Naming both, and what would do.
    """
    centres, radii = configuration.centres, configuration.radii
    if len(radii) < 2 or (len(radii) == 2 and not wall):
        return
    side = radii * math.sqrt(4 * math.pi / elements)
    gaps = np.linalg.norm(centres[:, None] - centres[None], axis=2) - radii[:, None] - radii[None]
    lost = (radii[None] < SMALLEST * side[:, None]) & (gaps < side[:, None])
    if lost.any():
        large, small = (int(k) for k in np.unravel_index(int(lost.argmax()), lost.shape))
        fault = f"sphere {small} of radius {radii[small]:g} µm is too small beside elements of {side[large]:.3g} µm"
        raise RefusedError(f"cdl-biem: {fault} on sphere {large}; discretisation = 'spectral' would do")
