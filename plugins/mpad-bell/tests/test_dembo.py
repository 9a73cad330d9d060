"""The bond models `dembo` and `ideal`: contracts, the published rates, and what they refuse."""

from typing import Any

import numpy as np
import pytest

from mpad_bell.bell import Bell
from mpad_bell.dembo import Dembo
from mpad_bell.ideal import Ideal
from mpad_core.plugins.registry import load
from mpad_core.testing import BondModelContract

KT = 4.11e-3
BASE: dict[str, Any] = {"off_rate": 2.0, "stiffness": 1e5, "rest_length": 0.03}


class TestSlip(BondModelContract):
    model = Dembo(**BASE, transition_stiffness=9.8e4, kT=KT)


class TestCatch(BondModelContract):
    """Its off-rate falls through all numbers that a computer has."""

    model = Dembo(**BASE, transition_stiffness=1.2e5, kT=KT)


class TestIdeal(BondModelContract):
    model = Ideal(**BASE)


def test_they_come_in_by_the_front_door() -> None:
    assert load("bond", "dembo") is Dembo
    assert load("bond", "ideal") is Ideal


@pytest.mark.parametrize("stretch", [0.0, 1e-4, 3e-4, -2e-4])
@pytest.mark.parametrize("transition", [9e4, 1e5, 1.1e5])
def test_both_rates_are_the_published_ones(stretch: float, transition: float) -> None:
    """k_r = k_r0 exp[(σ − σ_ts) d² / 2kT] and k_f = k_f0 exp[−σ_ts d² / 2kT] (Dembo 1988; Hammer & Apte 1992)."""
    contract = TestSlip()
    contract.model = Dembo(**BASE, transition_stiffness=transition, kT=KT)
    law, length = contract.law("linear"), np.array([0.03 + stretch])
    assert law.off_rate(length) == pytest.approx(2.0 * np.exp((1e5 - transition) * stretch**2 / (2 * KT)), rel=1e-9)
    assert law.on_rate(length) == pytest.approx(84.0 * np.exp(-transition * stretch**2 / (2 * KT)), rel=1e-9)


def test_ideal_is_the_limit_of_both() -> None:
    length = np.linspace(0, 0.2, 50)
    expected = Ideal(**BASE).off_rate(length)
    assert (expected == 2.0).all()
    assert (Bell(**BASE, kT=KT).off_rate(length) == expected).all()
    assert (Dembo(**BASE, transition_stiffness=1e5, kT=KT).off_rate(length) == expected).all()


@pytest.mark.parametrize("name", ["off_rate", "transition_stiffness"])
def test_refuse_negative_numbers(name: str) -> None:
    with pytest.raises(ValueError, match="must not be negative, but is -1"):
        Dembo(**BASE | {"transition_stiffness": 1.0, name: -1.0}, kT=KT)


def test_ideal_refuses_negative_numbers() -> None:
    with pytest.raises(ValueError, match="must not be negative, but is -1"):
        Ideal(**BASE | {"off_rate": -1.0})
