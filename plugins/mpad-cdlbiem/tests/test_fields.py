"""The flow of a solution sticks to all surfaces, conserves volume and carries the loads; tractions agree with it."""

import numpy as np
import pytest
from attrs import evolve

from mpad_cdlbiem import CdlBiem
from mpad_cdlbiem.spectral.fields import flow_at, stresslets, tractions
from mpad_cdlbiem.spectral.quadrature import sphere_rule
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.numerics.harmonics.levels import Flow

VISCOSITY = 1.3
SHEAR = 0.7
STRAIN = 0.5 * SHEAR * np.array([[0.0, 0, 1], [0, 0, 0], [1, 0, 0]])
LOAD = np.array([0.6, -0.3, 0.8, 0.2, 0.5, -0.4])
POINTS = np.random.default_rng(2).normal(size=(20, 3))
RULE = sphere_rule(40, 80, np.array([0.0, 0.0, 1.0]))
NORMALS = POINTS / np.linalg.norm(POINTS, axis=1)[:, None]


class Solved:
    """A solution by the bare method, with what can be asked of it."""

    def __init__(self, centres, radii, loads, *, shear_rate, wall, degree):
        setting = Setting(viscosity=VISCOSITY, shear_rate=shear_rate, wall=wall)
        solver = CdlBiem(degree=degree, lubrication=False, tolerance=1e-13)
        self.centres, self.radii, self.loads = np.array(centres, dtype=float), np.array(radii), np.array(loads)
        prepared = solver.prepare(solver.plan(setting), Configuration(centres=self.centres, radii=self.radii))
        motion = solver.solve(prepared, self.loads)
        self.velocity, self.level, self.sources = motion.velocity, prepared.fine, motion.guess[0, len(radii) :]
        self.through_the_front = lambda points: solver.flow(prepared, motion, points)

    def flow(self, points):
        return flow_at(self.level, self.sources, points)

    def disturbance(self, points):
        """Give the flow without the ambient one, which far away would leave no digits of the rest."""
        still = evolve(self.level, scene=evolve(self.level.scene, flow=Flow(0.0, 0.0)))
        return flow_at(still, self.sources, points)

    def of_body(self, sphere, points):
        """Give the velocity of a sphere as a rigid body."""
        return self.velocity[sphere, :3] + np.cross(self.velocity[sphere, 3:], points - self.centres[sphere])

    def surface(self, sphere, stretch=1.0):
        return self.centres[sphere] + stretch * self.radii[sphere] * NORMALS

    def tractions(self, sphere, normals):
        return tractions(self.level, self.sources, VISCOSITY, sphere, normals)

    def stresslets(self):
        return stresslets(self.level, self.sources, VISCOSITY)


@pytest.fixture(scope="module")
def lone():
    """Give a lone free sphere in unbounded shear."""
    return Solved([[0.3, -0.2, 1.5]], [0.8], np.zeros((1, 6)), shear_rate=SHEAR, wall=False, degree=4)


@pytest.fixture(scope="module")
def driven():
    """Give a lone sphere with force and torque in unbounded fluid at rest."""
    return Solved([[0.3, -0.2, 1.5]], [0.8], [LOAD], shear_rate=0.0, wall=False, degree=4)


@pytest.fixture(scope="module", params=[True, False], ids=["wall", "unbounded"])
def pair(request):
    """Give two driven spheres, well apart, in shear."""
    centres, loads = [[0.0, 0.0, 2.2], [2.9, 1.4, 3.6]], [LOAD, -0.5 * LOAD[::-1]]
    return Solved(centres, [1.0, 0.7], loads, shear_rate=SHEAR, wall=request.param, degree=20)


def test_lone_sphere_in_strain_is_the_textbooks(lone):
    r = lone.surface(0, 1.7) - lone.centres[0]
    a, s = lone.radii[0], np.linalg.norm(r, axis=1)[:, None]
    along = np.einsum("ni,ij,nj->n", r, STRAIN, r)[:, None]
    # Batchelor, An Introduction to Fluid Dynamics (1967), section 4.11
    disturbance = -(r @ STRAIN) * (a / s) ** 5 - 2.5 * r * along * (a**3 / s**5 - a**5 / s**7)
    expected = SHEAR * (r[:, 2:] + lone.centres[0, 2]) * [1, 0, 0] + disturbance
    np.testing.assert_allclose(lone.flow(r + lone.centres[0]), expected, rtol=0, atol=1e-14)


def test_driven_sphere_is_stokes(driven):
    r, force, torque = driven.surface(0, 1.7) - driven.centres[0], LOAD[:3], LOAD[3:]
    a, s = driven.radii[0], np.linalg.norm(r, axis=1)[:, None]
    along = r * (r @ force)[:, None]
    stokes = (force / s + along / s**3 + a**2 * (force / s**3 / 3 - along / s**5)) / (8 * np.pi * VISCOSITY)
    expected = stokes + np.cross(torque, r) / s**3 / (8 * np.pi * VISCOSITY)
    np.testing.assert_allclose(driven.flow(r + driven.centres[0]), expected, rtol=0, atol=1e-15)


