"""The spectral CDL-BIEM solver against exact and converged solutions: accuracy, symmetry, iterations, refusals."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from mpad_cdlbiem import CdlBiem
from mpad_core import RefusedError, mobility_matrix, velocities
from mpad_core.interfaces.values import Configuration, Setting

REFERENCE = json.loads((Path(__file__).parent / "data" / "spectral_reference.json").read_text())
PAIRS = json.loads((Path(__file__).parents[3] / "tests" / "data" / "pair_reference.json").read_text())["pairs"]
CLOSEST = {"accuracy": 1e-8, "tolerance": 1e-11}  # with a high degree: lubrication wherever that does not resolve


def prepared(centres, radii, *, gaps=None, shear=1.0, wall=True, guess=None, **parameters):
    given = {} if gaps is None else {"wall_gaps": gaps}
    solver = CdlBiem(**parameters)
    plan = solver.plan(Setting(viscosity=1.0, shear_rate=shear, wall=wall))
    return solver.prepare(plan, Configuration(centres=centres, radii=radii, **given), guess)


def motion(centres, radii, loads=None, **how):
    return prepared(centres, radii, **how).solve(np.zeros((len(radii), 6)) if loads is None else loads)


def mobility(centres, radii, **how):
    size = 6 * len(radii)
    found = motion(centres, radii, np.eye(size).reshape(-1, 6, size), shear=0.0, **how)
    return found.velocity.reshape(size, size)


def velocity_error(found, true, radii):
    """Relative 2-norm error of (U, aΩ)."""
    weights = np.column_stack([np.ones_like(radii), radii]).repeat(3, axis=1)
    found, true = (weights * np.reshape(values, (-1, 6)) for values in (found, true))
    return np.linalg.norm(found - true) / np.linalg.norm(true)


def energy_error(found, true):
    """Largest |eigenvalue| of M_ref^-1/2 (M - M_ref) M_ref^-1/2."""
    return np.abs(eigh(found + found.T - true - true.T, true + true.T, eigvals_only=True)).max()


def full(upper, size=12):
    matrix = np.zeros((size, size))
    matrix[np.triu_indices(size)] = upper
    return matrix + np.triu(matrix, 1).T


def by_id(case):
    return case["id"]


@pytest.mark.parametrize("row", REFERENCE["sphere_and_wall"], ids=lambda row: f"height {row[0]}")
def test_sphere_and_wall_table(row):
    """Resistances of Goldman, Cox and Brenner (1967) at the table's rounded heights, to the last digit printed."""
    height = float(row[0])
    at = {"centres": [[0, 0, height]], "radii": [1.0], "tolerance": 1e-12}
    resistance, free = np.linalg.inv(mobility(**at)), motion(**at).velocity[0]
    shear = resistance @ free
    parts = (
        *(resistance[0, 0] / 6, abs(resistance[4, 0]) / 8, abs(resistance[0, 4]) / 6, resistance[4, 4] / 8),
        *(resistance[2, 2] / 6, resistance[5, 5] / 8, shear[0] / (6 * height), shear[4] / 4),
    )
    found = [*(part / np.pi for part in parts), free[0] / height, 2 * free[4]]
    for value, printed in zip(found, row[1:], strict=True):
        mantissa, _, exponent = printed.partition("e")
        rounding = 0.51 * 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
        assert value == pytest.approx(float(printed), rel=1e-7, abs=rounding)


@pytest.mark.parametrize("case", REFERENCE["single"], ids=by_id)
def test_sphere_and_wall_from_touching_to_far_away(case):
    at = {"centres": case["x"], "radii": [1.0], "gaps": [case["gap"]], "tolerance": 1e-10}
    assert energy_error(mobility(**at), full(case["M_upper"], 6)) < 1e-7
    assert velocity_error(motion(**at).velocity, case["V_shear"], [1.0]) < 1e-7


