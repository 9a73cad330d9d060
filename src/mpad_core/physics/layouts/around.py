"""Points near other points on the unit sphere."""

import numpy as np

from mpad_core.arrays import Array


def around(poles: Array, angle: Array, azimuth: Array) -> Array:
    """Go from poles (n, 3) by angles (n,) along great circles that leave them at azimuths (n,), in radians.

    From which direction azimuths count differs from pole to pole, so they should be uniform.
    """
    least = np.argmin(np.abs(poles), axis=1)
    first = np.cross(poles, np.eye(3)[least])  # the axis farthest from the pole: never parallel
    first /= np.linalg.norm(first, axis=1)[:, None]
    second = np.cross(poles, first)
    heading = np.cos(azimuth)[:, None] * first + np.sin(azimuth)[:, None] * second
    ends: Array = np.cos(angle)[:, None] * poles + np.sin(angle)[:, None] * heading
    ends /= np.linalg.norm(ends, axis=1)[:, None]
    return ends
