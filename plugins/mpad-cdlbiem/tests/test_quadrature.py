"""The slow blocks rest on the definitions alone, and solve one and two spheres at the wall to the digits known."""

import numpy as np
import pytest
from scipy.special import lpmv

from mpad_cdlbiem.spectral.quadrature import (
    N_EXTRA,
    direct_block,
    exterior_fields,
    exterior_gradients,
    image_block,
    image_fields,
    rigid_trace,
    sphere_rule,
    vector_harmonics,
)
from mpad_core.numerics.stokeslets import pair_block
from mpad_core.numerics.wall_functions import wall_mobility, wall_shear_load

P = 5
STEP = 1e-2  # of sixth-order differences: truncation and rounding both about 1e-11 of smooth fields


def unit_vectors(count, seed=1):
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def differences(function, points, step=STEP):
    """Give ∂_j of a function of points (n, 3), on a new last axis, by sixth-order central differences."""
    weights = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
    columns = []
    for along in np.eye(3) * step:
        pairs = (w * (function(points + k * along) - function(points - k * along)) for k, w in weights.items())
        columns.append(sum(pairs) / step)
    return np.stack(columns, axis=-1)


def laplacian(function, points, step):
    """Give ∇² of a function of points by sixth-order central differences."""
    total = -3 * 49 / 18 * function(points)
    for k, w in {1: 3 / 2, 2: -3 / 20, 3: 1 / 90}.items():
        total += w * sum(function(points + sign * k * along) for along in np.eye(3) * step for sign in (1, -1))
    return total / step**2


def scalar_harmonics(p, points):
    """Give Y_nm of the points' directions by scipy's Legendre functions, (K, n)."""
    x, y, z = (points / np.linalg.norm(points, axis=1)[:, None]).T
    phi, rows = np.arctan2(y, x), []
    for n in range(1, p + 1):
        for m in range(-n, n + 1):
            factorials = np.prod(1.0 / np.arange(n - abs(m) + 1, n + abs(m) + 1))
            wave = 1.0 if m == 0 else np.sqrt(2) * (np.cos(m * phi) if m > 0 else np.sin(-m * phi))
            legendre = (-1) ** m * lpmv(abs(m), n, z)  # scipy's has the Condon-Shortley phase
            rows.append(np.sqrt((2 * n + 1) / (4 * np.pi) * factorials) * legendre * wave)
    return np.array(rows)


def degrees(p):
    return np.repeat(np.arange(1, p + 1), 2 * np.arange(1, p + 1) + 1)


def test_vector_harmonics_are_the_definitions():
    points = unit_vectors(7)
    n = degrees(P)[:, None, None]
    radial = scalar_harmonics(P, points)[..., None] * points
    surface = differences(lambda at: scalar_harmonics(P, at), points, 3e-3)  # constant along r, so this is ∇_S
    v = (surface - (n + 1) * radial) / np.sqrt((n + 1) * (2 * n + 1))
    w = (surface + n * radial) / np.sqrt(n * (2 * n + 1))
    x = np.cross(points, surface) / np.sqrt(n * (n + 1))
    np.testing.assert_allclose(vector_harmonics(P, points), [v, w, x], atol=1e-9)


def test_vector_harmonics_are_orthonormal():
    directions, weights = sphere_rule(P + 1, 2 * P + 1, np.array([0.3, -0.5, 0.2]))
    flat = vector_harmonics(P, directions).reshape(3 * P * (P + 2), -1)
    np.testing.assert_allclose((flat * np.repeat(weights, 3)) @ flat.T, np.eye(len(flat)), atol=1e-13)


def test_vector_harmonics_hold_at_the_poles():
    poles = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    beside = poles + np.array([1e-9, 1e-9, 0.0])
    np.testing.assert_allclose(vector_harmonics(P, poles), vector_harmonics(P, beside), atol=1e-7)


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.0, 0.0, -2.0), (1.0, 0.0, 0.0), (-0.3, 0.4, -0.0)])
def test_sphere_rule_is_exact(axis):
    directions, weights = sphere_rule(4, 8, np.array(axis))
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    seconds = np.einsum("k,ki,kj->ij", weights, directions, directions)
    np.testing.assert_allclose(seconds, np.eye(3) * 4 * np.pi / 3, atol=1e-13)