@pytest.mark.parametrize("case", PAIRS, ids=by_id)
def test_unbounded_pairs_are_exact_at_any_ratio(case):
    """Lubrication makes the low degrees exact."""
    a, b = case["a"]
    centres = np.outer([0.0, a + b + case["gap12"]], case["direction"])
    at = {"radii": [a, b], "wall": False, "tolerance": 1e-12}
    true = np.array(case["M"])
    assert energy_error(mobility(centres, **at, degree=8, accuracy=1e-8), true) < 1e-10
    for how, bar in (({"degree": 8, "accuracy": 1e-8}, 1e-10), ({}, 1e-3)):
        assert velocity_error(motion(centres, **at, **how).velocity, case["V_shear"], [a, b]) < bar
    assert energy_error(mobility(centres, **at), true) < 1e-2


def at_equal_gaps(gap):
    return {"centres": [[0, 0, 1 + gap], [2 + gap, 0, 1 + gap]], "radii": [1.0, 1.0], "gaps": [gap, gap]}


def of_table(row):
    gap, along, up, spin, certain = row
    return gap, np.array([[along, 0, up, 0, spin, 0], [along, 0, -up, 0, spin, 0]]), certain


@pytest.mark.parametrize("row", REFERENCE["equal_gaps"], ids=lambda row: f"gap {row[0]}")
def test_two_spheres_and_wall_at_equal_gaps(row):
    gap, true, certain = of_table(row)
    for accuracy, least_gap, bar in ((1e-3, 0.0, 1.5e-3), (1e-4, 0.05, 1e-4), (1e-6, 0.3, 1e-6)):
        if gap >= least_gap:
            found = motion(**at_equal_gaps(gap), accuracy=accuracy)
            assert velocity_error(found.velocity, true, [1.0, 1.0]) < bar + certain


@pytest.mark.parametrize("row", REFERENCE["equal_gaps"], ids=lambda row: f"gap {row[0]}")
def test_degree_converges_to_the_independent_solutions(row):
    gap, true, certain = of_table(row)
    for degree, bar in ((4, 1e-2), (8, 1e-3), (16, 5e-4), (32, 1e-4 if gap < 0.05 else 1e-7)):
        found = motion(**at_equal_gaps(gap), degree=degree, **CLOSEST)
        assert velocity_error(found.velocity, true, [1.0, 1.0]) < bar + certain, degree


MISSED = {  # accuracy 1e-3, gaps: what is measured where the bar is missed
    "stacked 0.02 0.02": "energy 1.3e-2, bar 1e-2",
}


def marked(case):
    missed = MISSED.get(case["id"])
    marks = [pytest.mark.xfail(strict=True, reason=missed)] if missed else []
    return pytest.param(case, id=case["id"], marks=marks)


@pytest.mark.parametrize("case", [marked(case) for case in REFERENCE["any_orientation"]])
def test_two_spheres_and_wall_in_any_orientation(case):
    at = {"centres": case["x"], "radii": [1.0, 1.0], "gaps": case["wall_gaps"]}
    gap, true = min(map(float, case["id"].split()[1:])), full(case["M_upper"])
    for accuracy, least_gap, bars in (
        (1e-3, 0.0, (1.5e-3, 1e-2)),
        (1e-4, 0.05, (1e-4, 1e-3)),
        (1e-6, 0.3, (1e-6, 1e-5)),
    ):
        if gap >= least_gap:
            found = motion(**at, accuracy=accuracy)
            assert velocity_error(found.velocity, case["V_shear"], [1.0, 1.0]) < bars[0]
            assert energy_error(mobility(**at, accuracy=accuracy), true) < bars[1]


