"""What every bond model promises."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from mpad_core.arrays import Array
from mpad_core.interfaces.bonds import BondModel, Interconverting
from mpad_core.interfaces.presets import Preset
from mpad_core.numerics.tables import Tables, value
from mpad_core.physics.problem import BondSpecies
from mpad_core.physics.reactions import NEVER, TABLE_ERROR, BondLaw
from mpad_core.testing.claims import check
from mpad_core.testing.samples import REST_LENGTH, THERMAL_ENERGY, Everywhere, typical
from mpad_core.testing.strategies import numbers, tried

_SHARES = st.lists(numbers(0.0, 1.0), min_size=1, max_size=20).map(np.array)
_TENSION, _OFF_RATE, _ON_RATE, _EXCHANGE = 0, 1, 2, 3
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

    def lengths(self, shares: Array, compression: str = "slack", state: int = 0) -> Array:
        """Turn shares of the range of an inner state's table into lengths (µm) at which the model is used."""
        edges = self.law(compression).edges(state)
        low, high = self.rest_length if compression == "slack" else edges[0], edges[-1]
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
        """Every element of an array is treated alone, and the shape is kept, after the axes of inner states."""
        lengths = self.lengths(shares)
        for function, axes in self._functions():
            whole = np.asarray(function(lengths))
            assert whole.shape == axes + lengths.shape
            single = [np.asarray(function(lengths[i : i + 1]))[..., 0] for i in range(len(lengths))]
            np.testing.assert_allclose(whole, np.stack(single, axis=-1), rtol=1e-12)
            grid = np.asarray(function(np.stack([lengths, lengths])))
            assert grid.shape == (*axes, 2, len(lengths))

    def _functions(self) -> list[tuple[Callable[[Array], Array], tuple[int, ...]]]:
        """Give the model's functions of the length, each with the axes that its inner states add."""
        model = self.model
        if not isinstance(model, Interconverting):
            return [(model.tension, ()), (model.off_rate, ())]
        states = model.states()
        return [(model.tension, ()), (model.off_rate, (states,)), (model.exchange, (states, states))]

    @BOTH
    @given(shares=_SHARES)
    @tried(30)
    def test_finite_and_not_negative(self, compression: str, shares: Array) -> None:
        """Tension and rates are finite, rates are not negative, over all lengths that a bond can have."""
        law = self.law(compression)
        for state in range(law.states()):
            lengths = self.lengths(shares, compression, state)
            assert np.isfinite(self.model.tension(lengths)).all()
            for rates in (law.off_rate(lengths, state), law.exchange(lengths)[state]):
                assert np.isfinite(rates).all()
                assert (rates >= 0).all()

    def test_ends_with_a_number(self) -> None:
        """Tables end where the bond breaks at once or is too strong to matter, not where the model stops answering."""
        law, rest = self.law(), self.rest_length
        for state in range(law.states()):
            top = law.edges(state)[-1]
            with np.errstate(over="ignore"):
                beyond = law.off_rate(rest + (top - rest) * np.array([1.0, 1.01]), state)
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
        law = self.law(compression)
        for state, tables in enumerate(law.tables()):
            lengths, end = self.lengths(shares, compression, state), self.lengths(np.ones(1), compression, state)
            for column, function in self._columns(law, state):
                looked_up = np.array([value(tables, 0, column, x) for x in lengths])
                truth = function(lengths)
                # a length just above the rest length has lost digits of its own: rounding, not the table
                wrong = np.abs(looked_up - truth) - 1e-10 * np.abs(function(end))
                if column != _TENSION:
                    wrong[np.abs(truth) < NEVER] = 0.0  # counted as none
                check("tables follow the model", "relative", _BETWEEN_CHECKS * TABLE_ERROR, _largest(wrong, truth))

    def _columns(self, law: BondLaw, state: int) -> list[tuple[int, Callable[[Array], Array]]]:
        """Give what the columns of a state's table hold, but for the on-rate, which ends at its reach."""
        columns = [(_TENSION, law.tension), (_OFF_RATE, lambda x: law.off_rate(x, state))]
        exchange = [(_EXCHANGE + to, lambda x, to=to: law.exchange(x)[state, to]) for to in range(law.states())]
        return columns + (exchange if law.states() > 1 else [])

    @BOTH
    @given(shares=_SHARES)
    @tried(20)
    def test_detailed_balance(self, compression: str, shares: Array) -> None:
        """On-rate over off-rate falls with the elastic energy as Boltzmann has it, at every length, in each state."""
        if hasattr(self.model, "on_rate"):
            pytest.skip("the model brings its own on-rate")
        law = self.law(compression)
        all_tables, rest, top = law.tables(), self.rest_length, law.reach()
        low = rest if compression == "slack" else max(2 * rest - top, 0.0)
        for x in low + (top - low) * shares:
            if x >= top:
                continue
            affinities = [_affinity(tables, float(x)) for tables in all_tables]
            at_rest = _affinity(all_tables[0], rest)
            if affinities[0] > 0 and at_rest > 0:
                expected = np.exp(-self._energy(law, float(x)) / law.species.kT)
                check(
                    "on-rate / off-rate = K exp(-E/kT)", "detailed balance", 1e-5,
                    abs(affinities[0] / at_rest / expected - 1),
                )  # fmt: skip
            self._check_no_current(all_tables, affinities, float(x))

    def _check_no_current(self, all_tables: list[Tables], affinities: list[float], x: float) -> None:
        """Check that as many bonds go from each inner state to each other as come back, at equilibrium."""
        for state, tables in enumerate(all_tables):
            for other in range(state):
                there = affinities[state] * value(tables, 0, _EXCHANGE + other, x)
                back = affinities[other] * value(all_tables[other], 0, _EXCHANGE + state, x)
                if there > 0 and back > 0:
                    check("exchange between inner states", "detailed balance", 1e-5, abs(there / back - 1))

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
        assert rates.shape == np.asarray(self.model.off_rate(lengths)).shape
        assert np.isfinite(rates).all()
        assert (rates >= 0).all()

    def test_presets_fit(self) -> None:
        """What the model offers by name are its own parameters, and a model can be made of them."""
        for name, preset in getattr(self.model, "presets", {}).items():
            assert isinstance(preset, Preset), name
            assert preset.source, name
            assert isinstance(typical(type(self.model), **preset.parameters), BondModel), name

    def test_pure(self) -> None:
        """Asked again it says the same, and it leaves its input alone."""
        lengths = self.lengths(np.linspace(0, 1, 57))
        lengths.flags.writeable = False  # a model that writes to its input fails here
        first = [np.array(f(lengths)) for f, _ in self._functions()]
        second = [np.array(f(lengths)) for f, _ in self._functions()]
        assert all((one == two).all() for one, two in zip(first, second, strict=True))
        assert self.model.breakpoints() == self.model.breakpoints()


def _affinity(tables: Tables, x: float) -> float:
    """Give the on-rate by the off-rate; zero where either is none."""
    on, off = value(tables, 0, _ON_RATE, x), value(tables, 0, _OFF_RATE, x)
    return on / off if on > 0 and off > 0 else 0.0


def _largest(wrong: Array, truth: Array) -> float:
    """Give the largest relative error; zero must be met by zero."""
    size = np.abs(truth)
    return float(np.max(np.where(wrong <= 0, 0.0, wrong / np.where(size > 0, size, np.finfo(float).tiny))))
