"""The couplings of `stresslets` against averages of Green's functions over spheres, other formulas, limits and laws."""

import numba
import numpy as np
import pytest

from mpad_core.arrays import Array
from mpad_core.numerics import stokeslets, stresslets

SCALE = 1 / (8 * np.pi)
STRAIN_OWN = 3 / (20 * np.pi)  # of a lone sphere of radius one, over its stresslet


def oseen(r: Array) -> Array:
    """Give the velocity of a point force times 8πη, for many r (..., 3)."""
    d = np.linalg.norm(r, axis=-1)[..., None, None]
    return np.eye(3) / d + r[..., :, None] * r[..., None, :] / d**3


def blake_image(x: Array, y: Array) -> Array:
    """Give what the wall adds to it in Blake's own form: image, doublets and Stokes doublets (1971, equation 8)."""
    R, h = x - y * [1, 1, -1], y[..., 2, None, None]
    D, up = np.linalg.norm(R, axis=-1)[..., None, None], np.array([0, 0, 1.0])
    RR, eye, lean = R[..., :, None] * R[..., None, :], np.eye(3), R[..., None, :] * up[:, None]
    doublet = eye / D**3 - 3 * RR / D**5
    stokes = (eye * R[..., 2, None, None] - lean + R[..., :, None] * up) / D**3 - 3 * RR * R[..., 2, None, None] / D**5
    return -oseen(R) + 2 * h * (h * doublet - stokes) * [1, 1, -1]


def tensors() -> Array:
    """Give the orthonormal tensors of the module's text, (5, 3, 3)."""
    x, y, z = np.eye(3)
    both = [np.outer(x, z) + np.outer(z, x), np.outer(y, z) + np.outer(z, y)]
    flat = [np.diag([1.0, -1, 0]), np.outer(x, y) + np.outer(y, x)]
    return np.array([np.diag([-1.0, -1, 2]) / np.sqrt(6)] + [t / np.sqrt(2) for t in both + flat])


def surface(a: float, degree: int) -> tuple[Array, Array]:
    """Give points p on a sphere, and per point (3, 11) the weight times the tractions of unit loads times the area."""
    c, w = np.polynomial.legendre.leggauss(degree)
    angle = np.pi * np.arange(2 * degree) / degree
    s = np.sqrt(1 - c**2)
    n = np.stack([np.outer(s, np.cos(angle)), np.outer(s, np.sin(angle)), np.outer(c, np.ones(2 * degree))], -1)
    n = n.reshape(-1, 3)
    torque = 1.5 / a * np.cross(np.eye(3)[None], n[:, None]).transpose(0, 2, 1)  # (3/2a) T × n
    stress = 3 / a * np.einsum("kij,pj->pik", tensors(), n)
    tractions = np.concatenate([np.broadcast_to(np.eye(3), torque.shape), torque, stress], axis=-1)
    return a * n, tractions * np.repeat(w / 2, 2 * degree)[:, None, None] / (2 * degree)


def averaged(x: Array, y: Array, a: float, b: float, image: bool, degree: int) -> Array:
    """Give the block of two spheres by quadrature over both."""
    (p, left), (q, right) = surface(a, degree), surface(b, degree)
    target, source = (x + p)[:, None], (y + q)[None]
    green = blake_image(target, source) if image else oseen(target - source)
    motions = np.tensordot(green, right, axes=([1, 3], [0, 1]))
    return SCALE * np.tensordot(left, motions, axes=([0, 1], [0, 1]))


def block(x: Array, y: Array, a: float, b: float, wall: bool = True) -> Array:
    out = np.empty((11, 11))
    stresslets.pair_block_fts(np.asarray(x, float), np.asarray(y, float), a, b, SCALE, wall, out)
    return out


def image(x: Array, y: Array, a: float, b: float) -> Array:
    out = np.zeros((11, 11))
    stresslets.add_image_fts(np.asarray(x, float), np.asarray(y, float), a, b, SCALE, out)
    return out


def own(x: Array, a: float, wall: bool) -> Array:
    """Give a sphere's own block."""
    out = np.zeros((11, 11))
    if wall:
        stresslets.image_self_fts(x, a, SCALE, out)
    return out + np.diag([1 / (6 * np.pi * a)] * 3 + [1 / (8 * np.pi * a**3)] * 3 + [STRAIN_OWN / a**3] * 5)