@pytest.mark.parametrize("case", REFERENCE["fundamental_solutions"], ids=by_id)
def test_spheres_of_any_radii_against_fundamental_solutions(case):
    radii = np.array(case["a"])
    at = {"centres": case["x"], "radii": radii, "gaps": radii * case["gaps"]}
    true = full(case["M_upper"], 6 * len(radii))
    for accuracy, velocity_bar, energy_bar in ((1e-3, 1e-3, 1e-2), (1e-4, 1e-4, 1e-3)):
        found = motion(**at, accuracy=accuracy)
        assert velocity_error(found.velocity, case["V_shear"], radii) < velocity_bar
        assert energy_error(mobility(**at, accuracy=accuracy), true) < energy_bar
    best = motion(**at, degree=32, **CLOSEST)
    assert velocity_error(best.velocity, case["V_shear"], radii) < 1e-6
    assert energy_error(mobility(**at, degree=32, **CLOSEST), true) < 2e-5


def tetrahedron(gap):
    """Three spheres at one gap from the wall, a fourth upon them, all at that gap from each other."""
    s, h = 2 + gap, 1 + gap
    low = [[0, 0, h], [s, 0, h], [s / 2, s * np.sqrt(0.75), h]]
    centres = np.array([*low, [s / 2, s / np.sqrt(12), h + s * np.sqrt(2 / 3)]])
    return {"centres": centres, "radii": np.ones(4), "gaps": centres[:, 2] - 1}


def square(gap):
    s, h = 2 + gap, 1 + gap
    return {"centres": np.array([[0, 0, h], [s, 0, h], [0, s, h], [s, s, h]]), "radii": np.ones(4), "gaps": [gap] * 4}


@pytest.mark.parametrize("cluster", [tetrahedron, square])
@pytest.mark.parametrize("gap", [0.05, 0.02, 0.01])
def test_four_spheres_near_each_other(cluster, gap):
    at = cluster(gap)
    true = motion(**at, degree=40, **CLOSEST).velocity
    assert velocity_error(motion(**at, accuracy=1e-3).velocity, true, at["radii"]) < 2e-3
    assert velocity_error(motion(**at, accuracy=1e-4).velocity, true, at["radii"]) < 1e-3


def corner(small, gap):
    """Give a small sphere in the corner between a sphere of radius 1 and the wall, all gaps in small radii."""
    gap, reach = small * gap, 1 + small + small * gap
    heights = np.array([1 + gap, small + gap])
    across = np.sqrt(reach**2 - (heights[0] - heights[1]) ** 2)
    return {"centres": [[0, 0, heights[0]], [0.8 * across, 0.6 * across, heights[1]]], "radii": [1.0, small]}


@pytest.mark.parametrize("gap", [0.05, 0.01])
def test_ten_times_smaller_sphere_in_the_corner(gap):
    at = corner(0.1, gap)
    found, true = motion(**at).velocity, motion(**at, degree=80, **CLOSEST).velocity
    assert velocity_error(found, true, at["radii"]) < 1e-2
    assert velocity_error(found[1:], true[1:], at["radii"][1:]) < 1e-2


UPWARD, SIDEWAYS = (2, -3, 6), (1, 0.2, -0.3)


@pytest.mark.parametrize(
    ("gap", "direction"),
    [(1.0, UPWARD), (3.0, UPWARD), (5.0, UPWARD), (8.0, SIDEWAYS), (30.0, SIDEWAYS), (100.0, UPWARD)],
)
def test_hundred_times_smaller_sphere_beside_one_at_the_wall(gap, direction):
    """Gaps in small radii; the large sphere is at 0.02 of its own from the wall."""
    reach = (1.01 + 0.01 * gap) / np.linalg.norm(direction)
    centre = np.array([0, 0, 1.02])
    at = {"centres": np.array([centre, centre + reach * np.array(direction)]), "radii": [1.0, 0.01]}
    true = motion(**at, degree=90, **CLOSEST).velocity
    assert velocity_error(motion(**at).velocity[1:], true[1:], [0.01]) < 1e-3


