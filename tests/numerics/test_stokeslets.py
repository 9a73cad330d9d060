"""The blocks of `stokeslets` against point solutions, surface averages, limits, and the numbers of another code."""

from pathlib import Path

import numpy as np
import pytest

from mpad_core.arrays import Array
from mpad_core.numerics import stokeslets

PEERS = Path(__file__).parents[2].parent / "shared" / "peer_refs"
SCALE = 1 / (8 * np.pi)


def peer_file(name: str) -> dict[str, Array]:
    if not (PEERS / name).is_file():
        pytest.skip(f"no reference numbers beside the clone: {PEERS / name}")
    with np.load(PEERS / name) as stored:
        return {key: stored[key] for key in stored}


def peer_order(grand: Array) -> Array:
    order = [0, 1, 2, 6, 7, 8, 3, 4, 5, 9, 10, 11]
    return grand[np.ix_(order, order)]


def blake(x: Array, y: Array) -> Array:
    """Give Blake's Green function times 8πη in his own form: Stokeslet, image, doublets (1971, equation 8)."""
    r, R, h = x - y, x - y * [1, 1, -1], y[2]
    d, D = np.linalg.norm(r), np.linalg.norm(R)
    G = np.eye(3) / d + np.outer(r, r) / d**3 - np.eye(3) / D - np.outer(R, R) / D**3
    for j, sign in enumerate((1, 1, -1)):
        for i in range(3):
            doublet = (i == j) / D**3 - 3 * R[i] * R[j] / D**5
            stokes = ((i == j) * R[2] - (i == 2) * R[j] + (j == 2) * R[i]) / D**3 - 3 * R[i] * R[j] * R[2] / D**5
            G[i, j] += 2 * h * sign * (h * doublet - stokes)
    return G


def surface(a: float, degree: int) -> tuple[Array, Array]:
    """Give points on a sphere and weights that sum to one, exact to the degree."""
    c, w = np.polynomial.legendre.leggauss(degree)
    angle = 2 * np.pi * np.arange(2 * degree) / (2 * degree)
    s = np.sqrt(1 - c**2)
    points = np.stack([np.outer(s, np.cos(angle)), np.outer(s, np.sin(angle)), np.outer(c, np.ones(2 * degree))], -1)
    return a * points.reshape(-1, 3), np.repeat(w / 2, 2 * degree) / (2 * degree)


def cross_of(v: Array) -> Array:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def rigid(a: float, points: Array) -> Array:
    """Give for each point (3, 6): traction of unit loads times the area; its transpose averages velocities (Faxén)."""
    return np.array([np.hstack([np.eye(3), -1.5 / a**2 * cross_of(p)]) for p in points])


def block(x: Array, y: Array, a: float, b: float, wall: bool = True) -> Array:
    out = np.empty((6, 6))
    stokeslets.pair_block(np.asarray(x, float), np.asarray(y, float), a, b, SCALE, wall, out)
    return out


def random_spheres(rng: np.random.Generator, count: int, spread: float) -> tuple[Array, Array]:
    radii = 10 ** rng.uniform(-1, 1, count)
    centres = rng.uniform(-spread, spread, (count, 3))
    centres[:, 2] = radii * (1 + rng.integers(0, 2, count) * 10 ** rng.uniform(-6, 1, count))
    return centres, radii