def apart(rng: np.random.Generator, count: int, gap: float = 1e-3) -> tuple[Array, Array]:
    """Give random spheres of radii up to 10:1 that do not overlap, some of them at the wall."""
    radii = 10 ** rng.uniform(-0.5, 0.5, count)
    reach, centres = 2 * max(radii) * count ** (1 / 3) + 1, np.zeros((0, 3))
    while len(centres) < count:
        a = radii[len(centres)]
        at = rng.uniform(-reach, reach, 3)
        at[2] = a * (1 + gap) if rng.uniform() < 0.3 else a + reach * rng.uniform()
        if (np.linalg.norm(centres - at, axis=1) > (radii[: len(centres)] + a) * (1 + gap)).all():
            centres = np.vstack([centres, at])
    return centres, radii


def grand(centres: Array, radii: Array, wall: bool) -> Array:
    """Give the blocks of all pairs; none of a sphere with itself."""
    count = len(radii)
    out = np.zeros((count, 11, count, 11))
    for i in range(count):
        for j in range(count):
            if i != j:
                out[i, :, j] = block(centres[i], centres[j], radii[i], radii[j], wall)
    return out.reshape(11 * count, 11 * count)


UNBOUNDED = [(1.0, 1.0, [3.1, 2.4, -3.5]), (1.2, 0.6, [0.0, 0.0, 4.5]), (1.0, 0.1, [-2.0, 1.6, 0.4])]
WALLED = [
    (1.0, 1.0, [0.4, -0.3, 2.1], [1.9, 1.4, 2.6]),
    (1.2, 0.6, [0.3, 0.2, 1.9], [0.3, 0.2, 4.1]),  # one above the other
    (0.1, 1.0, [-0.6, 1.1, 0.9], [0.2, 0.4, 2.0]),
    (1.0, 1.0, [0.4, -0.3, 2.5], [0.4, -0.3, 2.5]),  # a sphere and its own image
]


@pytest.mark.parametrize(("a", "b", "r"), UNBOUNDED)
def test_unbounded_block_is_an_average_over_both_spheres(a: float, b: float, r: list[float]) -> None:
    expected = averaged(np.array(r), np.zeros(3), a, b, False, 16)
    assert block(r, [0, 0, 0], a, b, wall=False) == pytest.approx(expected, abs=1e-11)


@pytest.mark.parametrize(("a", "b", "x", "y"), WALLED)
def test_wall_part_is_an_average_over_both_spheres(a: float, b: float, x: list[float], y: list[float]) -> None:
    expected = averaged(np.array(x), np.array(y), a, b, True, 16)
    assert image(x, y, a, b) == pytest.approx(expected, abs=1e-11)


def test_forces_and_torques_move_as_without_stresslets() -> None:
    rng = np.random.default_rng(2)
    for trial in range(100):
        centres, radii = apart(rng, 2)
        expected = np.empty((6, 6))
        wall = trial % 4 > 0
        stokeslets.pair_block(centres[0], centres[1], radii[0], radii[1], SCALE, wall, expected)
        found = block(centres[0], centres[1], radii[0], radii[1], wall)[:6, :6]
        assert abs(found - expected).max() < 1e-13 * abs(expected).max()


def test_surface_of_a_strained_sphere_moves_with_the_strain() -> None:
    """The flow of S·n on a lone sphere is S·r/((20/3)πηb³) at its surface, which is its own block."""
    r = 1.3 * np.array([0.48, -0.6, 0.64])
    assert block(r, [0, 0, 0], 0.0, 1.3, wall=False)[:3, 6:] == pytest.approx(
        STRAIN_OWN / 1.3**3 * (tensors() @ r).T, abs=1e-16
    )


def test_swimmer_is_drawn_to_the_wall_as_berke_found() -> None:
    """Berke, Turner, Berg and Lauga, Phys. Rev. Lett. 101 (2008) 038102, equation 2: a dipole of strength one."""
    h, out = 1.7, np.empty((11, 11))
    stresslets.image_self_fts(np.array([0.3, -0.4, h]), 0.0, SCALE, out)
    for angle in (0.0, 0.4, 1.1, np.pi / 2):
        t = np.array([0.6 * np.sin(angle), 0.8 * np.sin(angle), np.cos(angle)])
        dipole = tensors() @ t @ t
        rise = -3 / (64 * np.pi * h**2) * (1 - 3 * np.cos(angle) ** 2)
        turn = 3 / (64 * np.pi * h**3) * np.sin(angle) * np.cos(angle)
        assert (out[:6, 6:] @ dipole)[2] == pytest.approx(rise, abs=1e-16)
        assert np.linalg.norm((out[:6, 6:] @ dipole)[3:]) == pytest.approx(turn, abs=1e-16)


