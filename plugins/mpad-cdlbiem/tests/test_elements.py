"""CDL-BIEM on elements: the operator's known numbers, exact lone spheres and pairs, and what lubrication mends."""

import json
from pathlib import Path

import numpy as np
import pytest

from mpad_cdlbiem.elements.iteration import ITERATIONS, gmres
from mpad_cdlbiem.elements.kernels import add_completion, add_double_layer
from mpad_cdlbiem.elements.memory import refuse_many
from mpad_cdlbiem.elements.mesh import mesh_of
from mpad_cdlbiem.elements.plan import ElementsPlan
from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.numerics.wall_functions import wall_mobility, wall_shear_load

REFERENCE = json.loads((Path(__file__).parent / "data" / "elements_reference.json").read_text())
SHEAR = Setting(viscosity=1.0, shear_rate=1.0)
UNBOUNDED = Setting(viscosity=1.0, shear_rate=1.0, wall=False)


def prepared(centres, radii, setting=SHEAR, wall_gaps=None, guess=None, **parameters):
    gaps = np.subtract(np.array(centres)[:, 2], radii) if wall_gaps is None else wall_gaps
    at = Configuration(centres=centres, radii=radii, wall_gaps=gaps)
    return ElementsPlan(setting=setting, **parameters).prepared(at, guess)


def free(centres, radii, setting=SHEAR, **parameters):
    return prepared(centres, radii, setting, **parameters).solve(np.zeros((len(radii), 6)))


def mobility(ready):
    count = len(ready.configuration.radii)
    loads = np.eye(6 * count).reshape(count, 6, -1)
    still = ready.solve(np.zeros((count, 6))).velocity.reshape(-1, 1)
    return ready.solve(loads).velocity.reshape(6 * count, -1) - still


def error(found, true, radii):
    weights = np.column_stack([np.ones_like(radii), radii]).repeat(3, axis=1)
    found, true = (weights * np.reshape(values, (-1, 6)) for values in (found, true))
    return np.linalg.norm(found - true) / np.linalg.norm(true)


def at_equal_gaps(gap):
    return {"centres": [[0, 0, 1 + gap], [2 + gap, 0, 1 + gap]], "radii": [1.0, 1.0], "wall_gaps": [gap, gap]}


def of_case(case):
    return {"centres": case["x"], "radii": case["a"], "wall_gaps": np.multiply(case["gaps"]["wall"], case["a"])}


def exact_alone(gap, loads):
    matrix, ambient = np.empty((6, 6)), np.empty(6)
    wall_mobility(1 + gap, gap, 1.0, 1.0, matrix)
    wall_shear_load(1 + gap, gap, 1.0, 1.0, 1.0, ambient)
    return matrix @ (loads + ambient)


# --- the mesh and the kernels


@pytest.mark.parametrize(("side", "radius", "stresslet"), [(4, 0.6034, 1.0021), (7, 0.6006, 1.0004)])
def test_sphere_in_unbounded_fluid(side, radius, stresslet):
    """Area, radius of the deflated operator (3/5), and the stresslet 20/3 πμa³ E of a sphere in a straining flow."""
    mesh = mesh_of(side, 1)
    assert mesh.weights.sum() == pytest.approx(4 * np.pi, rel=1e-12)
    assert np.abs(np.linalg.eigvals(mesh.own - np.eye(len(mesh.own)))).max() == pytest.approx(radius, abs=5e-5)
    strain = np.array([[0, 0, 0.5], [0, 0, 0], [0.5, 0, 0]])
    density = np.linalg.solve(mesh.own, -(mesh.points @ strain).T.ravel()).reshape(3, -1)
    moment = np.einsum("e,ie,ek->ik", mesh.weights, density, mesh.points)
    found = -2 * (moment + moment.T)[0, 2] / (20 / 3 * np.pi * strain[0, 2])
    assert found == pytest.approx(stresslet, abs=5e-5)


