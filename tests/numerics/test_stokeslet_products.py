"""Products against the matrix itself: one tile and many, overlaps, either wall, any number of threads."""

import numba
import numpy as np
import pytest

from mpad_core.arrays import Array
from mpad_core.numerics.stokeslet_products import ALONE, SHARES, TILE, mobility_product, translation_product
from mpad_core.numerics.stokeslets import grand_mobility

LARGEST = SHARES * TILE + 100  # shares of one and of two tiles, the last not full


def spheres(count: int, spread: float = 8.0) -> tuple[Array, Array]:
    """Give spheres with radii over two decades, many overlapping or within each other, some touching the wall."""
    rng = np.random.default_rng(count)
    radii = 10 ** rng.uniform(-1, 1, count)
    centres = rng.uniform(-spread, spread, (count, 3))
    centres[:, 2] = radii * (1 + rng.integers(0, 2, count) * 10 ** rng.uniform(-6, 1, count))
    return centres, radii


def loads(count: int) -> Array:
    return np.random.default_rng(count + 1).normal(size=(count, 6))


@pytest.mark.parametrize("wall", [True, False])
@pytest.mark.parametrize("count", [0, 1, 3, 64, 65, 128, 150, 200, 257, 383])
def test_product_is_the_matrix_times_the_loads(count: int, wall: bool) -> None:
    centres, radii = spheres(count)
    grand = grand_mobility(centres, radii, 0.7, wall)
    expected = (grand @ loads(count).reshape(-1)).reshape(count, 6)
    found = mobility_product(centres, radii, 0.7, wall, loads(count))
    assert np.linalg.norm(found - expected) <= 1e-13 * np.linalg.norm(expected)


@pytest.mark.parametrize("wall", [True, False])
@pytest.mark.parametrize("count", [0, 1, 64, 65, 150, 257])
def test_translation_product_is_the_matrix_times_forces(count: int, wall: bool) -> None:
    centres, radii = spheres(count)
    forces = np.ascontiguousarray(loads(count)[:, :3])
    blocks = grand_mobility(centres, radii, 0.7, wall).reshape(count, 6, count, 6)
    expected = np.einsum("ikjm,jm->ik", blocks[:, :3, :, :3], forces)
    found = translation_product(centres, radii, 0.7, wall, forces)
    assert np.linalg.norm(found - expected) <= 1e-13 * np.linalg.norm(expected)


@pytest.mark.parametrize("wall", [True, False])
@pytest.mark.parametrize("column", range(6))
def test_each_sphere_and_load_to_its_own_size(column: int, wall: bool) -> None:
    """A unit load on one sphere; every motion relative to itself, though at the wall two parts cancel in it."""
    centres, radii = spheres(150, spread=40.0)
    unit = np.zeros((150, 6))
    unit[70, column] = 1.0
    expected = grand_mobility(centres, radii, 1.0, wall)[:, 6 * 70 + column].reshape(150, 6)
    found = mobility_product(centres, radii, 1.0, wall, unit)
    for part in (slice(3), slice(3, 6)):
        error = np.linalg.norm((found - expected)[:, part], axis=1)
        assert (error <= 1e-11 * np.linalg.norm(expected[:, part], axis=1)).all()


@pytest.mark.parametrize("count", [TILE * SHARES - 1, LARGEST])
def test_many_tiles_meet_once(count: int) -> None:
    """Rows of the matrix, formed pair by pair, for spheres all round the circle of shares."""
    centres, radii = spheres(count, spread=60.0)
    load = loads(count)
    found = mobility_product(centres, radii, 1.0, True, load)
    for sphere in (0, 1, TILE, count // 2, count - 1):
        pairs = np.empty((6, count, 6))
        for other in range(count):
            two = [sphere, other]
            pairs[:, other] = grand_mobility(centres[two], radii[two], 1.0, True)[:6, 6:]
        expected = np.einsum("kjm,jm->k", pairs, load)
        scale = np.einsum("kjm,jm->k", abs(pairs), abs(load))
        assert (abs(found[sphere] - expected) < 1e-13 * scale).all()


@pytest.mark.parametrize("count", [TILE * (ALONE + 1), 500, LARGEST])
def test_bits_do_not_depend_on_the_number_of_threads(count: int) -> None:
    if numba.config.NUMBA_NUM_THREADS < 2:
        pytest.skip("one processor")
    centres, radii = spheres(count)
    everyone = numba.get_num_threads()
    found = []
    try:
        for threads in range(1, everyone + 1):
            numba.set_num_threads(threads)
            found.append(mobility_product(centres, radii, 1.0, True, loads(count)))
    finally:
        numba.set_num_threads(everyone)
    assert all((one == found[0]).all() for one in found)


@pytest.mark.parametrize("count", [60, 200])
def test_what_is_not_a_number_spreads_as_in_the_matrix(count: int) -> None:
    centres, radii = spheres(count)
    load = loads(count)
    load[7, 0] = np.nan
    assert np.isnan(mobility_product(centres, radii, 1.0, True, load)).all()


def test_copies_that_fill_a_tile_do_nothing() -> None:
    """Spheres in the same place as the last one's copies, which have no radius, and the last one with a huge load."""
    centres = np.array([[0.0, 0.0, 2.0], [0.0, 0.0, 2.0], [0.5, 0.0, 2.0], [9.0, 0.0, 2.0], [0.0, 0.0, 2.0]])
    radii = np.array([1.0, 0.5, 2.0, 1.0, 1.5])
    load = np.ones((5, 6))
    load[4] = 1e9
    expected = grand_mobility(centres, radii, 1.0, True) @ load.reshape(-1)
    found = mobility_product(centres, radii, 1.0, True, load)
    assert np.linalg.norm(found.reshape(-1) - expected) < 1e-13 * np.linalg.norm(expected)
