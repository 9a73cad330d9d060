"""What `rpb` adds to `isolated` is what a full solve adds, for two cells near each other at the wall.

The full solve's numbers are in data/two_cells_at_wall.json. `rpb` has no stresslets and no pair lubrication, so it is
not exact there; but it must differ from `isolated` in the full solve's direction and by about its amount.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from mpad_core import mobility_matrix, solver, velocities

CASES = json.loads((Path(__file__).parent / "data" / "two_cells_at_wall.json").read_text())["cases"]
NEAR_THE_WALL = [case for case in CASES if max(case["gaps"]["wall"]) < 0.3]  # radii; both cells, about 1 µm apart


def scaled(values, radii):
    """Make angular velocities comparable with velocities."""
    size = np.repeat(radii, 2)[:, None] ** np.array([0, 1])[None].repeat(len(radii), 0).reshape(-1, 1)
    return (np.reshape(values, (-1, 3)) * size).ravel()


def compared(part, whole):
    """Give the cosine between two differences, and the ratio of their sizes."""
    sizes = np.linalg.norm(part), np.linalg.norm(whole)
    return float(np.sum(part * whole) / (sizes[0] * sizes[1])), sizes[0] / sizes[1]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_mobility_differs_from_isolated_as_the_full_solve_says(case):
    alone = mobility_matrix(solver("isolated"), case["x"], case["a"], viscosity=1.0)
    coupled = mobility_matrix(solver("rpb"), case["x"], case["a"], viscosity=1.0)
    full = np.array(case["M"]).reshape(12, 12)
    cosine, ratio = compared(coupled - alone, full - alone)
    assert cosine > 0.88
    assert 0.7 < ratio < 1.1
    assert np.linalg.norm(coupled - full) < 0.5 * np.linalg.norm(alone - full)


@pytest.mark.parametrize("case", NEAR_THE_WALL, ids=lambda case: case["id"])
def test_motion_in_shear_differs_from_isolated_as_the_full_solve_says(case):
    radii = np.array(case["a"])
    alone, coupled = (
        scaled(velocities(solver(name), case["x"], radii, viscosity=1.0, shear_rate=1.0), radii)
        for name in ("isolated", "rpb")
    )
    full = scaled(case["V_shear"], radii)
    cosine, ratio = compared(coupled - alone, full - alone)
    assert cosine > 0.75
    assert 0.8 < ratio < 1.2
    assert np.linalg.norm(coupled - full) < np.linalg.norm(alone - full)