@pytest.mark.parametrize("radius", [1.0, 0.3])
def test_traces_of_the_exterior_fields_are_the_vector_harmonics(radius):
    directions = unit_vectors(9)
    fields = exterior_fields(P, radius, radius * directions)
    np.testing.assert_allclose(fields, vector_harmonics(P, directions), atol=1e-13)


def test_gradients_are_those_of_the_fields():
    points = 1.4 * unit_vectors(6)
    gradient, _ = exterior_gradients(P, 0.8, points)
    np.testing.assert_allclose(gradient, differences(lambda at: exterior_fields(P, 0.8, at), points), atol=1e-8)


def test_exterior_fields_obey_stokes_equations():
    points = 1.4 * unit_vectors(6)
    gradient, pressure_gradient = exterior_gradients(P, 0.8, points)
    second = differences(lambda at: exterior_gradients(P, 0.8, at)[0], points)
    np.testing.assert_allclose(np.trace(gradient, axis1=-2, axis2=-1), 0.0, atol=1e-13)
    np.testing.assert_allclose(np.trace(second, axis1=-2, axis2=-1), pressure_gradient, atol=1e-7)


def test_degree_one_is_the_translating_and_the_turning_sphere():
    radius, point = 0.7, np.array([[0.5, -1.0, 0.8]])
    trace = rigid_trace(1, radius, np.array([0.3, 0.2, -0.5, 1.1, -0.4, 0.6]))
    field = np.tensordot(trace, exterior_fields(1, radius, point), 2)[0]
    (r,), u, spin = point, np.array([0.3, 0.2, -0.5]), np.array([1.1, -0.4, 0.6])
    q = radius / np.linalg.norm(r)
    along = r * (r @ u) / (r @ r)
    stokes = 0.75 * q * (u + along) + 0.25 * q**3 * (u - 3 * along)
    np.testing.assert_allclose(field, stokes + q**3 * np.cross(spin, r), rtol=1e-13)


def test_rigid_trace_is_the_rigid_motion():
    directions = unit_vectors(5)
    motion = np.array([0.3, 0.2, -0.5, 1.1, -0.4, 0.6])
    field = np.tensordot(rigid_trace(P, 0.7, motion), vector_harmonics(P, directions), 2)
    np.testing.assert_allclose(field, motion[:3] + np.cross(motion[3:], 0.7 * directions), atol=1e-13)


CENTRE = np.array([0.2, -0.1, 1.3])
ABOVE = np.array([[0.5, 1.0, 0.4], [-1.5, 0.3, 2.1], [0.2, -0.1, 0.0], [0.1, -0.4, 1.2]])


def test_images_cancel_the_fields_at_the_wall():
    wall = ABOVE * [1.0, 1.0, 0.0]
    there = exterior_fields(P, 0.8, wall - CENTRE)
    np.testing.assert_allclose(image_fields(P, 0.8, CENTRE, wall), -there, atol=1e-13)


def test_images_obey_stokes_equations():
    def images(at):
        return image_fields(P, 0.8, CENTRE, at)

    points = ABOVE[:2]
    gradient = differences(images, points)
    force = differences(lambda at: laplacian(images, at, 0.05), points, 0.05)  # ∇∇p, so symmetric and of no trace
    assert np.abs(force).max() > 1.0
    np.testing.assert_allclose(np.trace(gradient, axis1=-2, axis2=-1), 0.0, atol=1e-9)
    np.testing.assert_allclose(force, np.swapaxes(force, -1, -2), atol=2e-5)
    np.testing.assert_allclose(np.trace(force, axis1=-2, axis2=-1), 0.0, atol=2e-5)


def single_layer_eigenvalues(p):
    """Give Λ over radius and viscosity, which makes traces from tractions, in the order of the coefficients."""
    n = degrees(p)
    v, w, x = n / ((2 * n + 1) * (2 * n + 3)), (n + 1) / ((2 * n + 1) * (2 * n - 1)), 1 / (2 * n + 1)
    return np.concatenate([v, w, x])


def assert_reciprocal(block, back, p_target, a_target, p_source, a_source):
    there = a_target * block * single_layer_eigenvalues(p_source)
    back_again = a_source * back * single_layer_eigenvalues(p_target)
    np.testing.assert_allclose(there, back_again.T, atol=3e-14 * np.abs(there).max())


