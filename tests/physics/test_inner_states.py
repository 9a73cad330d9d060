"""Bonds with inner states: the chain of the free pair and all bound states keeps detailed balance at every length."""

from typing import Any, ClassVar

import numpy as np
import pytest
from attrs import evolve, frozen
from scipy.integrate import quad
from scipy.linalg import expm

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import PartError
from mpad_core.numerics.tables import value
from mpad_core.physics.problem import BondSpecies
from mpad_core.physics.reactions import TABLE_ERROR, BondLaw, hazard_table

KT = 4.11e-3
BOTH = pytest.mark.parametrize("compression", ["slack", "linear"])


@frozen(kw_only=True)
class Chain:
    """Three states in a row, each deeper and each faster to reach under tension."""

    name: ClassVar[str] = "chain"
    rest_length: float = 0.03
    stiffness: float = 1e4
    off: tuple[float, ...] = (20.0, 3.0, 0.5)
    forward: float = 40.0

    def states(self) -> int:
        return len(self.off)

    def tension(self, length: Array) -> Array:
        return self.stiffness * (length - self.rest_length)

    def off_rate(self, length: Array) -> Array:
        faster = np.exp(2e-4 * np.abs(self.tension(length)) / KT)
        return np.stack([rate * faster for rate in self.off])

    def exchange(self, length: Array) -> Array:
        rates = np.zeros((3, 3, *np.shape(length)))
        tilt = np.exp(np.minimum(3e-4 * np.abs(self.tension(length)) / KT, 10))
        rates[0, 1], rates[1, 0] = self.forward * tilt, 10 / tilt
        rates[1, 2], rates[2, 1] = 7 * tilt, 2.0
        return rates

    def breakpoints(self) -> tuple[float, ...]:
        kink = 10 * KT / 3e-4 / self.stiffness  # where the tilt stops growing
        return (self.rest_length, *(self.rest_length + s * kink for s in (-1, 1) if self.rest_length + s * kink > 0))


@frozen(kw_only=True)
class Ring(Chain):
    """The same with a third exchange, which balances the two others if `around` is one."""

    name: ClassVar[str] = "ring"
    around: float = 1.0

    def exchange(self, length: Array) -> Array:
        rates = Chain.exchange(self, length)
        there, back = rates[0, 1] * rates[1, 2], rates[1, 0] * rates[2, 1]
        rates[0, 2], rates[2, 0] = 0.1 * there / back * self.around, np.full(np.shape(length), 0.1)
        return rates


def law(species: Any, model: Any, **words: Any) -> BondLaw:
    made: BondSpecies = evolve(species("bell", **words), model=model, rest_length=model.rest_length)
    return BondLaw(species=made)


def generator(made: BondLaw, length: float) -> Array:
    """The rates of the chain free, 0, 1, … at one length, (S + 1, S + 1)."""
    x = np.array([length])
    rates = np.zeros((made.states() + 1,) * 2)
    rates[0, 1:], rates[1:, 0] = made.on_rates(x)[:, 0], made.off_rates(x)[:, 0]
    rates[1:, 1:] += made.exchange(x)[..., 0]
    return rates - np.diag(rates.sum(axis=1))


@BOTH
@pytest.mark.parametrize("model", [Chain(), Ring()])
def test_the_whole_chain_is_balanced_at_every_length(species: Any, model: Any, compression: str) -> None:
    """No current in the steady state, which is had from the matrix exponential, and Boltzmann's law between lengths."""
    made = law(species, model, compression=compression)
    at_rest = expm(generator(made, 0.03) * 1e3)[0]
    for length in np.linspace(0.029, 0.032, 13):
        rates = generator(made, length)
        steady = expm(rates * 1e3)[0]  # 1e3 s are long: the slowest rate is 0.5 1/s
        flux = steady[:, None] * (rates - np.diag(np.diag(rates)))
        assert flux == pytest.approx(flux.T, rel=1e-9)
        felt = max(length, 0.03) if compression == "slack" else length
        energy = quad(model.tension, 0.03, felt)[0]
        ratio = steady[1] / steady[0] / (at_rest[1] / at_rest[0])
        assert ratio == pytest.approx(np.exp(-energy / KT), rel=1e-8)


def test_the_scenes_on_rate_is_the_total_of_an_unstressed_bond(species: Any) -> None:
    made = law(species, Chain(), on_rate=12.0)
    x = np.array([0.03])
    assert made.on_rates(x).sum() == pytest.approx(12.0, rel=1e-14)
    assert made.on_rate(x) == pytest.approx(12.0, rel=1e-14)
    # 1 : X01/X10 = 4 : 4 · X12/X21 = 14, times the off-rates 20, 3, 0.5
    assert made.on_rates(x)[:, 0] == pytest.approx(12 * np.array([20, 12, 7]) / 39, rel=1e-12)