def test_rigid_motions_are_exact_null_vectors():
    mesh = mesh_of(4, 1)
    motion = np.cross([1.0, -2.0, 0.5], mesh.points) + np.array([0.3, 1.0, -1.0])
    velocity = mesh.velocity @ motion.T.ravel()
    assert velocity == pytest.approx([-0.3, -1.0, 1.0, -1.0, 2.0, -0.5], abs=1e-13)
    assert mesh.own @ motion.T.ravel() == pytest.approx(motion.T.ravel(), abs=1e-13)  # (1 + K) φ = 0, and φ<φ, φ> = φ


def test_fluid_sticks_to_the_wall():
    """Kernel and image, force, torque and images cancel on the wall, blurred or not."""
    mesh, points = mesh_of(2, 2), np.array([[0.4, 0.2, 0.0], [-2.0, 1.0, 0.0]])
    layer, completion = np.zeros((6, len(mesh.own))), np.zeros((6, 6))
    for image in (False, True):
        seen = np.column_stack([points - [0, 0, 1.2], points[:, 2]])
        add_double_layer(seen, mesh.sources, mesh.blur, image, layer)
        add_completion(points, np.array([0, 0, 1.2]), 1.0, image, completion)
    assert np.abs(layer).max() < 1e-14
    assert np.abs(completion).max() < 1e-14


@pytest.mark.parametrize("image", [False, True])
def test_double_layer_is_free_of_divergence(image):
    mesh, step, x = mesh_of(2, 2), 1e-4, np.array([0.9, 1.1, 1.7])
    density, sign = np.sin(np.arange(3.0 * len(mesh.points))), np.array([1, 1, -1 if image else 1])

    def velocity(point):
        block = np.zeros((3, len(density)))
        add_double_layer(np.array([[*(sign * point - [0, 0, 1.3]), point[2]]]), mesh.sources, 0.0, image, block)
        return block @ density

    gradient = [(velocity(x + step * e) - velocity(x - step * e)) / (2 * step) for e in np.eye(3)]
    assert abs(np.trace(gradient)) < 1e-6 * np.abs(gradient).max()


@pytest.mark.parametrize(
    ("gap", "radius"), [(10.0, 0.603), (1.0, 0.605), (0.128, 0.738), (0.045, 0.704), (0.001, 0.727)]
)
def test_spectral_radius_at_the_wall(gap, radius):
    """Picard's iteration converges at any gap: blurred elements do not see the stiff modes, which lubrication brings.

    The continuous operator has 0.6000 at gap 10, 0.6022 at 1, 0.8518 at 0.1, 0.9997 at 0.001.
    """
    assert prepared([[0, 0, 1 + gap]], [1.0]).spectral_radius() == pytest.approx(radius, abs=2e-3)


# --- spheres alone, and pairs alone, are exact


@pytest.mark.parametrize("lubrication", [True, False])
def test_alone_in_unbounded_fluid(lubrication):
    setting = Setting(viscosity=2.0, shear_rate=0.5, wall=False)
    load = np.array([[1.0, -2.0, 0.5, 0.3, 0.1, -0.7]])
    found = prepared([[0.3, -1.0, 4.0]], [0.8], setting, lubrication=lubrication, tolerance=1e-13).solve(load)
    stokes = np.repeat([1 / (6 * np.pi * 2 * 0.8), 1 / (8 * np.pi * 2 * 0.8**3)], 3)
    assert found.velocity[0] == pytest.approx(load[0] * stokes + [2.0, 0, 0, 0, 0.25, 0], rel=1e-12, abs=1e-13)


@pytest.mark.parametrize("gap", [1e-4, 1e-2, 0.3, 5.0])
def test_alone_at_the_wall(gap):
    loads = np.array([3.0, 1.0, -2.0, 0.5, 0.2, -1.0])
    found = prepared([[0, 0, 1 + gap]], [1.0], wall_gaps=[gap]).solve(loads[None])
    assert error(found.velocity, exact_alone(gap, loads), [1.0]) < 1e-8


def test_elements_alone_miss_lubrication_at_the_wall():
    def wrong(gap):
        return error(free([[0, 0, 1 + gap]], [1.0], lubrication=False).velocity, exact_alone(gap, 0.0), [1.0])

    assert wrong(1.0) < 1e-3
    assert wrong(0.3) < 5e-3
    assert wrong(0.001) > 0.3