@pytest.mark.parametrize("offset", [(1.0, 1.2, -0.7), (0.0, 0.0, 1.75), (-1.6, 0.7, 0.0)])
def test_direct_blocks_are_reciprocal(offset):
    offset = np.array(offset)
    block, back = direct_block(4, 1.0, 6, 0.7, offset), direct_block(6, 0.7, 4, 1.0, -offset)
    assert_reciprocal(block, back, 4, 1.0, 6, 0.7)


@pytest.mark.parametrize("place", [(1.0, 1.2, 1.7), (0.2, -0.1, 2.9), (0.2, -0.1, 1.3)])
def test_image_blocks_are_reciprocal(place):
    place = np.array(place)
    block, back = image_block(4, 1.0, place, 6, 0.7, CENTRE), image_block(6, 0.7, CENTRE, 4, 1.0, place)
    assert_reciprocal(block, back, 4, 1.0, 6, 0.7)


def test_a_spheres_own_image_block_keeps_the_order_m():
    block = image_block(3, 1.0, CENTRE, 3, 1.0, CENTRE).reshape(3, 15, 3, 15)
    m = np.concatenate([np.arange(-n, n + 1) for n in range(1, 4)])
    coupled = np.abs(block).max(axis=(0, 2)) > 1e-14
    assert not np.any(coupled & (np.abs(m)[:, None] != np.abs(m)))


def rigid_projection(block, k_target, k_source, a_target, a_source):
    """Give the mobility (6, 6) that a block holds in the rigid motions of target and source, viscosity 1."""
    to_motion = np.array([rigid_trace(1, a_target, e) for e in np.eye(6)])  # (6, 3, 3)
    source = np.array([rigid_trace(1, a_source, e) for e in np.eye(6)])
    loads = 6 * np.pi * a_source * np.array([1, 1, 1] + 3 * [4 / 3 * a_source**2])
    degree_one = block.reshape(3, k_target, 3, k_source)[:, :3, :, :3]
    inverse = to_motion / np.sum(to_motion**2, axis=(1, 2))[:, None, None]
    return np.einsum("afk,fkgl,bgl->ab", inverse, degree_one, source) / loads


@pytest.mark.parametrize("wall", [False, True])
def test_degree_one_is_rotne_prager_blake(wall):
    target, a, b = np.array([1.1, 0.6, 2.2]), 0.5, 0.9
    block = direct_block(2, a, 3, b, target - CENTRE)
    if wall:
        block += image_block(2, a, target, 3, b, CENTRE)
    expected = np.empty((6, 6))
    pair_block(target, CENTRE, a, b, 1 / (8 * np.pi), wall, expected)
    np.testing.assert_allclose(rigid_projection(block, 8, 15, a, b), expected, atol=1e-15)


@pytest.mark.parametrize(("radius", "gap"), [(1.0, 0.0), (0.1, 0.01), (10.0, 0.01)])
def test_blocks_have_converged_in_the_nodes(radius, gap):
    offset = np.array([0.0, 0.6, -0.8]) * (1 + radius * (1 + gap))
    converged = direct_block(6, 1.0, 6, radius, offset, N_EXTRA + 16)
    error = np.abs(direct_block(6, 1.0, 6, radius, offset) - converged).max()
    assert error < 2e-13 * np.abs(converged).max()


def test_image_blocks_have_converged_in_the_nodes():
    touching, beside = np.array([0.0, 0.0, 1.0]), np.array([2.0, 0.0, 1.0])
    for target in (touching, beside):
        converged = image_block(6, 1.0, target, 6, 1.0, touching, N_EXTRA + 16)
        assert np.abs(image_block(6, 1.0, target, 6, 1.0, touching) - converged).max() < 2e-13


def test_refuses_a_source_inside_the_target_or_below_the_wall():
    with pytest.raises(ValueError, match=r"0\.5 radii"):
        direct_block(1, 1.0, 1, 0.1, np.array([0.0, 0.5, 0.0]))
    with pytest.raises(ValueError, match=r"0\.8 radii"):
        image_block(1, 1.0, np.array([0.0, 0.0, 0.4]), 1, 1.0, np.array([0.0, 0.0, 0.4]))
    with pytest.raises(ValueError, match=r"z = -1\.0"):
        image_fields(1, 1.0, np.array([0.0, 0.0, -1.0]), ABOVE)


