"""Mobilities of touching and nearly touching spheres: positive definite and finite, or refused by name."""

from typing import Any

import numpy as np
import pytest

from clusters import overlapping, pair, ritz_values, stack, tetrahedron, triple
from mpad_core import RefusedError, mobility_matrix, solver
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration
from spheres import grown, stokes_units

LUBRICATED = {"sd": solver("sd"), "cdl-biem": solver("cdl-biem", accuracy=1e-2)}
BARE = {"rpb": solver("rpb"), "rpb, bare": solver("rpb", lone_sphere="blake")}
SOLVERS = LUBRICATED | BARE
GAPS = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3]


def scaled(matrix: Any, radii: Any) -> Any:
    """Give a mobility in Stokes' units, made symmetric, if it is so to rounding or to what was iterated to."""
    units = np.outer(stokes_units(np.array(radii)), stokes_units(np.array(radii)))
    assert np.isfinite(matrix).all()
    assert np.abs((matrix - matrix.T) / units).max() < 1e-7
    return (matrix + matrix.T) / (2 * units)


EXTREME = pytest.param(100.0, marks=[pytest.mark.slow])


@pytest.mark.parametrize("name", SOLVERS)
@pytest.mark.parametrize("ratio", [1.0, 3.0, 10.0, EXTREME])
@pytest.mark.parametrize("cluster", [pair, stack, triple, tetrahedron])
def test_clusters_near_contact_are_definite(name: str, ratio: float, cluster: Any) -> None:
    """At every gap, which all spheres of the cluster have to their neighbours and to the wall."""
    for gap in GAPS:
        centres, radii = cluster(gap, ratio)
        np.linalg.cholesky(scaled(mobility_matrix(SOLVERS[name], centres, radii, viscosity=1.0), radii))


@pytest.mark.parametrize("cluster", [pair, stack, triple, tetrahedron])
def test_touching_clusters_are_definite_or_refused_by_name(cluster: Any) -> None:
    """What lubrication has no answer for is refused; `sd` goes on from its least gap, bare moments feel no contact."""
    centres, radii = cluster(0.0, 1.0)
    for name in ("sd", "rpb, bare"):
        np.linalg.cholesky(scaled(mobility_matrix(SOLVERS[name], centres, radii, viscosity=1.0), radii))
    for name in ("cdl-biem", "rpb"):
        with pytest.raises(RefusedError, match=r"sphere 0: gap 0\.0 µm"):
            mobility_matrix(SOLVERS[name], centres, radii, viscosity=1.0)


def test_touching_spheres_off_the_wall_are_refused_by_name() -> None:
    with pytest.raises(RefusedError, match=r"spheres 0 and 1: gap 0\.0"):
        mobility_matrix(SOLVERS["cdl-biem"], [[0, 0, 3], [2, 0, 3]], 1.0, viscosity=1.0)


LARGE = [
    ("rpb", 40),
    ("rpb, bare", 60),
    ("sd", 12),
    ("cdl-biem", 10),
    pytest.param("rpb", 150, marks=pytest.mark.slow),
    pytest.param("rpb, bare", 150, marks=pytest.mark.slow),
    pytest.param("sd", 20, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("name", "count"), LARGE)
def test_crowds_near_contact_are_definite(name: str, count: int) -> None:
    centres, radii = grown(np.random.default_rng(count), count, 4.0, 1e-6, 1.0)
    np.linalg.cholesky(scaled(mobility_matrix(SOLVERS[name], centres, radii, viscosity=1.0), radii))


@pytest.mark.parametrize("count", [2, 10, 40, pytest.param(150, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("name", "above"), [("rpb", True), ("rpb, bare", True), ("rpb, bare", False)])
def test_overlapping_spheres_have_a_definite_mobility(name: str, above: bool, count: int) -> None:
    """Rotne, Prager and Yamakawa have an answer for spheres that overlap, and the bare one for those the wall cuts."""
    for seed in range(30 if count < 24 else 1):
        centres, radii = overlapping(np.random.default_rng(seed), count, above)
        np.linalg.cholesky(scaled(mobility_matrix(BARE[name], centres, radii, viscosity=1.0), radii))


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    "chosen",
    [*BARE.values(), pytest.param(solver("sd", reach=1.5), marks=pytest.mark.long)],  # twenty-five solves take a minute
    ids=[*BARE, "sd"],
)
def test_a_thousand_spheres_have_a_definite_mobility(chosen: MobilitySolver) -> None:
    """By products, without the matrix."""
    centres, radii = grown(np.random.default_rng(1000), 1000, 1.001, 1e-3, 1.0)
    found = ritz_values(chosen, Configuration(centres=centres, radii=radii), 25)[0]
    print(f"{chosen}: lowest Ritz value {found:.2e}")
    assert found > 0


@pytest.mark.slow
@pytest.mark.parametrize("above", [True, False])
def test_a_thousand_overlapping_spheres_have_a_definite_mobility(above: bool) -> None:
    centres, radii = overlapping(np.random.default_rng(7), 1000, above)
    found = ritz_values(BARE["rpb, bare"], Configuration(centres=centres, radii=radii), 40)[0]
    print(f"above {above}: lowest Ritz value {found:.2e}")
    assert found > 0