@pytest.mark.parametrize("held", [(), (0,)], ids=["free", "held"])
def test_tiny_sphere_obeys_faxens_law(held):
    """U = (1 + a²/6 ∇²) u and Ω = curl u/2 of the flow about the cell alone; radii 5 and 0.05 µm."""
    a, point = 0.05, np.array([14.0, 6.0, 9.0])
    cell = prepared([[0, 0, 5.3]], [5.0], accuracy=1e-8, tolerance=1e-12)
    still = cell.solve(np.zeros((1, 6)))
    if held:
        bare = mobility([[0, 0, 5.3]], [5.0], tolerance=1e-12)
        still = cell.solve(-np.linalg.solve(bare, still.velocity[0])[None])
    u = cell.flow(still, point + 0.05 * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)]))
    gradient = (u[1:4] - u[4:]) / 0.1
    laplacian = (u[1:].sum(axis=0) - 6 * u[0]) / 0.05**2
    curl = [gradient[1, 2] - gradient[2, 1], gradient[2, 0] - gradient[0, 2], gradient[0, 1] - gradient[1, 0]]
    solver = CdlBiem(accuracy=1e-8, tolerance=1e-10)
    found = velocities(solver, [[0, 0, 5.3], point], [5.0, a], viscosity=1.0, shear_rate=1.0, held=held)
    assert found[1, :3] == pytest.approx(u[0] + a**2 / 6 * laplacian, abs=2e-6)
    assert found[1, 3:] == pytest.approx(np.array(curl) / 2, abs=2e-6)
    assert found[0] == pytest.approx(still.velocity[0], abs=1e-6)


def crowd(count, rng, low, high):
    """Give spheres grown one upon another, each at a gap between low and high from another, half so from the wall."""
    centres, radii = np.empty((0, 3)), np.empty(0)
    while len(radii) < count:
        a = rng.uniform(0.7, 1.4)
        wall, between = a * np.exp(rng.uniform(np.log(low), np.log(high), 2))
        centre = np.array([0, 0, a + wall])
        if len(radii):
            j = rng.integers(len(radii))
            offset = rng.normal(size=3)
            reach = a + radii[j] + between
            offset *= reach / np.linalg.norm(offset)
            if rng.random() < 0.5 and abs(a + wall - centres[j, 2]) < reach:
                offset[2] = a + wall - centres[j, 2]
                offset[:2] *= np.sqrt(reach**2 - offset[2] ** 2) / np.linalg.norm(offset[:2])
            centre = centres[j] + offset
        apart = np.linalg.norm(centres - centre, axis=1) - radii - a
        if centre[2] - a > 0.9 * low and (apart > 0.9 * low).all():
            centres, radii = np.vstack([centres, centre]), np.append(radii, a)
    return centres, radii


@pytest.mark.parametrize(
    "count", [2, 4, 8, pytest.param(20, marks=pytest.mark.slow), pytest.param(50, marks=pytest.mark.long)]
)
@pytest.mark.parametrize("wall", [True, False])
def test_mobility_is_symmetric_and_positive(count, wall):
    """Gaps of 1e-6 to 1e-1 radii, anywhere between."""
    centres, radii = crowd(count, np.random.default_rng(count), 1e-6, 0.1)
    solver = CdlBiem(accuracy=1e-2 if count > 8 else 1e-3)
    found = mobility_matrix(solver, centres, radii, viscosity=1.0, wall=wall)
    assert np.abs(found - found.T).max() < 1e-7 * np.abs(found).max()
    unit = 1 / np.sqrt(np.diag(found))
    assert np.linalg.eigvalsh((found + found.T) / 2 * np.outer(unit, unit)).min() > 0


def test_superposition():
    centres, radii = crowd(3, np.random.default_rng(3), 1e-2, 1.0)
    ready = prepared(centres, radii, tolerance=1e-12)
    loads, mix = np.cos(np.arange(54.0)).reshape(3, 6, 3), np.array([2.0, -1.0, 0.5])
    still, block = ready.solve(np.zeros((3, 6))).velocity, ready.solve(loads).velocity
    for k in range(3):
        assert ready.solve(loads[:, :, k]).velocity == pytest.approx(block[:, :, k], abs=1e-9)
    mixed = still + (block - still[:, :, None]) @ mix
    assert ready.solve(loads @ mix).velocity == pytest.approx(mixed, abs=1e-9)