class Spheres:
    """Rigid spheres above the wall, viscosity and shear rate 1, solved densely in the coefficients of the traces.

    The total trace is a rigid motion: (I + T) c + b = U + Ω × r, with c known in the rigid modes (loads 6π a U0,
    8π a³ Ω0, c the trace of U0 + Ω0 × r) and unknown in the others, where the right-hand side vanishes.
    """

    def __init__(self, p, radii, centres):
        self.p, self.radii, self.centres = p, radii, np.array(centres)
        self.size = 3 * p * (p + 2)
        self.total = np.block([[self.block(i, j) for j in range(len(radii))] for i in range(len(radii))])
        self.rigid = np.zeros((len(self.total), 6 * len(radii)))
        for i, radius in enumerate(radii):
            traces = [rigid_trace(p, radius, e).ravel() for e in np.eye(6)]
            self.rigid[i * self.size : (i + 1) * self.size, 6 * i : 6 * i + 6] = np.transpose(traces)

    def block(self, i, j):
        p, a, x = self.p, self.radii, self.centres
        image = image_block(p, a[i], x[i], p, a[j], x[j])
        return image + (np.eye(self.size) if i == j else direct_block(p, a[i], p, a[j], x[i] - x[j]))

    def motion(self, known, incoming):
        """Give U, Ω of all spheres, (6N, k), for known rigid coefficients and incoming traces."""
        size = np.sum(self.rigid**2, axis=0)
        free = np.sum(self.rigid**2, axis=1) == 0
        trace = known.copy()
        trace[free] = np.linalg.solve(self.total[np.ix_(free, free)], -(self.total @ known + incoming)[free])
        return self.rigid.T @ (self.total @ trace + incoming) / size[:, None]

    def mobility(self):
        a = np.repeat(self.radii, 6)
        loads = np.pi * np.where(np.arange(len(a)) % 6 < 3, 6 * a, 8 * a**3)
        known = self.rigid / loads
        return self.motion(known, np.zeros_like(known))

    def free_in_shear(self):
        directions, weights = sphere_rule(self.p + 2, 2 * self.p + 4, np.array([0.0, 0.0, 1.0]))
        basis = vector_harmonics(self.p, directions)
        heights = [x[2] + a * directions[:, 2] for x, a in zip(self.centres, self.radii, strict=True)]
        incoming = np.concatenate([basis[..., 0].reshape(self.size, -1) @ (weights * z) for z in heights])[:, None]
        return self.motion(np.zeros_like(incoming), incoming)[:, 0]


@pytest.mark.parametrize(("gap", "p", "error"), [(1.0, 12, 1e-12), (0.3, 12, 2e-7)])
def test_one_sphere_at_the_wall(gap, p, error):
    radius = 1.7
    spheres = Spheres(p, [radius], [[0.0, 0.0, radius * (1 + gap)]])
    mobility, load = np.empty((6, 6)), np.empty(6)
    wall_mobility(radius * (1 + gap), radius * gap, radius, 1.0, mobility)
    wall_shear_load(radius * (1 + gap), radius * gap, radius, 1.0, 1.0, load)
    np.testing.assert_allclose(spheres.mobility(), mobility, atol=error * mobility.max())
    np.testing.assert_allclose(spheres.free_in_shear(), mobility @ load, atol=error)


TWO = {
    "radii": [1.0, 0.7932753310659678],
    "centres": [[0, 0, 1.289636301941054], [-2.152362018112922, 0.502233268354183, 2.0642038332189054]],
    "free_in_shear": [
        [1.157400507, -0.013938084, -0.005698532, -0.004299249, 0.411121015, -0.002715904],
        [1.835306701, 0.029198937, 0.026214088, -0.01541055, 0.431137852, -0.01166554],
    ],
    "all_loads_one": [
        [0.036220935, 0.039347731, 0.008862993, 0.029921375, 0.036607347, 0.028302788],
        [0.063404578, 0.047578595, 0.037742218, 0.077395373, 0.070951998, 0.080041979],
    ],
}
"""Case wall2-45 of the project's reference numbers: fundamental solutions with wall images, least squares,
self-converged to 3e-8. Velocities free in shear, and with each component of each force and torque 1 in no flow."""


def test_two_spheres_at_the_wall():
    spheres = Spheres(8, TWO["radii"], TWO["centres"])
    mobility = spheres.mobility()
    np.testing.assert_allclose(mobility, mobility.T, atol=1e-15)
    np.testing.assert_allclose(mobility.sum(axis=1).reshape(2, 6), TWO["all_loads_one"], atol=1e-5)
    np.testing.assert_allclose(spheres.free_in_shear().reshape(2, 6), TWO["free_in_shear"], atol=3e-5)