def test_a_bond_that_never_breaks_forms_in_its_states_as_the_exchange_weighs_them(species: Any) -> None:
    made = law(species, Chain(off=(0.0, 0.0, 0.0)))
    assert made.on_rates(np.array([0.03]))[:, 0] == pytest.approx(84 * np.array([1, 4, 14]) / 19, rel=1e-12)


@BOTH
@pytest.mark.parametrize("extra", [0, 5])
def test_tables_of_each_state_follow_the_law(species: Any, compression: str, extra: int) -> None:
    made = law(species, Chain(), compression=compression)
    tables = made.tables(extra)
    assert len(tables) == 3
    lengths = np.random.default_rng(5).uniform(0.0285, 0.0315, 200)
    for state, table in enumerate(tables):
        assert table.coefficients.shape[1:] == (3 + max(extra, 3), 4)
        truth = [made.tension(lengths), made.off_rate(lengths, state), made.on_rates(lengths)[state]]
        truth += [*made.exchange(lengths)[state], *np.zeros((max(extra - 3, 0), len(lengths)))]
        found = np.array([[value(table, 0, column, x) for x in lengths] for column in range(len(truth))])
        scale = np.abs(np.array(truth))
        scale[0] += 1e-9 * scale[0].max()  # at the rest length
        assert (np.abs(found - truth) <= 2 * TABLE_ERROR * scale).all()


def test_a_model_without_inner_states_has_one_and_no_exchange(species: Any) -> None:
    made = BondLaw(species=species("bell"))
    assert made.states() == 1
    assert made.exchange(np.zeros(4)).shape == (1, 1, 4)
    plain, wide = made.tables(), made.tables(2)
    assert (len(plain), len(wide)) == (1, 1)
    assert plain[0].coefficients.shape[1] == 3
    assert wide[0].coefficients.shape[1] == 5
    assert (wide[0].coefficients[:, 3:] == 0).all()
    assert (wide[0].coefficients[:, :3] == plain[0].coefficients).all()


def test_reach_and_hazard_count_all_states(species: Any) -> None:
    """Where all states together have a negligible on-rate; and the hazard is that of the total."""
    made = law(species, Chain())
    within, beyond = np.linspace(0, made.reach(), 2000), np.linspace(made.reach(), 0.06, 500)
    assert (made.on_rate(beyond) <= 1e-9 * made.on_rate(within).max()).all()
    table = hazard_table(made)
    gaps = np.linspace(0, made.reach(), 200_001)
    total = np.trapezoid(made.on_rates(gaps).sum(axis=0), gaps)
    found = np.interp(0.0, table.tip_gaps, table.integral)
    assert found == pytest.approx(total, rel=1e-4)  # steps of 1/75 of the Gaussian's width


@frozen(kw_only=True)
class OwnRates(Chain):
    def on_rate(self, length: Array) -> Array:
        return np.stack([np.full(np.shape(length), rate) for rate in (1.0, 2.0, 3.0)])

    def exchange(self, length: Array) -> Array:
        return Chain.exchange(self, length) * (np.arange(3)[:, None, None] == 0)  # one way: no balance is asked for


def test_own_on_rates_are_respected(species: Any) -> None:
    made = law(species, OwnRates())
    assert (made.on_rates(np.array([0.01, 0.03])) == np.array([[1.0], [2.0], [3.0]])).all()
    assert value(made.tables()[2], 0, 2, 0.02) == pytest.approx(3.0, rel=1e-12)


@frozen(kw_only=True)
class OneWay(Chain):
    def exchange(self, length: Array) -> Array:
        rates = Chain.exchange(self, length)
        rates[1, 0] = 0
        return rates


@frozen(kw_only=True)
class Lost(Chain):
    def exchange(self, length: Array) -> Array:
        rates = Chain.exchange(self, length)
        rates[1, 2] = rates[2, 1] = 0
        return rates


@frozen(kw_only=True)
class Staying(Chain):
    def exchange(self, length: Array) -> Array:
        return Chain.exchange(self, length) + np.eye(3).reshape(3, 3, *[1] * np.ndim(length))


@frozen(kw_only=True)
class Flat(Chain):
    def off_rate(self, length: Array) -> Array:
        return np.full(np.shape(length), 2.0)


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (Ring(around=1.1), "between inner states 1 and 2 .*Kolmogorov"),
        (OneWay(), "goes one way only"),
        (Lost(), r"no exchange links inner states \[2\] to state 0"),
        (Staying(), "a diagonal that is not zero"),
        (Flat(), r"off_rate\(\) gives shape .* with inner states, not \(3, "),
    ],
)
def test_what_keeps_no_balance_is_refused(species: Any, model: Any, message: str) -> None:
    with pytest.raises(PartError, match=message):
        law(species, model).tables()