def test_tractions_of_a_lone_sphere_are_the_textbooks(lone, driven):
    np.testing.assert_allclose(lone.tractions(0, NORMALS), 5 * VISCOSITY * NORMALS @ STRAIN, rtol=0, atol=1e-14)
    velocity, rotation = driven.velocity[0, :3], driven.velocity[0, 3:]
    expected = -VISCOSITY * (1.5 / driven.radii[0] * velocity + 3 * np.cross(rotation, NORMALS))
    np.testing.assert_allclose(driven.tractions(0, NORMALS), expected, rtol=0, atol=1e-14)


def test_stresslet_of_a_lone_sphere_is_batchelors(lone, driven):
    expected = 20 / 3 * np.pi * VISCOSITY * lone.radii[0] ** 3 * STRAIN
    np.testing.assert_allclose(lone.stresslets(), [expected], rtol=0, atol=1e-14)
    np.testing.assert_allclose(driven.stresslets(), np.zeros((1, 3, 3)), rtol=0, atol=1e-15)


@pytest.mark.parametrize("sphere", [0, 1])
def test_fluid_sticks_to_spheres(pair, sphere):
    surface = pair.surface(sphere)
    np.testing.assert_allclose(pair.flow(surface), pair.of_body(sphere, surface), rtol=0, atol=1e-10)


def test_fluid_sticks_to_the_wall(pair):
    at_wall = pair.flow(4 * POINTS * [1, 1, 0])
    if pair.level.scene.wall:
        np.testing.assert_allclose(at_wall, 0, atol=1e-15)
    else:
        assert np.abs(at_wall).max() > 1e-3


def test_flow_conserves_volume(pair):
    points, step, total = pair.surface(0, 1.3), 1e-2, 0.0
    for axis in range(3):
        for k, weight in {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}.items():
            shift = k * step * np.eye(3)[axis]
            total += weight * (pair.flow(points + shift) - pair.flow(points - shift))[:, axis] / step
    np.testing.assert_allclose(total, 0, atol=1e-9)


def test_tractions_carry_loads_and_stresslets(pair):
    normals, weights = RULE
    for k, a in enumerate(pair.radii):
        forces = pair.tractions(k, normals) * a**2 * weights[:, None]
        torque = np.cross(a * normals, forces).sum(axis=0)
        np.testing.assert_allclose([*forces.sum(axis=0), *torque], -pair.loads[k], rtol=0, atol=1e-12)
        moment = a * forces.T @ normals
        symmetric = (moment + moment.T) / 2 - np.trace(moment) / 3 * np.eye(3)
        np.testing.assert_allclose(pair.stresslets()[k], symmetric, rtol=0, atol=1e-13)


@pytest.mark.parametrize("sphere", [0, 1])
def test_tangential_tractions_are_the_viscous_stress(pair, sphere):
    """On a surface at rest relative to the body the tangential stress is η ∂u/∂r."""
    step, slope = 1e-2, 0.0
    for k, weight in {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}.items():
        for side in (1, -1):  # the field goes on smoothly inside
            points = pair.surface(sphere, 1 + side * k * step)
            slope += side * weight * (pair.flow(points) - pair.of_body(sphere, points)) / (step * pair.radii[sphere])
    acting = pair.tractions(sphere, NORMALS)
    tangential = acting - NORMALS * (acting * NORMALS).sum(axis=1)[:, None]
    np.testing.assert_allclose(tangential, VISCOSITY * slope, rtol=0, atol=2e-8)


@pytest.mark.parametrize("pair", [False], ids=["unbounded"], indirect=True)
def test_single_layer_of_the_tractions_is_the_flow(pair):
    """Of rigid bodies u = u_∞ - Σ ∫ G f dS / 8πη (Pozrikidis, Boundary Integral and Singularity Methods, 1992, 2.3)."""
    points, total = pair.surface(0, 1.6), 0.0
    normals, weights = RULE
    for k, a in enumerate(pair.radii):
        forces = pair.tractions(k, normals) * a**2 * weights[:, None] / (8 * np.pi * VISCOSITY)
        r = points[:, None] - (pair.centres[k] + a * normals)
        s = np.linalg.norm(r, axis=2)[..., None]
        total -= (forces / s + r * (r * forces).sum(axis=2)[..., None] / s**3).sum(axis=1)
    np.testing.assert_allclose(pair.disturbance(points), total, rtol=0, atol=1e-13)


def test_far_flow_carries_the_momentum(pair):
    """Far away only the sum of forces is felt; above the wall their moment about it (Blake, 1971)."""
    s = 1e7
    r = s * np.abs(NORMALS)
    force = pair.loads[:, :3].sum(axis=0)
    expected = (force / s + r * (r @ force)[:, None] / s**3) / (8 * np.pi * VISCOSITY)
    if pair.level.scene.wall:
        moment = (pair.centres[:, 2:] * pair.loads[:, :2]).sum(axis=0) - pair.stresslets()[:, :2, 2].sum(axis=0)
        moment += 0.5 * (pair.loads[:, [4, 3]] * [1, -1]).sum(axis=0)
        expected = 1.5 / (np.pi * VISCOSITY) * r * (r[:, :2] @ moment)[:, None] * r[:, 2:] / s**5
    np.testing.assert_allclose(pair.disturbance(r), expected, rtol=0, atol=2e-6 * np.abs(expected).max())


def test_flow_through_the_front_is_the_same(pair):
    points = 1 + np.abs(POINTS)
    np.testing.assert_array_equal(pair.through_the_front(points), pair.flow(points))
