"""What laws of patterns share: the coordinate along a direction, and a check."""

import numpy as np
from attrs import Attribute

from mpad_core import Array

FINEST = 0.05  # µm; no pattern is sampled more coarsely: an edge is off by 0.035 µm at most


def along(x: Array, y: Array, angle: float) -> Array:
    """Give how far places (µm) are along the direction at an angle (degrees) from x towards y."""
    turned = np.deg2rad(angle)
    distance: Array = x * np.cos(turned) + y * np.sin(turned)
    return distance


def positive(instance: object, attribute: "Attribute[float]", value: float) -> None:
    """Raise ValueError unless a parameter is positive and finite."""
    if not (value > 0 and np.isfinite(value)):
        raise ValueError(f"{attribute.name} must be positive, but is {value:g}")