def test_own_blocks_are_those_of_another_code() -> None:
    peer = peer_file("rpb_single_wall.npz")
    units = np.array([6 * np.pi] * 3 + [8 * np.pi] * 3)
    units = np.where(np.arange(6)[:, None] // 3 == np.arange(6) // 3, units, 6 * np.pi)
    for height, expected in zip(peer["self_heights"], peer["self_M"], strict=True):
        found = stokeslets.self_mobilities(np.array([[0.3, -0.2, height]]), np.ones(1), 1.0, True)[0]
        assert abs(found * units - expected).max() < 1e-12


@pytest.mark.parametrize(("axis", "key"), [(0, "pair_M_offset_x"), (1, "pair_M_offset_y")])
def test_pair_blocks_are_those_of_another_code(axis: int, key: str) -> None:
    peer = peer_file("rpb_single_wall.npz")
    linear = np.arange(12) < 6
    units = np.where(~linear[:, None] & ~linear, 8 * np.pi, 6 * np.pi)
    for separation, row in zip(peer["pair_separations"], peer[key], strict=True):
        for height, expected in zip(peer["pair_heights"], row, strict=True):
            centres = np.array([[0.0, 0.0, height]] * 2)
            centres[:, axis] = separation / 2, -separation / 2
            found = peer_order(stokeslets.grand_mobility(centres, np.ones(2), 1.0, True))
            assert abs(found * units - expected).max() < 1e-12


def test_unbounded_pairs_are_those_of_another_code() -> None:
    peer = peer_file("rpy_freespace_pairs.npz")
    for at, a, viscosity, expected in zip(*(peer[k] for k in ("positions", "radius", "viscosity", "M")), strict=True):
        found = peer_order(stokeslets.grand_mobility(at, np.full(2, a), viscosity, False))
        scale = np.sqrt(np.diag(expected))
        assert (abs(found - expected) / np.outer(scale, scale)).max() < 1e-13


def test_points_make_blakes_green_function() -> None:
    x, y = np.array([0.4, -0.7, 1.3]), np.array([1.1, 0.2, 0.6])
    assert block(x, y, 0, 0)[:3, :3] / SCALE == pytest.approx(blake(x, y), abs=1e-14)


def test_faxen_by_finite_differences() -> None:
    """Laplacians on both sides, and half curls, of Blake's function; unequal radii."""
    x, y, a, b, d = np.array([0.9, -1.4, 1.7]), np.array([-0.8, 0.6, 1.2]), 0.9, 0.5, 5e-3
    steps = d * np.eye(3)

    def averaged(f, at, radius):  # type: ignore[no-untyped-def]
        laplacian = sum(f(at + s) + f(at - s) - 2 * f(at) for s in steps) / d**2
        return f(at) + radius**2 / 6 * laplacian

    def half_curl(f, at):  # type: ignore[no-untyped-def]
        slope = [(f(at + s) - f(at - s)) / (2 * d) for s in steps]
        return np.array([slope[i - 2][i - 1] - slope[i - 1][i - 2] for i in range(3)]) / 2

    tt = averaged(lambda p: averaged(lambda q: blake(p, q), y, b), x, a)
    rt = half_curl(lambda p: averaged(lambda q: blake(p, q), y, b), x)
    tr = half_curl(lambda q: averaged(lambda p: blake(p, q), x, a).T, y).T
    rr = half_curl(lambda p: half_curl(lambda q: blake(p, q).T, y).T, x)
    assert block(x, y, a, b) / SCALE == pytest.approx(np.block([[tt, tr], [rt, rr]]), abs=2e-5)


@pytest.mark.parametrize("distance", [2.9, 1.7, 1.1])  # apart, overlapping; the wall's part is smooth in any case
def test_wall_part_is_a_surface_average(distance: float) -> None:
    a, b = 1.2, 0.7
    x, y = np.array([0.0, 0.0, 1.9]), distance * np.array([0.6, 0.64, -0.48]) + [0, 0, 1.9]
    total, image = np.zeros((6, 6)), np.empty((6, 6))
    p, v = surface(a, 10)
    q, w = surface(b, 10)
    left, right = rigid(a, p), rigid(b, q)
    for i in range(len(p)):
        inner = np.zeros((3, 6))
        for k in range(len(q)):
            image[:] = 0
            stokeslets.add_image(x + p[i], y + q[k], 0.0, 0.0, SCALE, image)
            inner += w[k] * image[:3, :3] @ right[k]
        total += v[i] * left[i].T @ inner
    found = block(x, y, a, b) - block(x, y, a, b, wall=False)
    assert found == pytest.approx(total, abs=1e-7)


@pytest.mark.parametrize(("a", "b", "distance"), [(1.0, 0.6, 1.9), (1.0, 0.6, 1.3), (0.5, 1.0, 0.7), (1.0, 0.4, 0.3)])
def test_unbounded_block_is_a_surface_average(a: float, b: float, distance: float) -> None:
    """The flow of a lone moving sphere (inside: rigid), averaged over the other's surface, cut where it enters."""
    cut = np.clip((b * b - a * a - distance**2) / (2 * a * distance), -1, 1)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    angle = 2 * np.pi * np.arange(8) / 8
    total = np.zeros((6, 6))
    for low, high in ((-1.0, cut), (cut, 1.0)):
        for c, w in zip((high + low) / 2 + (high - low) / 2 * nodes, (high - low) / 2 * weights, strict=True):
            for t in angle:
                p = a * np.array([np.sqrt(1 - c * c) * np.cos(t), np.sqrt(1 - c * c) * np.sin(t), c])
                r = p + np.array([0, 0, distance])
                s = max(np.linalg.norm(r), b)  # inside, the flow is that of the rigid surface
                flow = (
                    np.eye(3) / s + np.outer(r, r) / s**3 + b * b / 3 * (np.eye(3) / s**3 - 3 * np.outer(r, r) / s**5)
                )
                if np.linalg.norm(r) < b:
                    flow = 4 / (3 * b) * np.eye(3)
                total += w / 16 * rigid(a, p[None])[0].T @ np.hstack([flow, -cross_of(r) / s**3])
    found = block([0, 0, distance], [0, 0, 0], a, b, wall=False)
    assert found / SCALE == pytest.approx(total, abs=1e-9)


def test_blocks_are_transposes_and_positive() -> None:
    rng = np.random.default_rng(1)
    for trial in range(400):
        centres, radii = random_spheres(rng, int(rng.integers(2, 10)), 10 ** rng.uniform(-1, 1.5))
        grand = stokeslets.grand_mobility(centres, radii, 1.0, trial % 4 > 0)
        scale = np.sqrt(np.diag(grand))
        assert (grand == grand.T).all()
        assert np.linalg.eigvalsh(grand / np.outer(scale, scale))[0] > 0
        one = block(centres[0], centres[1], radii[0], radii[1])
        other = block(centres[1], centres[0], radii[1], radii[0])
        assert (abs(one - other.T) / np.outer(scale[:6], scale[6:12])).max() < 1e-12 or trial % 4 == 0


def test_hundredfold_radii_touching_each_other_and_the_wall() -> None:
    for gap in (0.0, 1e-6, -0.5, -2.5):  # apart, overlapping, and inside
        reach = 100 + 1 + gap
        rise = 1.0 if gap >= -1 else 80.0
        flat = np.sqrt(reach**2 - (100 - rise) ** 2)
        centres = np.array([[0, 0, 100.0], [flat, 0, rise]])
        grand = stokeslets.grand_mobility(centres, np.array([100.0, 1.0]), 1.0, True)
        scale = np.sqrt(np.diag(grand))
        assert np.linalg.eigvalsh(grand / np.outer(scale, scale))[0] > 0


def test_far_from_the_wall_is_unbounded() -> None:
    x, y = np.array([0.0, 1.0, 0.0]), np.array([3.0, 0.0, 1.0])
    up = np.array([0, 0, 1e7])
    assert block(x + up, y + up, 1.2, 0.8) == pytest.approx(block(x, y, 1.2, 0.8, wall=False), abs=1e-8)


def test_lone_sphere_far_from_the_wall_as_lorentz_found() -> None:
    h = 50.0
    own = stokeslets.self_mobilities(np.array([[0, 0, h]]), np.ones(1), 1.0, True)[0] * 6 * np.pi
    assert own[0, 0] == pytest.approx(1 - 9 / 16 / h + 1 / 8 / h**3, abs=1e-8)
    assert own[2, 2] == pytest.approx(1 - 9 / 8 / h + 1 / 2 / h**3, abs=1e-8)
    assert own[3, 3] * 4 / 3 == pytest.approx(1 - 5 / 16 / h**3, abs=1e-12)
    assert own[5, 5] * 4 / 3 == pytest.approx(1 - 1 / 8 / h**3, abs=1e-12)


def test_no_slip_at_the_wall() -> None:
    """A tiny sphere at the wall is moved by no other, whatever the other does."""
    moved = block([2.0, 1.0, 1e-9], [0.0, 0.0, 1.5], 1e-9, 1.0)
    assert abs(moved[:3]).max() < 1e-9
    assert abs(block([2.0, 1.0, 1.5], [0.0, 0.0, 1.5], 1.0, 1.0)[:3]).max() > 1e-3


def test_flow_of_a_big_sphere_vanishes_on_the_wall() -> None:
    for x in ([0.3, 0.0, 0.0], [5.0, -2.0, 0.0], [0.0, 0.0, 0.0]):
        assert abs(block(x, [0.0, 0.0, 1.0], 0.0, 1.0)[:3]).max() < 1e-15


def test_one_inside_another_moves_with_it() -> None:
    inside = block([0.2, 0.1, 0.3], [0, 0, 0], 0.5, 2.0, wall=False)
    assert inside[:3, :3] == pytest.approx(np.eye(3) / (6 * np.pi * 2), abs=1e-16)
    assert inside[3:, 3:] == pytest.approx(np.eye(3) / (8 * np.pi * 8), abs=1e-16)
    assert (inside[3:, :3] == 0).all()
    assert inside[:3, 3:] == pytest.approx(-cross_of(np.array([0.2, 0.1, 0.3])) / (8 * np.pi * 8), abs=1e-16)