@pytest.mark.parametrize("case", REFERENCE["unbounded"], ids=lambda case: case["id"])
def test_two_spheres_alone_in_shear(case):
    found = free(case["x"], case["a"], UNBOUNDED, tolerance=1e-10)
    uncorrected = 2e-3 if case["id"] == "pair-17" else 1e-7  # the last are so far apart that elements do
    assert error(found.velocity, case["V_shear"], case["a"]) < uncorrected


# --- lubrication, and no more of it than there is


def near_pair(gap, ratio):
    centres = np.array([[0, 0, 0], (1 + ratio + gap) * np.array([0.48, 0.6, 0.64])])
    return {"centres": centres, "radii": [1.0, ratio], "setting": UNBOUNDED}


@pytest.mark.parametrize("gap", [0.5, 0.01, 1e-4])
@pytest.mark.parametrize("ratio", [1.0, 0.3])
def test_all_of_what_elements_have_is_taken_off(gap, ratio):
    """Two spheres alone come out the same from any mesh, however much of their lubrication it resolves."""
    loads = np.arange(12.0).reshape(2, 6) - 5.5
    few, many = (prepared(**near_pair(gap, ratio), elements=n, tolerance=1e-11).solve(loads).velocity for n in (24, 96))
    assert error(few, many, [1.0, ratio]) < 1e-8


def test_lubrication_counted_twice_would_show():
    """The exact resistance on top of what elements have: wrong by more than a tenth where elements alone are good."""
    pair = near_pair(0.3, 1.0)
    ready = prepared(**pair)
    raw, exact = ready.solution.raw, ready.friction
    lone = np.diag(np.tile(np.repeat([6 * np.pi, 8 * np.pi], 3), 2))
    twice = raw.resistance + exact.resistance - lone
    loads = np.arange(12.0) - 5.5
    right, once, double = (np.linalg.solve(r, loads) for r in (exact.resistance, raw.resistance, twice))
    assert error(once, right, [1.0, 1.0]) < 0.02
    assert error(double, right, [1.0, 1.0]) > 0.1


@pytest.mark.parametrize("row", REFERENCE["equal_gaps"], ids=lambda row: f"gap {row[0]}")
def test_two_spheres_and_wall_at_equal_gaps(row):
    gap, along, across, spin = row
    true = [[along, 0, across, 0, spin, 0], [along, 0, -across, 0, spin, 0]]
    motion = free(**at_equal_gaps(gap))
    wrong = error(motion.velocity, true, [1.0, 1.0])
    assert wrong < 0.02
    assert wrong < 3 * motion.report.error
    if gap <= 0.01:
        raw = free(**at_equal_gaps(gap), lubrication=False)
        assert error(raw.velocity, true, [1.0, 1.0]) > 0.3
        assert raw.report.error > 0.3


@pytest.mark.parametrize("case", REFERENCE["at_wall"], ids=lambda case: case["id"])
def test_spheres_at_the_wall_in_shear(case):
    motion = free(**of_case(case))
    wrong = error(motion.velocity, case["V_shear"], case["a"])
    assert wrong < 0.007
    assert wrong < 3 * motion.report.error < 60 * wrong


def test_more_elements_are_better():
    case = next(case for case in REFERENCE["at_wall"] if case["id"] == "wall2-49")
    wrong = [error(free(**of_case(case), elements=n).velocity, case["V_shear"], case["a"]) for n in (24, 96, 294)]
    assert wrong[0] > 2 * wrong[1] > 4 * wrong[2]


# --- what holds of any Stokes flow


def test_mobility_is_symmetric_and_positive():
    ready = prepared([[0, 0, 1.01], [1.9, 0.9, 1.2], [-0.4, 0.8, 2.9]], [1.0, 0.9, 0.7])
    found = mobility(ready)
    assert np.abs(found - found.T).max() < 1e-10 * np.abs(found).max()
    assert np.linalg.eigvalsh((found + found.T) / 2).min() > 0


