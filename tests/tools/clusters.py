"""Clusters and crowds of spheres in near contact or overlapping, and the ends of a spectrum by products alone."""

from typing import Any

import numpy as np

from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration, Setting
from spheres import stokes_units


def pair(gap: float, ratio: float) -> tuple[Any, Any]:
    """Two side by side on the wall."""
    small = 1 / ratio
    heights, reach = np.array([1.0, small]) * (1 + gap), 1 + small + gap * small
    return [[0, 0, heights[0]], [np.sqrt(reach**2 - np.ptp(heights) ** 2), 0, heights[1]]], [1.0, small]


def stack(gap: float, ratio: float) -> tuple[Any, Any]:
    """Three upon each other above the wall, the largest lowest."""
    radii = np.array([1.0, ratio**-0.5, 1 / ratio])
    gaps = gap * np.minimum(radii, np.roll(radii, 1))
    heights = np.cumsum(2 * radii + np.r_[gap, gaps[1:]]) - radii
    return np.column_stack([0 * heights, 0 * heights, heights]), radii


def triple(gap: float, ratio: float) -> tuple[Any, Any]:
    """Two large ones on the wall, and a small one on it, in the corner between them."""
    centres, radii = pair(gap, 1.0)
    small = 1 / ratio
    height, reach = small * (1 + gap), 1 + small * (1 + gap)
    middle, across = np.mean(centres, axis=0), reach**2 - (1 + gap - height) ** 2 - (1 + gap / 2) ** 2
    if across > 0:
        return [*centres, [middle[0], np.sqrt(across), height]], [*radii, small]
    return [*centres, [middle[0], 0, middle[2] + np.sqrt(reach**2 - (1 + gap / 2) ** 2)]], [*radii, small]


def tetrahedron(gap: float, ratio: float) -> tuple[Any, Any]:
    """Three on the wall and against each other, and one upon them, or upon the first if it would fall through."""
    s, h, small = 2 + gap, 1 + gap, 1 / ratio
    reach, low = 1 + small * (1 + gap), [[0, 0, h], [s, 0, h], [s / 2, s * np.sqrt(0.75), h]]
    rise = reach**2 - s**2 / 3
    top = [s / 2, s / np.sqrt(12), h + np.sqrt(rise)] if rise > 0 else [0, 0, h + reach]
    return [*low, top], [1.0, 1.0, 1.0, small]


def overlapping(rng: np.random.Generator, count: int, above: bool) -> tuple[Any, Any]:
    """Spheres thrown into a box that is half as wide as they would need, above the wall or cut by it."""
    radii, side = rng.uniform(0.3, 1.0, count), 1.5 * np.cbrt(count)
    low = radii * 10 ** rng.uniform(-6, 0, count) if above else -0.99 * radii * rng.random(count)
    heights = np.where(rng.random(count) < 0.3, radii + low, radii + 0.01 + side * rng.random(count))
    return np.column_stack([side * rng.random((count, 2)), heights]), radii


def ritz_values(chosen: MobilitySolver, at: Configuration, steps: int) -> Any:
    """Give the Ritz values, ascending, of the mobility in Stokes' units from so many steps of Lanczos."""
    prepared, units = chosen.prepare(chosen.plan(Setting(viscosity=1.0)), at), stokes_units(at.radii)

    def product(x: Any) -> Any:
        return chosen.solve(prepared, (x / units).reshape(-1, 6)).velocity.ravel() / units

    vectors, triangle = np.empty((steps + 1, len(units))), np.zeros((steps, steps))
    start = np.random.default_rng(0).normal(size=len(units))
    vectors[0] = start / np.linalg.norm(start)
    for k in range(steps):
        new = product(vectors[k])
        for _ in range(2):  # once leaves what rounding has put back
            along = vectors[: k + 1] @ new
            new -= along @ vectors[: k + 1]
            triangle[k, : k + 1] += along
        vectors[k + 1] = new / np.linalg.norm(new)
    return np.linalg.eigvalsh(triangle)  # reads the lower triangle
