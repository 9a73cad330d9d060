"""What every surface promises."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mpad_core.arrays import Array
from mpad_core.interfaces.surface import Resolving, Surface
from mpad_core.testing.strategies import numbers, tried

_PLACES = st.lists(st.tuples(numbers(-1e4, 1e4), numbers(-1e4, 1e4)), min_size=1, max_size=20).map(np.array)


class SurfaceContract:
    """A surface's density is elementwise, finite, not negative, and nowhere above its bound.

    Attributes
    ----------
    surface
        The surface; give it in the class that inherits.
    """

    surface: Surface

    def test_is_a_surface(self) -> None:
        """It has all members, and a name."""
        assert isinstance(self.surface, Surface)
        assert self.surface.name

    @given(places=_PLACES)
    @tried(50)
    def test_bounded(self, places: Array) -> None:
        """The density lies between zero and the bound: draws against the bound must be chances."""
        densities = np.asarray(self.surface.density(places[:, 0], places[:, 1]))
        assert np.isfinite(densities).all()
        assert (densities >= 0).all()
        assert (densities <= self.surface.densest()).all()

    @given(places=_PLACES)
    @tried(30)
    def test_elementwise(self, places: Array) -> None:
        """Every place is treated alone, and the shape is kept."""
        x, y = places[:, 0], places[:, 1]
        whole = np.asarray(self.surface.density(x, y))
        assert whole.shape == x.shape
        single = np.array([float(self.surface.density(x[i : i + 1], y[i : i + 1])[0]) for i in range(len(x))])
        np.testing.assert_allclose(whole, single, rtol=1e-12)
        grid = np.asarray(self.surface.density(x[:, None], y[None, :]))
        assert grid.shape == (len(x), len(x))

    def test_bound_is_a_number(self) -> None:
        """The bound is finite and not negative."""
        assert np.isfinite(self.surface.densest())
        assert self.surface.densest() >= 0

    @given(places=_PLACES)
    @tried(30)
    def test_resolution(self, places: Array) -> None:
        """If it says how finely it varies, that is a length; an infinite one means that it does not vary at all."""
        if not isinstance(self.surface, Resolving):
            return
        assert self.surface.resolution() > 0
        if np.isinf(self.surface.resolution()):
            densities = np.asarray(self.surface.density(places[:, 0], places[:, 1]))
            assert (densities == densities[0]).all()

    def test_pure(self) -> None:
        """Asked again it says the same, and it leaves its input alone."""
        x, y = np.linspace(-100, 100, 57), np.linspace(-30, 70, 57)
        x.flags.writeable = y.flags.writeable = False
        assert (np.asarray(self.surface.density(x, y)) == np.asarray(self.surface.density(x, y))).all()
