"""What every bond model promises."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from mpad_core.arrays import Array
from mpad_core.interfaces.bonds import BondModel
from mpad_core.numerics.tables import value
from mpad_core.physics.problem import BondSpecies
from mpad_core.physics.reactions import TABLE_ERROR, BondLaw
from mpad_core.testing.claims import check
from mpad_core.testing.samples import REST_LENGTH, THERMAL_ENERGY, Everywhere
from mpad_core.testing.strategies import numbers, tried

_SHARES = st.lists(numbers(0.0, 1.0), min_size=1, max_size=20).map(np.array)
_TENSION, _OFF_RATE, _ON_RATE = 0, 1, 2
_BETWEEN_CHECKS = 1.1  # tables are checked at some points of each cell; between them a cubic may be off by 7 % more
BOTH = pytest.mark.parametrize("compression", ["slack", "linear"])


class BondModelContract:
    """A bond model is an elementwise, finite, pure function of the length, and its tables keep detailed balance.

    Attributes
    ----------
    model
        The bond model; give it in the class that inherits.
    """

    model: BondModel

    @property
    def rest_length(self) -> float:
        """The unstressed length (µm): the model's own, or a usual one that the scene would give."""
        return float(getattr(self.model, "rest_length", REST_LENGTH))

    def law(self, compression: str = "slack") -> BondLaw:
        """Give the model as the core uses it."""
        species = BondSpecies(
            name="contract", site_kind=0, model=self.model, surface=Everywhere(), rest_length=self.rest_length,
            on_rate=84.0, at_density=180.0, reach="overlap", compression=compression,
            kT=float(getattr(self.model, "kT", THERMAL_ENERGY)),
        )  # fmt: skip
        return BondLaw(species=species)

    def lengths(self, shares: Array, compression: str = "slack") -> Array:
        """Turn shares of the tables' range into lengths (µm) at which the model is used."""
        low = self.rest_length if compression == "slack" else self.law(compression).edges()[0]
        high = self.law(compression).edges()[-1]
        # most of them near the rest length, where forces of bonds that matter lie
        return low + (high - low) * shares**4 if compression == "slack" else low + (high - low) * shares

    def test_is_a_bond_model(self) -> None:
        """It has all members, and a name."""
        assert isinstance(self.model, BondModel)
        assert isinstance(self.model.name, str)
        assert self.model.name

    @given(shares=_SHARES)
    @tried(30)
    def test_elementwise(self, shares: Array) -> None:
        """Every element of an array is treated alone, and the shape is kept."""
        lengths = self.lengths(shares)
        for function in (self.model.tension, self.model.off_rate):
            whole = np.asarray(function(lengths))
            assert whole.shape == lengths.shape
            single = np.array([float(function(lengths[i : i + 1])[0]) for i in range(len(lengths))])
            np.testing.assert_allclose(whole, single, rtol=1e-12)
            grid = np.asarray(function(np.stack([lengths, lengths])))
            assert grid.shape == (2, len(lengths))

    @BOTH
    @given(shares=_SHARES)
    @tried(30)
    def test_finite_and_not_negative(self, compression: str, shares: Array) -> None:
        """Tension and off-rate are finite, the off-rate is not negative, over all lengths that a bond can have."""
        lengths = self.lengths(shares, compression)
        assert np.isfinite(self.model.tension(lengths)).all()
        rates = np.asarray(self.model.off_rate(lengths))
        assert np.isfinite(rates).all()
        assert (rates >= 0).all()

    def test_ends_with_a_number(self) -> None:
        """Tables end where the bond breaks at once or is too strong to matter, not where the model stops answering."""
        rest, top = self.rest_length, self.law().edges()[-1]
        with np.errstate(over="ignore"):
            beyond = np.asarray(self.model.off_rate(rest + (top - rest) * np.array([1.0, 1.01])))
        assert not np.isnan(beyond).any(), f"the off-rate is no number just above {top:.4g} um"

    def test_breakpoints_hold_the_rest_length(self) -> None:
        """Without a node at the rest length no table follows the model."""
        points = self.model.breakpoints()
        assert isinstance(points, tuple)
        assert np.isfinite(points).all()
        assert self.rest_length in points

    def test_unstressed_at_the_rest_length(self) -> None:
        """A bond of its rest length does not pull."""
        nearby = self.rest_length * np.array([1.0, 1.01])
        at_rest, stretched = np.abs(self.model.tension(nearby))
        check("no tension at the rest length", "definition of the rest length", 1e-9 * max(stretched, 1e-9), at_rest)

    @BOTH
    @given(shares=_SHARES)
    @tried(20)
    def test_followed_by_tables(self, compression: str, shares: Array) -> None:
        """The compiled loop, which looks the model up in tables, sees the model to one part in a million."""
        law, lengths = self.law(compression), self.lengths(shares, compression)
        tables = law.tables()[0]
        for column, function in ((_TENSION, law.tension), (_OFF_RATE, law.off_rate)):
            looked_up = np.array([value(tables, 0, column, x) for x in lengths])
            truth = function(lengths)
            # a length just above the rest length has lost digits of its own: rounding, not the table
            wrong = np.abs(looked_up - truth) - 1e-10 * np.abs(function(self.lengths(np.ones(1), compression)))
            check("tables follow the model", "relative", _BETWEEN_CHECKS * TABLE_ERROR, _largest(wrong, truth))

    @BOTH
    @given(shares=_SHARES)
    @tried(20)
    def test_detailed_balance(self, compression: str, shares: Array) -> None:
        """On-rate over off-rate falls with the elastic energy as Boltzmann has it, at every length."""
        if hasattr(self.model, "on_rate"):
            pytest.skip("the model brings its own on-rate")
        law = self.law(compression)
        tables, rest = law.tables()[0], self.rest_length
        top = law.reach()
        low = rest if compression == "slack" else max(2 * rest - top, 0.0)
        for x in low + (top - low) * shares:
            on, off = value(tables, 0, _ON_RATE, x), value(tables, 0, _OFF_RATE, x)
            start_on, start_off = value(tables, 0, _ON_RATE, rest), value(tables, 0, _OFF_RATE, rest)
            if not on > 0 or not off > 0 or not start_off > 0 or x >= top:
                continue
            energy = self._energy(law, float(x))
            expected = np.exp(-energy / law.species.kT)
            check(
                "on-rate / off-rate = K exp(-E/kT)", "detailed balance", 1e-5,
                abs(on / off * start_off / start_on / expected - 1),
            )  # fmt: skip

    def _energy(self, law: BondLaw, length: float) -> float:
        """Integrate the tension from the rest length (pN µm), independently of the core."""
        low, high = sorted((self.rest_length, length))
        inner = [b for b in self.model.breakpoints() if low < b < high]
        energy = quad(lambda x: float(law.tension(np.array([x]))[0]), low, high, points=inner or None)[0]
        return float(energy if length >= self.rest_length else -energy)

    def test_own_on_rate(self) -> None:
        """An on-rate of the model's own is elementwise, finite and not negative."""
        own = getattr(self.model, "on_rate", None)
        if own is None:
            pytest.skip("the core derives the on-rate")
        lengths = self.lengths(np.linspace(0, 1, 101))
        rates = np.asarray(own(lengths))
        assert rates.shape == lengths.shape
        assert np.isfinite(rates).all()
        assert (rates >= 0).all()

    def test_pure(self) -> None:
        """Asked again it says the same, and it leaves its input alone."""
        lengths = self.lengths(np.linspace(0, 1, 57))
        lengths.flags.writeable = False  # a model that writes to its input fails here
        first = [np.array(f(lengths)) for f in (self.model.tension, self.model.off_rate)]
        second = [np.array(f(lengths)) for f in (self.model.tension, self.model.off_rate)]
        assert (first[0] == second[0]).all()
        assert (first[1] == second[1]).all()
        assert self.model.breakpoints() == self.model.breakpoints()


def _largest(wrong: Array, truth: Array) -> float:
    """Give the largest relative error; zero must be met by zero."""
    size = np.abs(truth)
    return float(np.max(np.where(wrong <= 0, 0.0, wrong / np.where(size > 0, size, np.finfo(float).tiny))))