def test_reversed_flow_and_loads_reverse_the_motion():
    centres, radii = crowd(4, np.random.default_rng(4), 1e-3, 1.0)
    loads = np.sin(np.arange(24.0)).reshape(4, 6)
    there, back = (motion(centres, radii, s * loads, shear=2.0 * s, tolerance=1e-12).velocity for s in (1.0, -1.0))
    assert back == pytest.approx(-there, abs=1e-10)


@pytest.mark.parametrize("axis", [0, 1])
def test_mirror_images_move_as_mirror_images(axis):
    centres, radii = crowd(4, np.random.default_rng(5), 1e-3, 1.0)
    mirror = np.ones(3)
    mirror[axis] = -1.0
    flip = np.concatenate([mirror, -mirror])  # angular velocity is an axial vector
    loads = np.sin(np.arange(24.0)).reshape(4, 6)
    found = motion(centres, radii, loads, tolerance=1e-12).velocity
    seen = motion(centres * mirror, radii, loads * flip, shear=mirror[0], tolerance=1e-12).velocity
    assert seen == pytest.approx(found * flip, abs=1e-9)


def test_turned_and_renumbered_spheres_move_likewise():
    centres, radii = crowd(4, np.random.default_rng(6), 1e-3, 1.0)
    c, s, order = np.cos(0.7), np.sin(0.7), np.array([2, 0, 3, 1])
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    loads, how = np.sin(np.arange(24.0)).reshape(4, 2, 3), {"shear": 0.0, "tolerance": 1e-12}
    found = motion(centres, radii, loads.reshape(4, 6), **how).velocity.reshape(4, 2, 3)
    turned = motion((centres @ turn.T)[order], radii[order], (loads @ turn.T)[order].reshape(4, 6), **how).velocity
    assert turned.reshape(4, 2, 3) == pytest.approx((found @ turn.T)[order], abs=1e-9)


def test_held_sphere_stands_still_and_its_constraint_does_it():
    at = at_equal_gaps(0.02)
    solver = CdlBiem(tolerance=1e-10)
    found = velocities(solver, at["centres"], at["radii"], viscosity=1.0, shear_rate=1.0, held=[0])
    resistance = np.linalg.inv(mobility(**at, tolerance=1e-10))
    free = motion(**at, tolerance=1e-10).velocity.ravel()
    # the loads on the free sphere are zero: R (V - V_free) = 0 there
    true = free[6:] + np.linalg.solve(resistance[6:, 6:], resistance[6:, :6] @ free[:6])
    assert not found[0].any()
    assert found[1] == pytest.approx(true, abs=1e-7)


ONE_MORE = pytest.mark.xfail(strict=True, reason="41 iterations")
BARS = [(square, 0.3, 12), (square, 1e-3, 40), (tetrahedron, 0.3, 12)]


@pytest.mark.parametrize(("cluster", "gap", "most"), [*BARS, pytest.param(tetrahedron, 1e-3, 40, marks=ONE_MORE)])
def test_iterations_from_scratch(cluster, gap, most):
    assert motion(**cluster(gap)).report.iterations <= most


MANY = pytest.mark.xfail(strict=True, reason="17 to 29 iterations: cold 28 to 41, the guess is worth only three digits")


FEW = [(square, 0.3), (square, 0.05), (square, 0.01), (square, 1e-3), (tetrahedron, 0.3)]
STUCK = [pytest.param(tetrahedron, gap, marks=MANY) for gap in (0.05, 0.01, 1e-3)]


