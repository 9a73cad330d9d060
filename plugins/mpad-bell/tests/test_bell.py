"""The bond model `bell`: its contract, equation 1 of King and Hammer (2001), and what it refuses."""

from typing import Any

import numpy as np
import pytest

from mpad_bell.bell import Bell
from mpad_core.plugins.registry import load
from mpad_core.testing import BondModelContract

BASE: dict[str, Any] = {"off_rate": 2.0, "reactive_compliance": 4e-5, "stiffness": 1e5, "rest_length": 0.03}
KT = 4.11e-3


class TestBell(BondModelContract):
    model = Bell(**BASE, kT=KT)


class TestIdealBond(BondModelContract):
    model = Bell(**BASE | {"reactive_compliance": 0.0}, kT=KT)


class TestSoftBond(BondModelContract):
    model = Bell(**BASE | {"stiffness": 100.0}, kT=KT)


def test_comes_in_by_the_front_door() -> None:
    assert load("bond", "bell") is Bell


@pytest.mark.parametrize(("force", "factor"), [(0.0, 1.0), (50.0, 1.62681), (100.0, 2.64650), (-50.0, 1.62681)])
def test_rate_grows_with_force(force: float, factor: float) -> None:
    """exp(r0 F / kT) with r0 = 0.4 angstrom, kT = 4.11 pN nm: r0 50 pN / kT = 0.486618."""
    model = Bell(**BASE, kT=KT)
    length = np.array([0.03 + force / 1e5])
    assert model.tension(length) == pytest.approx([force], abs=1e-9)
    assert model.off_rate(length) == pytest.approx([2.0 * factor], rel=1e-5)


@pytest.mark.parametrize("stretch", [0.0, 1e-4, 3e-4])
def test_derived_on_rate_is_the_published_one(stretch: float) -> None:
    """k_f = k_f0 exp[σ d (r0 − d/2) / kT], which Bell's off-rate and the spring's energy give together."""
    law = TestBell().law()
    found = float(law.on_rate(np.array([0.03 + stretch]))[0])
    assert found == pytest.approx(84.0 * np.exp(1e5 * stretch * (4e-5 - stretch / 2) / KT), rel=1e-9)


@pytest.mark.parametrize("name", ["off_rate", "reactive_compliance"])
def test_refuses_negative_numbers(name: str) -> None:
    with pytest.raises(ValueError, match="must not be negative, but is -1"):
        Bell(**BASE | {name: -1.0}, kT=KT)
