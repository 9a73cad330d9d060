"""A cell carried past a held one: the path itself, where the lift is a thousandth of the speed along the flow."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mpad_core import solver, velocities

PATH = json.loads((Path(__file__).parent / "data" / "passage_path.json").read_text())
RADIUS = 5.0  # µm
WEIGHT = 4 / 3 * np.pi * RADIUS**3 * PATH["excess_density"] * 9.81e-6  # pN


def path(accuracy, start, places, weight):
    """Give y and z (µm) of the passing cell at places x."""
    cdl = solver("cdl-biem", accuracy=accuracy)
    held, force = [0, 0, PATH["held_height"]], [[0, 0, 0], [0, 0, -weight]]

    def slope(x, at):
        moved = velocities(
            cdl, [held, [x, *at]], RADIUS, viscosity=PATH["viscosity"], shear_rate=PATH["shear_rate"], forces=force,
            held=[0],
        )[1]  # fmt: skip
        return moved[1:3] / moved[0]

    span = (places[0], places[-1])
    return solve_ivp(slope, span, start, method="DOP853", rtol=1e-7, atol=1e-6, t_eval=places).y


@pytest.mark.parametrize(("accuracy", "allowed"), [(1e-4, 1e-3), (1e-3, 3e-3)])
def test_follows_the_reference_path(accuracy, allowed):
    """To 1 nm at an accuracy of 1e-4, over 127 µm of which the cell rises and falls by less than 0.2 µm."""
    y, z = path(accuracy, PATH["start"][1:], np.array(PATH["x"]), WEIGHT)
    assert np.abs(z - PATH["z"]).max() < allowed
    assert np.abs(y - PATH["y"]).max() < allowed


@pytest.mark.parametrize("accuracy", [1e-2, 1e-3, 1e-4])
def test_a_neutral_cell_comes_down_as_it_went_up(accuracy):
    """Stokes flow is reversible: without weight the path is its own mirror image, to 1 nm, at any accuracy."""
    places = np.linspace(-50, 50, 41)
    _, z = path(accuracy, [10.0, 5.255], places, 0.0)
    assert np.abs(z - z[::-1]).max() < 1e-3
    assert z[20] - z[0] > 0.15
