"""Encounter under slip: Chang and Hammer's Nusselt number against values to many digits, and its table."""

from typing import Any

import mpmath
import numpy as np
import pytest
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.bonds import Encounter
from mpad_core.interfaces.errors import PartError
from mpad_core.numerics.tables import value
from mpad_core.physics.encounter import ChangHammer, nusselt
from mpad_core.physics.reactions import ENCOUNTER_ERROR, FASTEST, SLOWEST, encounter_table

# worked out by other means, from the same boundary-value problem
KNOWN = [(0.001, 0.25917), (0.01, 0.36935), (0.1, 0.63759), (1, 1.69484), (3, 3.39442), (10, 8.55474)]
SELECTIN = ChangHammer(radius=1e-3, diffusivity=0.05, reaction_rate=1e6)


def by_many_digits(peclet: float) -> float:
    """Sum the alternating series with as many digits as its terms lose."""
    with mpmath.workdps(30 + int(0.9 * peclet)):
        z = mpmath.mpf(peclet) / 2
        terms = [(-1) ** n * mpmath.besseli(n, z) / mpmath.besselk(n, z) for n in range(int(40 + 2 * z))]
        return float(2 * (2 * mpmath.fsum(terms) - terms[0]))


@pytest.mark.parametrize(("peclet", "expected"), KNOWN)
def test_nusselt_has_the_known_values(peclet: float, expected: float) -> None:
    assert nusselt(np.array(peclet)) == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("peclet", [1e-8, 1e-4, 0.3, 5.0, 15.9])
def test_series_is_exact(peclet: float) -> None:
    assert nusselt(np.array([peclet]))[0] == pytest.approx(by_many_digits(peclet), rel=1e-8)


@pytest.mark.parametrize("peclet", [16.1, 24.0])
def test_asymptote_is_good(peclet: float) -> None:
    """The sixth term of the asymptote is 4e-6 of the first at the change-over: what is left out is less."""
    assert nusselt(np.array([peclet]))[0] == pytest.approx(by_many_digits(peclet), rel=3e-7)


def test_nusselt_rises_from_nothing_to_the_swath() -> None:
    peclet = np.concatenate([[0.0], np.geomspace(1e-12, 1e8, 4001)])
    found = nusselt(peclet)
    assert found[0] == 0
    assert (np.diff(found) > 0).all()
    assert found[-1] == pytest.approx(2e8 / np.pi, rel=1e-4)  # 2 b V by π D


def test_the_factor_is_the_on_rate_by_that_of_reaction_alone() -> None:
    """k_on = π D Nu P, P = δ/Nu / (1 + δ/Nu), by π b² k_in."""
    speeds = np.array([0.0, 1.0, 100.0, 3000.0])
    nu, delta = nusselt(1e-3 * speeds[1:] / 0.05), 1e-6 * 1e6 / 0.05
    rate = np.pi * 0.05 * nu * (delta / nu) / (1 + delta / nu)
    assert SELECTIN.factor(speeds)[0] == 0
    assert SELECTIN.factor(speeds)[1:] == pytest.approx(rate / (np.pi * 1e-6 * 1e6), rel=1e-12)
    assert SELECTIN.factor(np.array([1e12]))[0] == pytest.approx(1, abs=1e-4)
    assert isinstance(SELECTIN, Encounter)


def test_slow_reaction_does_not_feel_slip() -> None:
    slow = ChangHammer(radius=1e-3, diffusivity=0.05, reaction_rate=1e-6)
    assert slow.factor(np.array([1e-3, 1.0, 1e3])) == pytest.approx(1, abs=1e-9)
    assert (ChangHammer(radius=1e-3, diffusivity=0.05, reaction_rate=0.0).factor(np.array([0.0, 5.0])) == 1).all()


@pytest.mark.parametrize("encounter", [SELECTIN, ChangHammer(radius=0.02, diffusivity=1e-3, reaction_rate=10.0)])
def test_the_table_follows(encounter: Any) -> None:
    table = encounter_table(encounter)
    speeds = np.geomspace(SLOWEST, FASTEST, 3001)[:-1]
    found = np.array([value(table, 0, 0, speed) for speed in speeds])
    assert found == pytest.approx(encounter.factor(speeds), rel=1.1 * ENCOUNTER_ERROR)
    assert table.coefficients.shape[1] == 1
    assert value(table, 0, 0, 0.0) == value(table, 0, 0, SLOWEST)
    assert value(table, 0, 0, 1e7) == pytest.approx(encounter.factor(np.array([FASTEST]))[0], rel=1e-6)


@frozen
class Odd:
    answer: float

    def factor(self, slip_speed: Array) -> Array:
        return np.full(np.shape(slip_speed), self.answer)


@pytest.mark.parametrize(("answer", "message"), [(-1.0, "negative factor"), (np.nan, "not followed")])
def test_a_bad_factor_is_refused(answer: float, message: str) -> None:
    with pytest.raises(PartError, match=message):
        encounter_table(Odd(answer))
