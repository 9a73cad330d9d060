"""Configurations that the strategies draw are fit to be solved."""

import numpy as np
from hypothesis import given

from mpad_core.interfaces.values import Configuration
from mpad_core.testing.strategies import configurations, crowd, tried


def fit(at: Configuration) -> None:
    assert (at.wall_gaps > 0).all()
    np.testing.assert_allclose(at.wall_gaps, at.centres[:, 2] - at.radii)
    apart = np.linalg.norm(at.centres[:, None] - at.centres[None], axis=2) - at.radii[:, None] - at.radii[None]
    np.fill_diagonal(apart, np.inf)
    assert apart.min() > 0


class TestStrategies:
    @given(at=configurations(fewest=2, most=6))
    @tried(100)
    def test_no_contact(self, at: Configuration) -> None:
        assert 2 <= len(at.radii) <= 6
        fit(at)

    @given(at=configurations(unequal=False))
    @tried(20)
    def test_equal_radii(self, at: Configuration) -> None:
        assert np.ptp(at.radii) == 0
        fit(at)

    def test_crowd(self) -> None:
        fit(crowd(30))
        assert len(crowd(30, unequal=False).radii) == 30
