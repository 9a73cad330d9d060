"""The surface `uniform` and the force law `electrostatic`: contracts, known numbers, and what they refuse."""

import numpy as np
import pytest

from mpad_core.plugins.registry import load
from mpad_core.testing import GapForceContract, SurfaceContract
from mpad_surfaces.electrostatic import Electrostatic
from mpad_surfaces.uniform import Uniform


class TestUniform(SurfaceContract):
    surface = Uniform(density=180.0)


class TestBareUniform(SurfaceContract):
    surface = Uniform(density=0.0)


class TestElectrostatic(GapForceContract):
    force = Electrostatic(strength=500.0, decay=565.0)


class TestShortElectrostatic(GapForceContract):
    force = Electrostatic(strength=500.0, decay=2000.0)


def test_come_in_by_the_front_door() -> None:
    assert load("surface", "uniform") is Uniform
    assert load("force", "electrostatic") is Electrostatic


def test_about_a_nanonewton_at_ten_nanometres() -> None:
    """What the constants are calibrated to: F0 τ / (exp(τ e) − 1) = 282500 pN / (exp(5.65) − 1)."""
    force = Electrostatic(strength=500.0, decay=565.0).force(np.array([0.01]))
    assert force == pytest.approx([997.2], abs=0.5)


def test_carries_a_bead_at_its_resting_gap() -> None:
    """A bead of radius 5 µm, 5 % denser than water, weighs 0.257 pN and rests 5.4 nm below overlap zero."""
    weight = 4 / 3 * np.pi * 5**3 * 50e-12 * 9.81e6
    assert weight == pytest.approx(0.2568, abs=1e-4)
    force = Electrostatic(strength=500.0, decay=565.0).force(np.array([0.03 - 5.379e-3]))
    assert force == pytest.approx([weight], rel=1e-3)


@pytest.mark.parametrize("name", ["strength", "decay", "continued_below"])
def test_refuses_what_is_not_positive(name: str) -> None:
    with pytest.raises(ValueError, match="must be positive, but is 0"):
        Electrostatic(**{"strength": 500.0, "decay": 565.0} | {name: 0.0})


def test_refuses_a_negative_density() -> None:
    with pytest.raises(ValueError, match="must not be negative, but is -1"):
        Uniform(density=-1.0)
