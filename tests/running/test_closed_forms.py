"""The closed forms that the laws are tested against, with figures worked out on other ways."""

import numpy as np
import pytest

from adhesion import CatchSlip, Ramp, cluster_lifetime, fall_time, hazard_under_ramp


@pytest.mark.parametrize(
    ("number", "force", "rebinding", "expected"),
    [
        (2, 0, 0, 1.5), (10, 0, 0, 2.9289683), (10, 0, 1, 118.65397), (10, 5, 0, 0.58961975), (10, 5, 1, 0.82105707),
        (10, 2, 1, 4.534576), (2, 1, 1, 0.78270985), (5, 1, 0.5, 1.7861301), (100, 25, 1, 16.196775),
        (100, 30, 1, 2.9308656),
    ],
)  # fmt: skip
def test_lifetimes_of_clusters(number: int, force: float, rebinding: float, expected: float) -> None:
    """Figures of the sum over products, and of a linear solve."""
    assert cluster_lifetime(number, force, rebinding) == pytest.approx(expected, rel=1e-7)
    i = np.arange(1, number + 1)
    off, on = i * np.exp(force / i), rebinding * (number - i)
    generator = np.diag(-(off + on)) + np.diag(off[1:], -1) + np.diag(on[:-1], 1)
    assert np.linalg.solve(generator, -np.ones(number))[-1] == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize(
    ("loading", "mode", "mean", "deviation"),
    [(10, 0, 5.963, 4.199), (100, 23.03, 20.15, 9.115), (1e3, 46.05, 40.79, 11.81), (1e4, 69.08, 63.38, 12.62)],
)
def test_rupture_forces(loading: float, mode: float, mean: float, deviation: float) -> None:
    ramp = Ramp(1.0, 10.0, loading)
    assert ramp.mode == pytest.approx(mode, abs=5e-3)
    assert ramp.mean == pytest.approx(mean, rel=3e-4)
    assert ramp.deviation == pytest.approx(deviation, rel=3e-4)
    forces = np.array([1.0, 30.0, 80.0])
    by_quadrature = hazard_under_ramp(lambda f: np.exp(f / 10), loading, forces)
    assert by_quadrature == pytest.approx(ramp.used(forces), rel=1e-6)


def test_rupture_forces_of_p_selectin() -> None:
    scale = 4.114e-3 / 0.39e-4
    slow, fast = Ramp(2.4, scale, 1e3), Ramp(2.4, scale, 1e4)
    assert (slow.mode, slow.mean) == pytest.approx((144.9, 140.6), abs=0.1)
    assert (fast.mode, fast.mean) == pytest.approx((387.8, 338.0), abs=0.1)


def test_the_catch_slip_bond_lives_longest_at_its_peak() -> None:
    """8.3 ms without force, 0.76 s at 11.7 pN."""
    bond = CatchSlip(4.11e-3)
    forces = np.linspace(0, 40, 4001)
    lives = 1 / bond.at_force(forces)
    assert lives[0] == pytest.approx(8.3e-3, abs=0.05e-3)
    assert lives.max() == pytest.approx(0.76, abs=5e-3)
    assert forces[lives.argmax()] == pytest.approx(11.7, abs=0.1)


@pytest.mark.parametrize(("high", "expected"), [(1.0, 2.90), (5.0, 7.61)])
def test_fall_times(high: float, expected: float) -> None:
    weight = 4 / 3 * np.pi * 125 * 50e-12 * 9.81e6
    assert fall_time(high, 0.255, 5.0, 1e-3, weight) == pytest.approx(expected, abs=0.006)