def test_no_slip_at_the_wall() -> None:
    for x in ([0.3, 0.0, 0.0], [5.0, -2.0, 0.0], [0.0, 0.0, 0.0]):
        assert abs(block(x, [0.0, 0.0, 1.0], 0.0, 1.0)[:3]).max() < 1e-15


def test_far_from_the_wall_is_unbounded() -> None:
    x, y, up = np.array([0.0, 1.0, 0.0]), np.array([3.0, 0.0, 1.0]), np.array([0, 0, 1e7])
    assert block(x + up, y + up, 1.2, 0.8) == pytest.approx(block(x, y, 1.2, 0.8, wall=False), abs=1e-8)


def test_blocks_are_transposes_and_positive() -> None:
    rng = np.random.default_rng(1)
    for trial in range(60):
        count = int(rng.integers(2, 8))
        centres, radii = apart(rng, count)
        wall = trial % 4 > 0
        full = grand(centres, radii, wall)
        assert abs(full - full.T).max() < 1e-13 * abs(full).max()
        for i in range(count):
            full[11 * i : 11 * i + 11, 11 * i : 11 * i + 11] = own(centres[i], radii[i], wall)
        scale = np.sqrt(np.diag(full))
        assert np.linalg.eigvalsh(full / np.outer(scale, scale))[0] > 1e-3


@pytest.mark.parametrize("wall", [True, False])
@pytest.mark.parametrize("count", [1, 2, 32, 33, 64, 90])
def test_product_is_the_matrix_times_the_loads(count: int, wall: bool) -> None:
    rng = np.random.default_rng(count)
    centres, radii = apart(rng, count)
    loads = rng.normal(size=(count, 11))
    expected = grand(centres, radii, wall) @ loads.reshape(-1) / 0.7
    found = stresslets.fts_product(centres, radii, 0.7, wall, loads)
    assert np.linalg.norm(found.reshape(-1) - expected) <= 1e-13 * np.linalg.norm(expected)


def many(count: int) -> tuple[Array, Array, Array]:
    """Give more tiles of spheres than there are shares."""
    rng = np.random.default_rng(3)
    x, y = np.divmod(np.arange(count), 40)
    centres = np.stack([2.5 * x, 2.5 * y, 1.1 + rng.uniform(size=count)], axis=-1)
    return centres, 10 ** rng.uniform(-1, 0, count), rng.normal(size=(count, 11))


def test_product_of_many_meets_every_pair_once() -> None:
    centres, radii, loads = many(1200)
    found = stresslets.fts_product(centres, radii, 1.0, True, loads)
    for i in (0, 31, 32, 700, 1199):
        others = [j for j in range(1200) if j != i]
        expected = sum(block(centres[i], centres[j], radii[i], radii[j]) @ loads[j] for j in others)
        assert found[i] == pytest.approx(expected, abs=1e-11)


def test_bits_of_the_product_do_not_depend_on_the_threads() -> None:
    given, found = many(500), []
    before = numba.get_num_threads()
    for threads in sorted({1, numba.config.NUMBA_NUM_THREADS}):
        numba.set_num_threads(threads)
        found.append(stresslets.fts_product(given[0], given[1], 1.0, True, given[2]))
    numba.set_num_threads(before)
    assert (found[0] == found[-1]).all()


def test_spheres_in_one_place_give_each_other_the_wall_part_alone() -> None:
    x, a = np.array([1.0, 2.0, 3.0]), 0.8
    found = stresslets.fts_product(np.array([x, x]), np.full(2, a), 1.0, True, np.eye(11)[[0, 6]])
    assert found[0] == pytest.approx(image(x, x, a, a)[:, 6], abs=1e-16)
    assert found[1] == pytest.approx(image(x, x, a, a)[:, 0], abs=1e-16)
    assert (block(x, x, a, a, wall=False) == 0).all()
