"""The bond model `catch-slip`: its contract, where its life is longest, and what it refuses."""

from typing import Any

import numpy as np
import pytest

from mpad_catch.catch_slip import CatchSlip
from mpad_core.plugins.registry import load
from mpad_core.testing import BondModelContract

KT = 4.11e-3
# of P-selectin and soluble PSGL-1, the values of the preset
BASE: dict[str, Any] = {
    "catch_rate": 120.0, "catch_compliance": 2.17e-3, "slip_rate": 0.25, "slip_compliance": 0.51e-3,
    "stiffness": 1e5, "rest_length": 0.03, "kT": KT,
}  # fmt: skip


class TestCatchSlip(BondModelContract):
    model = CatchSlip(**BASE)


class TestOnlyCatch(BondModelContract):
    """Force closes the only way: the off-rate falls through all numbers that a computer has."""

    model = CatchSlip(**BASE | {"slip_rate": 0.0})


def test_comes_in_by_the_front_door() -> None:
    assert load("bond", "catch-slip") is CatchSlip


def at_force(force: float) -> Any:
    return np.array([0.03 + force / 1e5])


def test_life_is_longest_where_the_pathways_balance() -> None:
    """0.76 s at 11.8 pN, 8.3 ms unstressed: F* = kT/(x_c + x_s) ln[k_c x_c / (k_s x_s)]."""
    model = CatchSlip(**BASE)
    best = KT / (2.17e-3 + 0.51e-3) * np.log(120 * 2.17 / (0.25 * 0.51))
    assert best == pytest.approx(11.7, abs=0.1)
    lives = 1 / np.concatenate([model.off_rate(at_force(f)) for f in (best, best - 0.5, best + 0.5, 0.0)])
    assert lives[0] > max(lives[1:3])
    assert lives[0] == pytest.approx(0.76, abs=0.01)
    assert lives[3] == pytest.approx(8.3e-3, abs=1e-4)


def test_a_push_counts_as_a_pull() -> None:
    model = CatchSlip(**BASE)
    assert model.off_rate(at_force(-20.0)) == pytest.approx(model.off_rate(at_force(20.0)), rel=1e-9)
    assert model.tension(at_force(-20.0)) == pytest.approx([-20.0])


@pytest.mark.parametrize("name", ["catch_rate", "catch_compliance", "slip_rate", "slip_compliance"])
def test_refuses_negative_numbers(name: str) -> None:
    with pytest.raises(ValueError, match="must not be negative, but is -1"):
        CatchSlip(**BASE | {name: -1.0})
