"""Quaternions and rotation vectors against scipy's."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mpad_core.numerics.rotations import matrix_of, turned, turned_vector

RNG = np.random.default_rng(5)
SIZES = [0.0, 1e-300, 1e-12, 1e-6, 0.9e-4, 1.1e-4, 1e-2, 1.0, 3.0, np.pi, 6.0, 50.0]


def unit(quaternion):
    return quaternion / np.linalg.norm(quaternion)


def scipy_of(q):
    return Rotation.from_quat(q[[1, 2, 3, 0]])


@pytest.mark.parametrize("number", range(5))
def test_matrix(number):
    q = unit(np.random.default_rng(number).normal(size=4))
    out = np.empty((3, 3))
    matrix_of(q, out)
    np.testing.assert_allclose(out, scipy_of(q).as_matrix(), rtol=0, atol=1e-15)


@pytest.mark.parametrize("size", SIZES)
def test_turned_is_a_turn_in_space(size):
    """The turn comes after what the quaternion stands for: R(r) R(q)."""
    q, r = unit(RNG.normal(size=4)), size * unit(RNG.normal(size=3))
    out = np.empty(4)
    turned(q, *r, out)
    assert np.linalg.norm(out) == pytest.approx(1, abs=4e-16)
    expected = (Rotation.from_rotvec(r) * scipy_of(q)).as_matrix()
    found = np.empty((3, 3))
    matrix_of(out, found)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-15 * max(1, size) + 1e-15)


def test_turned_may_write_over_its_argument():
    q = unit(RNG.normal(size=4))
    out = np.empty(4)
    turned(q, 0.1, -0.2, 0.3, out)
    turned(q, 0.1, -0.2, 0.3, q)
    assert (q == out).all()


def test_turned_keeps_tiny_turns():
    """A million turns of 1e-9 add up: no turn is lost because it is small."""
    q = np.array([1.0, 0, 0, 0])
    for _ in range(10_000):
        turned(q, 0.0, 1e-7, 0.0, q)
    assert 2 * np.arctan2(q[2], q[0]) == pytest.approx(1e-3, rel=1e-10)


@pytest.mark.parametrize("size", SIZES)
def test_turned_vector(size):
    v, r = RNG.normal(size=3), size * unit(RNG.normal(size=3))
    expected = Rotation.from_rotvec(r).apply(v)
    np.testing.assert_allclose(turned_vector(*v, *r), expected, rtol=0, atol=1e-15 * max(1, size) * 3)


@pytest.mark.parametrize("size", [1e-7, 1e-5, 0.99e-4, 1.01e-4])
def test_small_turns_keep_their_digits(size):
    """The change of the vector, not the vector, to near full precision: r × v + r × (r × v) / 2."""
    v, r = np.array([0.0, 0.0, 1.0]), size * np.array([0.0, 1.0, 0.0])
    x, _, z = turned_vector(*v, *r)
    assert x == pytest.approx(np.sin(size), rel=1e-14)
    assert 1 - z == pytest.approx(2 * np.sin(size / 2) ** 2, rel=1e-6, abs=2e-16)


def test_quaternion_and_vector_turn_alike():
    q, arm, r = unit(RNG.normal(size=4)), RNG.normal(size=3), np.array([0.3, -0.2, 0.5])
    before, after, out = np.empty((3, 3)), np.empty((3, 3)), np.empty(4)
    matrix_of(q, before)
    turned(q, *r, out)
    matrix_of(out, after)
    np.testing.assert_allclose(turned_vector(*(before @ arm), *r), after @ arm, atol=2e-15)
