"""Mobilities of `sd` are symmetric and positive definite, whatever the spheres; columns are the matrix's."""

import numpy as np
import pytest

from mpad_core import RefusedError, mobility_matrix
from mpad_core.interfaces.values import Configuration, Setting
from mpad_sd import StokesianDynamics
from spheres import grown, stokes_units

SD = StokesianDynamics()
QUIET = Setting(viscosity=1.0)


def anything(seed):
    """Give one to eight spheres of ratios to 10:1 at gaps of 1e-6 to 2, and whether there is a wall."""
    rng = np.random.default_rng(seed)
    count, wall = int(rng.integers(1, 9)), bool(rng.random() < 0.7)
    return *grown(rng, count, float(rng.choice([1.0, 3.0, 10.0])), 1e-6, 2.0, wall), wall


@pytest.mark.parametrize(
    "seeds",
    [range(10), pytest.param(range(10, 1000), marks=[pytest.mark.long, pytest.mark.timeout(1800)])],
    ids=["some", "a thousand"],
)
def test_mobility_is_symmetric_and_positive(seeds):
    lowest = np.inf
    for seed in seeds:
        centres, radii, wall = anything(seed)
        found = mobility_matrix(SD, centres, radii, viscosity=1.0, wall=wall)
        units = np.outer(stokes_units(radii), stokes_units(radii))
        assert np.abs((found - found.T) / units).max() < 1e-14, seed
        np.linalg.cholesky(found)
        lowest = min(lowest, np.linalg.eigvalsh(found / units)[0])
        assert lowest > 0, seed
    print(f"smallest eigenvalue in Stokes' units: {lowest:.2e}")


@pytest.mark.parametrize("seed", range(8))
def test_single_columns_are_those_of_the_matrix(seed):
    """Columns are solved one by one, and not made symmetric: a reciprocal answer is due to the equations."""
    centres, radii, wall = anything(seed)
    tight = StokesianDynamics(tolerance=1e-10)
    prepared = tight.prepare(tight.plan(Setting(viscosity=1.0, wall=wall)), Configuration(centres=centres, radii=radii))
    size = 6 * len(radii)
    unit, scales = np.eye(size).reshape(-1, 6, size), stokes_units(radii)
    matrix = tight.solve(prepared, unit).velocity.reshape(size, size) / np.outer(scales, scales)
    for k in range(0, size, 5):
        column = tight.solve(prepared, unit[:, :, k]).velocity.ravel() / (scales * scales[k])
        assert column == pytest.approx(matrix[:, k], abs=1e-8)


@pytest.mark.parametrize("seed", [17, 73, 76, 271, 278])
def test_a_reach_too_short_for_the_contacts_is_refused(seed):
    """Two of a hundred such clusters of three or more are not definite with 1.5; none with 4 or more."""
    centres, radii, wall = anything(seed)
    with pytest.raises(RefusedError, match=r"not positive definite with reach 1.5.*closest spheres are \d and \d"):
        mobility_matrix(StokesianDynamics(reach=1.5), centres, radii, viscosity=1.0, wall=wall)
    np.linalg.cholesky(mobility_matrix(SD, centres, radii, viscosity=1.0, wall=wall))