def test_superposition():
    ready = prepared(**at_equal_gaps(0.05))
    loads = np.cos(np.arange(36.0)).reshape(2, 6, 3)
    block = ready.solve(loads).velocity
    for k in range(3):
        assert ready.solve(loads[:, :, k]).velocity == pytest.approx(block[:, :, k], rel=1e-12)
    still = ready.solve(np.zeros((2, 6))).velocity
    mixed = ready.solve(loads @ [2.0, -1.0, 0.5]).velocity
    assert mixed - still == pytest.approx((block - still[:, :, None]) @ [2.0, -1.0, 0.5], abs=1e-12)


def test_units_do_not_matter():
    """Lengths times 5, viscosity times 1e-3, time times 0.1."""
    centres, radii, loads = np.array([[0, 0, 1.1], [1.8, 0.9, 1.3]]), np.array([1.0, 0.8]), np.sin(np.arange(12.0))
    force = 1e-3 * 5**2 / 0.1
    scaled = Setting(viscosity=1e-3, shear_rate=10.0)
    ours = prepared(centres, radii, tolerance=1e-11).solve(loads.reshape(2, 6)).velocity
    theirs = loads.reshape(2, 6) * np.repeat([force, 5 * force], 3)
    found = prepared(5 * centres, 5 * radii, scaled, tolerance=1e-11).solve(theirs).velocity
    assert found == pytest.approx(ours * np.repeat([5 / 0.1, 1 / 0.1], 3), rel=1e-8, abs=1e-8)


def test_mirror_images_move_as_mirror_images():
    """The mesh has the symmetry of the cube, so y -> -y holds to rounding."""
    centres, radii, flip = np.array([[0, 0, 1.1], [1.7, 1.1, 1.3]]), [1.0, 1.0], np.array([1, -1, 1, -1, 1, -1])
    found = free(centres, radii, tolerance=1e-12).velocity
    mirrored = free(centres * [1, -1, 1], radii, tolerance=1e-12).velocity
    assert mirrored == pytest.approx(found * flip, abs=1e-9)


# --- iterations


def test_picard_gmres_and_elimination_agree():
    loads = np.ones((2, 6))
    answers = [prepared(**at_equal_gaps(0.02), iteration=name, tolerance=1e-10).solve(loads) for name in ITERATIONS]
    for answer in answers[1:]:
        assert error(answer.velocity, answers[0].velocity, [1.0, 1.0]) < 1e-8
    assert 5 < answers[0].report.iterations < 30 < answers[1].report.iterations < 100
    assert max(answer.report.residual for answer in answers) < 1e-10


def test_warm_start_saves_work_and_changes_nothing():
    cold = prepared(**at_equal_gaps(0.05)).solve(np.zeros((2, 6)))
    moved = at_equal_gaps(0.0502)
    again, warm = prepared(**moved).solve(np.zeros((2, 6))), prepared(**moved, guess=cold.guess).solve(np.zeros((2, 6)))
    assert warm.report.iterations <= again.report.iterations - 3
    assert error(warm.velocity, again.velocity, [1.0, 1.0]) < 1e-5
    same = prepared(**at_equal_gaps(0.05), guess=cold.guess).solve(np.zeros((2, 6)))
    assert same.report.iterations == 0


@pytest.mark.parametrize("guess", [np.ones(7), np.full((576, 13), np.nan)])
def test_a_guess_of_no_use_is_not_used(guess):
    cold = prepared(**at_equal_gaps(0.05)).solve(np.zeros((2, 6)))
    found = prepared(**at_equal_gaps(0.05), guess=guess).solve(np.zeros((2, 6)))
    assert np.array_equal(found.velocity, cold.velocity)


def test_gmres_with_columns_that_are_equal_or_zero():
    operator = np.eye(20) + 0.2 * np.sin(np.arange(400.0)).reshape(20, 20)
    right = np.column_stack([np.arange(20.0), np.zeros(20), np.arange(20.0), np.ones(20)])
    solved = gmres(operator, right, np.zeros_like(right), 1e-12)
    assert operator @ solved.density == pytest.approx(right, abs=1e-10)


