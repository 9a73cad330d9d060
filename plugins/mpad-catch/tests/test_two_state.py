"""The bond model `two-state`: its contract, Evans' limit of fast exchange, and survival by the master equation."""

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from mpad_catch.two_state import TwoState
from mpad_core.plugins.registry import load
from mpad_core.testing import BondModelContract

KT = 4.11e-3
BASE: dict[str, Any] = {
    "weak_rate": 15.0, "strong_rate": 0.3, "reactive_compliance": 3e-4, "energy_difference": 3 * KT,
    "exchange_force": 4.0, "exchange_rate": 50.0, "stiffness": 1e5, "rest_length": 0.03, "kT": KT,
}  # fmt: skip
FORCES = [0.0, 5.0, 12.0, 20.0, 60.0]


class TestTwoState(BondModelContract):
    model = TwoState(**BASE)


class TestSoftTwoState(BondModelContract):
    """No force speeds breaking, so its tables go on until exchange has fallen to nothing."""

    model = TwoState(**BASE | {"reactive_compliance": 0.0, "stiffness": 1e4})


def at_force(force: float) -> Any:
    return np.array([0.03 + force / 1e5])


def one_rate(force: float) -> float:
    """The rate of fast exchange: [φ k1 + exp(F/f12) k2 exp(xb F/kT)] / [φ + exp(F/f12)]."""
    phi, shift = np.exp(BASE["energy_difference"] / KT), np.exp(force / BASE["exchange_force"])
    strong = BASE["strong_rate"] * np.exp(BASE["reactive_compliance"] * force / KT)
    return float((phi * BASE["weak_rate"] + shift * strong) / (phi + shift))


def rates_of(model: TwoState, force: float) -> Any:
    """The master equation of the two bound states under a force, dp/dt = p M."""
    rates = model.exchange(at_force(force))[..., 0]
    return rates - np.diag(rates.sum(axis=1) + model.off_rate(at_force(force))[:, 0])


def test_comes_in_by_the_front_door() -> None:
    assert load("bond", "two-state") is TwoState


@pytest.mark.parametrize("force", FORCES)
def test_fast_exchange_gives_evans_rate(force: float) -> None:
    """Started in either state, the bond survives as exp(−k t) once exchange is 1e7 times as fast as breaking."""
    model = TwoState(**BASE | {"exchange_rate": 1e8})
    rate = one_rate(force)
    for start in np.eye(2):
        alive = float((start @ expm(rates_of(model, force) / rate)).sum())
        assert alive == pytest.approx(np.exp(-1), rel=1e-5)


def test_force_first_strengthens_then_breaks() -> None:
    rates = [one_rate(force) for force in np.linspace(0, 80, 81)]
    assert 5 < int(np.argmin(rates)) < 40
    assert rates[0] > 5 * min(rates)


@pytest.mark.parametrize("force", FORCES)
def test_without_breaking_the_states_come_to_boltzmanns_balance_at_their_rate(force: float) -> None:
    model = TwoState(**BASE | {"weak_rate": 0.0, "strong_rate": 0.0})
    ratio = np.exp(force / BASE["exchange_force"] - BASE["energy_difference"] / KT)
    balance = np.array([1, ratio]) / (1 + ratio)
    for time in (0.001, 0.02, 1.0):
        start = np.array([1.0, 0.0])
        found = start @ expm(rates_of(model, force) * time)
        assert found == pytest.approx(balance + (start - balance) * np.exp(-50 * time), rel=1e-6)


def test_history_matters_when_exchange_is_slow() -> None:
    """Of bonds born weak and born strong, as many survive 0.1 s at 12 pN as two separate rates say."""
    model = TwoState(**BASE | {"exchange_rate": 1e-6})
    alive = expm(rates_of(model, 12.0) * 0.1).sum(axis=1)
    strong = 0.3 * np.exp(3e-4 * 12 / KT)
    assert alive == pytest.approx(np.exp([-1.5, -0.1 * strong]), rel=1e-6)


def test_new_bonds_are_balanced_with_breaking_ones() -> None:
    """on_1 / on_0 = (off_1 / off_0) r at every length."""
    law = TestTwoState().law()
    x = np.linspace(0.03, 0.0305, 7)
    on, off, exchange = law.on_rates(x), law.off_rates(x), law.exchange(x)
    assert on[1] / on[0] == pytest.approx(off[1] / off[0] * exchange[0, 1] / exchange[1, 0], rel=1e-12)
    assert on[:, 0].sum() == pytest.approx(84.0, rel=1e-12)


@pytest.mark.parametrize("name", ["weak_rate", "strong_rate", "reactive_compliance"])
def test_refuses_negative_numbers(name: str) -> None:
    with pytest.raises(ValueError, match="must not be negative, but is -1"):
        TwoState(**BASE | {name: -1.0})


@pytest.mark.parametrize("name", ["exchange_force", "exchange_rate"])
def test_refuses_no_force_and_no_exchange(name: str) -> None:
    with pytest.raises(ValueError, match="must be above zero, but is 0"):
        TwoState(**BASE | {name: 0.0})