@pytest.mark.parametrize(("cluster", "gap"), FEW + STUCK)
def test_iterations_after_a_step(cluster, gap):
    """Each sphere goes 1e-3 radii along its own velocity."""
    at = cluster(gap)
    before = motion(**at)
    step = 1e-3 * before.velocity[:, :3] / np.linalg.norm(before.velocity[:, :3], axis=1).max()
    at["centres"], at["gaps"] = at["centres"] + step, at["gaps"] + step[:, 2]
    assert motion(**at, guess=before.guess).report.iterations <= 9


def test_any_guess_gives_the_same_answer():
    centres, radii = crowd(3, np.random.default_rng(7), 1e-3, 0.3)
    how = {"centres": centres, "radii": radii, "tolerance": 1e-12}
    cold = motion(**how)
    other = motion(*crowd(3, np.random.default_rng(8), 1e-3, 0.3), tolerance=1e-12)
    labelled = cold.guess.copy()
    labelled[:, 3:] = np.random.default_rng(9).normal(size=labelled[:, 3:].shape)
    guesses = {
        "its own": cold.guess,
        "of another configuration": other.guess,
        "of other degrees": motion(centres, radii, degree=5).guess,
        "of more columns": motion(centres, radii, np.ones((3, 6, 5))).guess,
        "of fewer spheres": motion(centres[:2], radii[:2]).guess,
        "of another shape": np.ones(7),
        "of no meaning": np.random.default_rng(9).normal(size=(1, 400)),
        "of noise": labelled,
    }
    for name, guess in guesses.items():
        assert velocity_error(motion(**how, guess=guess).velocity, cold.velocity, radii) < 1e-9, name
    assert motion(**how, guess=cold.guess).report.iterations <= 1


@pytest.mark.parametrize("good", [0, 3])
def test_a_guess_that_is_not_numbers_is_not_used(good):
    """The guess starts with the degrees of the three spheres."""
    centres, radii = crowd(3, np.random.default_rng(7), 1e-3, 0.3)
    cold = motion(centres, radii)
    bad = np.where(np.arange(cold.guess.shape[1]) < good, cold.guess, np.nan)
    assert motion(centres, radii, guess=bad).velocity == pytest.approx(cold.velocity, rel=1e-12)


BAD = (
    ([[0, 0, 1.2], [2.0, 0, 1.2]], [1.0, 1.0], "spheres 0 and 1: gap 0"),
    ([[0, 0, 1.2], [9.0, 0, 1.2], [1.5, 0, 1.2]], [1.0, 1.0, 1.0], "spheres 0 and 2: gap -0.5"),
    ([[0, 0, 3.0], [5, 0, 0.9]], [1.0, 1.0], "sphere 1: gap -0.0"),
    ([[0, 0, 2.0], [np.nan, 0, 2.0]], [1.0, 1.0], "sphere 1: centre"),
    ([[0, 0, 2.0]], [-1.0], "sphere 0: radius"),
)


@pytest.mark.parametrize(("centres", "radii", "says"), BAD)
def test_refuses_what_has_no_answer(centres, radii, says):
    with pytest.raises(RefusedError, match=says):
        prepared(centres, radii)


def test_refuses_loads_that_are_not_finite():
    with pytest.raises(RefusedError, match="loads"):
        motion([[0, 0, 2.0]], [1.0], np.full((1, 6), np.nan))


@pytest.mark.parametrize(("height", "degree", "speed", "fits"), [
    (3.7622, 12, 0.9943563, True),
    (1.5431, 24, 0.9218740, True),
    (1.0453, 24, 0.6536183, False),
])  # fmt: skip
def test_bare_method_without_lubrication(height, degree, speed, fits):
    """Without lubrication a lone sphere is what harmonics resolve: all far from the wall, not near contact."""
    found = motion([[0, 0, height]], [1.0], degree=degree, lubrication=False).velocity[0, 0] / height
    assert (abs(found / speed - 1) < 2e-7) == fits
    assert motion([[0, 0, height]], [1.0], degree=4).velocity[0, 0] / height == pytest.approx(speed, rel=2e-7)