def test_an_iteration_that_fails_says_so():
    with pytest.raises(RefusedError, match=r"picard left a residual of .* after 2000 iterations"):
        prepared([[0, 0, 1.2]], [1.0], iteration="picard", tolerance=1e-18)


# --- the fluid


def test_flow_around_a_sphere_under_a_force():
    """Stokes: u = 3/4 U (1/r + 1/(3 r³)) + 3/4 n (n·U) (1/r - 1/r³), and the sphere's own velocity inside."""
    ready = prepared([[0, 0, 0]], [1.0], Setting(viscosity=1.0, wall=False))
    motion = ready.solve(np.array([[6 * np.pi, 0, 0, 0, 0, 0]]))
    directions = np.array([[1, 0, 0], [0.6, 0.8, 0], [0.36, 0.48, 0.8], [0, -0.28, 0.96]])
    for r, allowed in ((1.02, 0.04), (1.5, 1.5e-3), (10.0, 1e-4)):
        across, along = 0.75 * (1 / r + 1 / (3 * r**3)), 0.75 * (1 / r - 1 / r**3)
        true = np.array([[across, 0, 0]]) + along * directions * directions[:, :1]
        assert ready.flow(motion, r * directions) == pytest.approx(true, abs=allowed)
    assert ready.flow(motion, 0.5 * directions) == pytest.approx(np.array([[1.0, 0, 0]] * 4), abs=1e-6)


def test_flow_meets_the_spheres_and_the_wall():
    ready = prepared([[0, 0, 1.3], [2.6, 0, 1.5]], [1.0, 1.0])
    motion = ready.solve(np.zeros((2, 6)))
    assert np.abs(ready.flow(motion, np.array([[1.0, 0.3, 0.0], [5.0, 2.0, 0.0]]))).max() < 1e-12
    far = ready.flow(motion, np.array([[300.0, 100.0, 40.0]]))
    assert far[0] == pytest.approx([40.0, 0, 0], abs=1e-3)
    directions = np.array([[0.6, 0.8, 0], [0, 0.6, 0.8], [0, 0, 1]])
    for centre, velocity in zip(ready.configuration.centres, motion.velocity, strict=True):
        surface = velocity[:3] + np.cross(velocity[3:], directions)
        assert ready.flow(motion, centre + 1.001 * directions) == pytest.approx(surface, abs=0.1)


# --- what is refused


@pytest.mark.parametrize(
    ("centres", "radii", "says"),
    [
        ([[0, 0, 1.2], [2.0, 0, 1.2]], [1.0, 1.0], "spheres 0 and 1: gap 0"),
        ([[0, 0, 1.2], [9.0, 0, 1.2], [1.5, 0, 1.2]], [1.0, 1.0, 1.0], "spheres 0 and 2: gap -0.5"),
        ([[0, 0, 1.0]], [1.0], "sphere 0: gap 0.0"),
        ([[0, 0, 2.0], [np.nan, 0, 2.0]], [1.0, 1.0], "sphere 1: centre"),
        ([[0, 0, 2.0]], [-1.0], "sphere 0: radius"),
    ],
)
def test_refuses_what_has_no_answer(centres, radii, says):
    with pytest.raises(RefusedError, match=says):
        prepared(centres, radii)


def test_refuses_loads_that_are_not_finite():
    with pytest.raises(RefusedError, match="loads"):
        prepared([[0, 0, 2.0]], [1.0]).solve(np.full((1, 6), np.inf))


def test_refuses_more_spheres_than_fit():
    refuse_many(40, 96)
    with pytest.raises(RefusedError, match=r"100 spheres of 96 elements need 19.9 GB; 44 spheres would do"):
        refuse_many(100, 96)


def test_refuses_a_sphere_that_elements_beside_it_do_not_resolve():
    corner = {"centres": [[0, 0, 1.01], [0.25, 0, 0.011]], "radii": [1.0, 0.01]}
    with pytest.raises(RefusedError, match=r"sphere 1 of radius 0\.01 µm is too small beside elements of 0\.362 µm on"):
        prepared(**corner)
    prepared([[0, 0, 1.01], [5.0, 0, 0.011]], [1.0, 0.01])  # far from it
