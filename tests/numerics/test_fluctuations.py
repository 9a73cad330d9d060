"""Roots and divergences against matrices and fields whose roots and divergences are known."""

import numpy as np
import pytest
from scipy.linalg import sqrtm

from mpad_core.numerics.fluctuations import (
    dense_root,
    divergence,
    lanczos_root,
    preconditioned_root,
    room_to_move,
)


def spread(n, condition, seed):
    """Give a symmetric positive definite matrix."""
    rng = np.random.default_rng(seed)
    vectors = np.linalg.qr(rng.normal(size=(n, n)))[0]
    return (vectors * np.geomspace(1, condition, n)) @ vectors.T


@pytest.mark.parametrize("condition", [1.0, 30.0, 1e4])
def test_lanczos_gives_the_symmetric_root(condition):
    matrix, b = spread(90, condition, 3), np.random.default_rng(4).normal(size=90)
    found = lanczos_root(lambda v: matrix @ v, b, tolerance=1e-11)
    assert found.change <= 1e-11
    assert np.linalg.norm(found.x - sqrtm(matrix).real @ b) < 1e-9 * np.linalg.norm(found.x)


def test_lanczos_stops_as_soon_as_it_may_and_says_when_it_could_not():
    matrix, b = spread(90, 30.0, 3), np.random.default_rng(4).normal(size=90)
    products = [lanczos_root(lambda v: matrix @ v, b, tolerance=10.0**-d).products for d in (2, 5, 8)]
    assert sorted(set(products)) == products
    cut_off = lanczos_root(lambda v: matrix @ v, b, tolerance=1e-8, most=5)
    assert cut_off.products == 5
    assert cut_off.change > 1e-8


def test_lanczos_in_an_invariant_space():
    found = lanczos_root(lambda v: 4.0 * v, np.array([1.0, -2.0, 0.5]), tolerance=1e-14)
    assert found.products == 1
    assert found.x == pytest.approx([2.0, -4.0, 1.0], rel=1e-15)
    assert (lanczos_root(lambda v: v, np.zeros(3), tolerance=1e-3).x == 0).all()


def test_preconditioning_keeps_a_root_and_saves_products():
    n = 12
    matrix = spread(6 * n, 10.0, 5)
    scale = np.geomspace(1, 1e4, 6 * n)
    matrix = matrix * np.outer(scale, scale)
    lone = np.stack([matrix[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] for i in range(n)])
    noise = np.eye(6 * n).reshape(n, 6, 6 * n)
    found = preconditioned_root(lambda v: (matrix @ v.ravel()).reshape(n, 6), lone, noise, tolerance=1e-11)
    root = found.x.reshape(6 * n, 6 * n)
    assert np.abs((root @ root.T - matrix) / np.outer(scale, scale)).max() < 1e-9
    assert found.products < 60
    one = preconditioned_root(lambda v: (matrix @ v.ravel()).reshape(n, 6), lone, noise[:, :, 7], tolerance=1e-11)
    assert (one.x == found.x[:, :, 7]).all()


def test_dense_root_takes_one_noise_or_many():
    matrix, noise = spread(12, 1e3, 6), np.random.default_rng(7).normal(size=(2, 6, 3))
    many = dense_root(matrix, noise)
    assert dense_root(matrix, noise[:, :, 1]) == pytest.approx(many[:, :, 1], rel=1e-14)
    root = dense_root(matrix, np.eye(12).reshape(2, 6, 12)).reshape(12, 12)
    assert root @ root.T == pytest.approx(matrix, abs=1e-10)
    with pytest.raises(np.linalg.LinAlgError):
        dense_root(-matrix, noise)


def field_at(shift, loads):
    """A matrix field of two bodies, M_ij = c_ij + g_ijk s_k + s_i s_j, times loads."""
    rng = np.random.default_rng(8)
    constant, slope = rng.normal(size=(12, 12)), rng.normal(size=(12, 12, 6))
    x = shift.ravel()
    wide = np.zeros(12)
    wide[[0, 1, 2, 6, 7, 8]] = x
    return ((constant + slope @ x + np.outer(wide, wide)) @ loads.ravel()).reshape(2, 6)


def test_divergence_of_a_field():
    slope = (lambda rng: (rng.normal(size=(12, 12)), rng.normal(size=(12, 12, 6)))[1])(np.random.default_rng(8))
    columns = [0, 1, 2, 6, 7, 8]
    expected = np.einsum("ijj->i", slope[:, columns, :]).reshape(2, 6)
    room = np.array([0.3, 2.0])
    assert divergence(field_at, room) == pytest.approx(expected, abs=1e-9)
    noise = np.random.default_rng(9).normal(size=(4000, 2, 3))
    estimates = np.array([divergence(field_at, room, w) for w in noise])
    apart = np.abs(estimates.mean(axis=0) - expected) / (estimates.std(axis=0) / np.sqrt(len(noise)))
    assert apart.max() < 5.5  # twelve normal numbers: 5e-7


def test_room_is_the_least_of_radius_and_gaps():
    centres = np.array([[0.0, 0.0, 1.5], [2.6, 0.0, 9.0], [2.6, 2.1, 9.0], [30.0, 0.0, 1.0]])
    radii = np.array([1.0, 1.0, 1.0, 2.0])
    assert room_to_move(centres, radii, centres[:, 2] - radii) == pytest.approx([0.5, 0.1, 0.1, 1.0])
    assert room_to_move(centres, radii, None) == pytest.approx([1.0, 0.1, 0.1, 2.0])
