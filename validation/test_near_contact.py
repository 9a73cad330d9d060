"""Mobilities of touching and nearly touching spheres: positive definite and finite, or refused by name."""

from typing import Any

import numpy as np
import pytest

from mpad_core import RefusedError, mobility_matrix, solver
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration, Setting
from spheres import grown, stokes_units

LUBRICATED = {"sd": solver("sd"), "cdl-biem": solver("cdl-biem", accuracy=1e-2)}
BARE = {"rpb": solver("rpb"), "rpb, bare": solver("rpb", lone_sphere="blake")}
SOLVERS = LUBRICATED | BARE
GAPS = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3]


def pair(gap: float, ratio: float) -> tuple[Any, Any]:
    """Two side by side on the wall."""
    small = 1 / ratio
    heights, reach = np.array([1.0, small]) * (1 + gap), 1 + small + gap * small
    return [[0, 0, heights[0]], [np.sqrt(reach**2 - np.ptp(heights) ** 2), 0, heights[1]]], [1.0, small]


def stack(gap: float, ratio: float) -> tuple[Any, Any]:
    """Three upon each other above the wall, the largest lowest."""
    radii = np.array([1.0, ratio**-0.5, 1 / ratio])
    gaps = gap * np.minimum(radii, np.roll(radii, 1))
    heights = np.cumsum(2 * radii + np.r_[gap, gaps[1:]]) - radii
    return np.column_stack([0 * heights, 0 * heights, heights]), radii


def triple(gap: float, ratio: float) -> tuple[Any, Any]:
    """Two large ones on the wall, and a small one on it, in the corner between them."""
    centres, radii = pair(gap, 1.0)
    small = 1 / ratio
    height, reach = small * (1 + gap), 1 + small * (1 + gap)
    middle, across = np.mean(centres, axis=0), reach**2 - (1 + gap - height) ** 2 - (1 + gap / 2) ** 2
    if across > 0:
        return [*centres, [middle[0], np.sqrt(across), height]], [*radii, small]
    return [*centres, [middle[0], 0, middle[2] + np.sqrt(reach**2 - (1 + gap / 2) ** 2)]], [*radii, small]


def tetrahedron(gap: float, ratio: float) -> tuple[Any, Any]:
    """Three on the wall and against each other, and one upon them, or upon the first if it would fall through."""
    s, h, small = 2 + gap, 1 + gap, 1 / ratio
    reach, low = 1 + small * (1 + gap), [[0, 0, h], [s, 0, h], [s / 2, s * np.sqrt(0.75), h]]
    rise = reach**2 - s**2 / 3
    top = [s / 2, s / np.sqrt(12), h + np.sqrt(rise)] if rise > 0 else [0, 0, h + reach]
    return [*low, top], [1.0, 1.0, 1.0, small]


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


def overlapping(rng: np.random.Generator, count: int, above: bool) -> tuple[Any, Any]:
    """Spheres thrown into a box that is half as wide as they would need, above the wall or cut by it."""
    radii, side = rng.uniform(0.3, 1.0, count), 1.5 * np.cbrt(count)
    low = radii * 10 ** rng.uniform(-6, 0, count) if above else -0.99 * radii * rng.random(count)
    heights = np.where(rng.random(count) < 0.3, radii + low, radii + 0.01 + side * rng.random(count))
    return np.column_stack([side * rng.random((count, 2)), heights]), radii


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


def lowest(chosen: MobilitySolver, at: Configuration, steps: int) -> float:
    """Give the lowest Ritz value of the mobility in Stokes' units from so many steps of Lanczos."""
    prepared, units = chosen.prepare(chosen.plan(Setting(viscosity=1.0)), at), stokes_units(at.radii)

    def product(x: Any) -> Any:
        return chosen.solve(prepared, (x / units).reshape(-1, 6)).velocity.ravel() / units

    vectors, triangle = np.empty((steps + 1, len(units))), np.zeros((steps, steps))
    start = np.random.default_rng(0).normal(size=len(units))
    vectors[0] = start / np.linalg.norm(start)
    for k in range(steps):
        new = product(vectors[k])
        for _ in range(2):  # once leaves what rounding has put back
            along = vectors[: k + 1] @ new
            new -= along @ vectors[: k + 1]
            triangle[k, : k + 1] += along
        vectors[k + 1] = new / np.linalg.norm(new)
    return float(np.linalg.eigvalsh(triangle)[0])  # reads the lower triangle


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
    found = lowest(chosen, Configuration(centres=centres, radii=radii), 25)
    print(f"{chosen}: lowest Ritz value {found:.2e}")
    assert found > 0


@pytest.mark.slow
@pytest.mark.parametrize("above", [True, False])
def test_a_thousand_overlapping_spheres_have_a_definite_mobility(above: bool) -> None:
    centres, radii = overlapping(np.random.default_rng(7), 1000, above)
    found = lowest(BARE["rpb, bare"], Configuration(centres=centres, radii=radii), 40)
    print(f"above {above}: lowest Ritz value {found:.2e}")
    assert found > 0
