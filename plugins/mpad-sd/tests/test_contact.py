"""What `sd` refuses, and how it answers for spheres that touch."""

import numpy as np
import pytest

from mpad_core import RefusedError, mobility_matrix
from mpad_core.interfaces.values import Configuration, Setting
from mpad_sd import StokesianDynamics

SD, SHEAR = StokesianDynamics(), Setting(viscosity=1.0, shear_rate=1.0)
NAN, INF = float("nan"), float("inf")
BAD = (
    ([[0, 0, 1.2], [1.9, 0, 1.2]], [1.0, 1.0], "spheres 0 and 1: gap -0.1.*overlap"),
    ([[0, 0, 1.2], [9.0, 0, 1.2], [1.5, 0, 1.2]], [1.0, 1.0, 1.0], "spheres 0 and 2: gap -0.5.*overlap"),
    ([[0, 0, 3.0], [5, 0, 0.9]], [1.0, 1.0], "sphere 1: gap -0.0.*wall"),
    ([[0, 0, 3.0], [5, 0, -4.0]], [1.0, 1.0], "sphere 1: gap -5.*wall"),
    ([[0, 0, 2.0], [NAN, 0, 2.0]], [1.0, 1.0], "sphere 1: centre"),
    ([[0, 0, 2.0], [0, -INF, 2.0]], [1.0, 1.0], "sphere 1: centre"),
    ([[0, 0, 2.0], [0, 0, INF]], [1.0, 1.0], "sphere 1: centre"),
    ([[0, 0, 2.0]], [-1.0], "sphere 0: radius"),
    ([[0, 0, 2.0]], [0.0], "sphere 0: radius"),
    ([[0, 0, 2.0]], [NAN], "sphere 0: radius"),
    ([[0, 0, 2.0]], [INF], "sphere 0: radius"),
)


def prepared(centres, radii, setting=SHEAR, chosen=SD):
    return chosen.prepare(chosen.plan(setting), Configuration(centres=centres, radii=radii))


@pytest.mark.parametrize(("centres", "radii", "says"), BAD)
def test_refuses_what_has_no_answer(centres, radii, says):
    with pytest.raises(RefusedError, match=says):
        prepared(centres, radii)


@pytest.mark.parametrize("gap", [NAN, -0.3, INF, -INF])
def test_refuses_gaps_that_are_none(gap):
    at = Configuration(centres=[[0, 0, 2.0]], radii=[1.0], wall_gaps=[gap])
    with pytest.raises(RefusedError, match="sphere 0: gap"):
        SD.prepare(SD.plan(SHEAR), at)


@pytest.mark.parametrize("bad", [NAN, INF, -INF])
@pytest.mark.parametrize("shape", [(2, 6), (2, 6, 3), (2, 6, 12)])
def test_refuses_loads_that_are_not_finite(bad, shape):
    loads = np.zeros(shape)
    loads[1, 4] = bad
    with pytest.raises(RefusedError, match="loads"):
        prepared([[0, 0, 2.0], [5, 0, 2]], [1.0, 1.0]).solve(loads)


def test_without_a_wall_spheres_may_be_anywhere():
    at = [[0, 0, -3.0], [4, 0, 0]], [1.0, 1.0]
    assert np.isfinite(
        prepared(*at, Setting(viscosity=1.0, shear_rate=1.0, wall=False)).solve(np.ones((2, 6))).velocity
    ).all()


GAPS = [0.0, 1e-12, 1e-10, 1e-8, 1e-7, 0.99e-6, 1e-6, 1.01e-6, 1e-5, 1e-4, 1e-3]


def drained(gap, ratio, wall, chosen=SD):
    """Give the speed at which two spheres, or one and the wall, come apart under a unit pull, at this gap."""
    small = 1 / ratio
    if wall:
        at = Configuration(centres=[[0, 0, small * (1 + gap)]], radii=[small], wall_gaps=[small * gap])
        loads = np.array([[0, 0, 1.0, 0, 0, 0]])
    else:
        at = Configuration(centres=[[0, 0, 3.0], [(1 + small) + small * gap, 0, 3.0]], radii=[1.0, small])
        loads = np.array([[-1.0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0]])
    found = chosen.solve(chosen.prepare(chosen.plan(Setting(viscosity=1.0)), at), loads).velocity
    assert np.isfinite(found).all()
    return found[0, 2] if wall else found[1, 0] - found[0, 0]


@pytest.mark.parametrize("ratio", [1.0, 5.0])
@pytest.mark.parametrize("wall", [True, False])
def test_below_the_least_gap_it_goes_on_as_at_that_gap(ratio, wall):
    """What resists grows as one over the gap down to the least, and stays."""
    speeds = np.array([drained(gap, ratio, wall) for gap in GAPS])
    assert (speeds > 0).all()
    assert (np.diff(speeds) > -1e-5 * speeds[:-1]).all()
    assert speeds[0] == pytest.approx(speeds[4], rel=1e-5)
    assert speeds[-2] == pytest.approx(10 * speeds[-3], rel=0.01)
    assert speeds[0] > 0.3 * speeds[6]


@pytest.mark.parametrize("least_gap", [1e-8, 1e-3])
def test_the_least_gap_is_what_was_asked_for(least_gap):
    chosen = StokesianDynamics(least_gap=least_gap)
    at_it, above = (drained(gap, 1.0, True, chosen) for gap in (least_gap, 10 * least_gap))
    assert drained(0.0, 1.0, True, chosen) == pytest.approx(at_it, rel=1e-6)
    assert above == pytest.approx(10 * at_it, rel=0.05)


@pytest.mark.parametrize("off", [0.0, -4e-10, 4e-10])
def test_spheres_that_touch_up_to_rounding_have_a_definite_mobility(off):
    """Three in a row, each on the wall and against the next."""
    centres = [[(2 + off) * k, 0, 1 + off] for k in range(3)]
    np.linalg.cholesky(mobility_matrix(SD, centres, 1.0, viscosity=1.0))
