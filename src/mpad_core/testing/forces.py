"""What every force law between two roughness layers promises."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mpad_core.arrays import Array
from mpad_core.interfaces.forces import GapForce
from mpad_core.numerics.tables import tabulate, value, value_and_slope
from mpad_core.testing.claims import check
from mpad_core.testing.strategies import numbers, tried

_SHARES = st.lists(numbers(0.0, 1.0), min_size=1, max_size=20).map(np.array)
_ERROR = 1e-6  # what the core asserts of its tables, at some points of each cell


class GapForceContract:
    """A force law is an elementwise, finite, pure function of the gap that ends where it says.

    Attributes
    ----------
    force
        The force law; give it in the class that inherits.
    """

    force: GapForce

    def gaps(self, shares: Array) -> Array:
        """Turn shares of the law's range into gaps (µm)."""
        low, high = self.force.gaps()
        return low + (high - low) * shares**3

    def test_is_a_force_law(self) -> None:
        """It has all members, and a name."""
        assert isinstance(self.force, GapForce)
        assert self.force.name

    def test_range(self) -> None:
        """The gap below which the tangent takes over is smaller than the one above which there is no force."""
        low, high = self.force.gaps()
        assert np.isfinite([low, high]).all()
        assert low < high

    @given(shares=_SHARES)
    @tried(30)
    def test_elementwise_and_finite(self, shares: Array) -> None:
        """Every element is treated alone; shapes are kept; all is finite."""
        gaps = self.gaps(shares)
        whole = np.asarray(self.force.force(gaps))
        assert whole.shape == gaps.shape
        assert np.isfinite(whole).all()
        single = np.array([float(self.force.force(gaps[i : i + 1])[0]) for i in range(len(gaps))])
        np.testing.assert_allclose(whole, single, rtol=1e-12)

    def test_ends_in_nothing(self) -> None:
        """At the largest gap the force has become negligible, since the core takes it as zero beyond."""
        forces = np.abs(self.force.force(self.gaps(np.linspace(0, 1, 1001))))
        check("the force vanishes at the largest gap", "interface", 1e-6, float(forces[-1] / forces.max()))

    def test_keeps_surfaces_apart(self) -> None:
        """At the smallest gap the force pushes and grows as the gap closes, so its tangent pushes ever harder below."""
        low, high = self.force.gaps()
        at, above = self.force.force(low + (high - low) * np.array([0.0, 1e-6]))
        assert at > 0
        assert above <= at

    @given(shares=_SHARES)
    @tried(30)
    def test_followed_by_a_table(self, shares: Array) -> None:
        """The compiled loop's table follows the law to one part in a million."""
        low, high = self.force.gaps()
        table = tabulate([self.force.force], [low, high], error=_ERROR, tangents=[0])
        gaps = self.gaps(shares)
        truth = np.asarray(self.force.force(gaps))
        found = np.array([value(table, 0, 0, gap) for gap in gaps])
        check("the table follows the law", "relative", 1.1 * _ERROR, float(np.max(np.abs(found / truth - 1))))

    def test_tangent_below(self) -> None:
        """Below its range the law goes on along its tangent."""
        low, high = self.force.gaps()
        table = tabulate([self.force.force], [low, high], error=_ERROR, tangents=[0])
        at, slope = value_and_slope(table, 0, 0, low)
        below = low - 0.1 * (high - low)
        assert value(table, 0, 0, below) >= at
        np.testing.assert_allclose(value(table, 0, 0, below), at + slope * (below - low), rtol=1e-9)

    def test_pure(self) -> None:
        """Asked again it says the same, and it leaves its input alone."""
        gaps = self.gaps(np.linspace(0, 1, 57))
        gaps.flags.writeable = False
        assert (np.asarray(self.force.force(gaps)) == np.asarray(self.force.force(gaps))).all()
