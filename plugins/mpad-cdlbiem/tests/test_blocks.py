"""The fast blocks are the slow ones of `quadrature` in other units, symmetric, and sound at high degrees."""

import numpy as np
import pytest

from mpad_cdlbiem.spectral import quadrature
from mpad_core.numerics.harmonics.image import RAISE, image_of, image_operator
from mpad_core.numerics.harmonics.isolated import subtract_functions
from mpad_core.numerics.harmonics.layout import SIGNS, W, X, lowest, place, places, rigid_units, spots, strain_unit
from mpad_core.numerics.harmonics.pairs import pair_product, pairs_of, places_of
from mpad_core.numerics.harmonics.selves import (
    add_rigid_columns,
    apply_inverse,
    axial_matrix,
    inverse_size,
    self_inverse,
)
from mpad_core.numerics.harmonics.translation import HIGHEST, axial_blocks, axial_size, count
from mpad_core.numerics.harmonics.turning import turn_blocks, turn_size, turn_start

DIRECTIONS = [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -1, 0), (-1, 0.3, -0.05), (0.5, 0.8, 0.9), (-0.2, -0.4, -1)]


def unit_vectors(number, seed=1):
    vectors = np.random.default_rng(seed).normal(size=(number, 3))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def close(got, expected, error):
    np.testing.assert_allclose(got, expected, rtol=0, atol=error)


def orders(p):
    """Give n and m of the quadrature's harmonics."""
    n = np.repeat(np.arange(1, p + 1), 2 * np.arange(1, p + 1) + 1)
    return n, np.arange(len(n)) - (n * n - 1) - n


def spots_and_units(p, radius):
    """Give where in a flat y (2, 3, T) the quadrature's c[f, k], raveled, belong, and what they are multiplied by."""
    n, m = orders(p)
    single_layer = n / ((2 * n + 1.0) * (2 * n + 3)), (n + 1) / ((2 * n - 1.0) * (2 * n + 1)), 1 / (2 * n + 1.0)
    family, sine = np.arange(3)[:, None], m < 0
    row = np.where(family == X, ~sine, sine)
    sign = np.where((family == X) & sine, -1, 1)
    at = (row * 3 + family) * places(p) + place(n, abs(m))
    return at.ravel(), (sign * np.sqrt(radius / np.array(single_layer))).ravel()


def to_y(p, radius, c):
    at, units = spots_and_units(p, radius)
    out = np.zeros(6 * places(p))
    out[at] = units * np.ravel(c)
    return out


def to_c(p, radius, y):
    at, units = spots_and_units(p, radius)
    return (np.ravel(y)[at] / units).reshape(3, -1)


def in_layout(block, p, a, q, b):
    """Give a block of the quadrature as the layout has it."""
    (to, units), (of, source_units) = spots_and_units(p, a), spots_and_units(q, b)
    out = np.zeros((6 * places(p), 6 * places(q)))
    out[np.ix_(to, of)] = units[:, None] * block / source_units
    return out


def random_sources(p):
    return to_y(p, 1.0, np.random.default_rng(0).normal(size=3 * p * (p + 2))).reshape(2, 3, -1)


class Spheres:
    def __init__(self, centres, radii, degrees, wall, who=((0, 1),), pair_degrees=None):
        self.centres, self.radii, self.wall = np.array(centres, dtype=float), np.array(radii), wall
        self.at = places_of(np.array(degrees), wall)
        who = np.array(who)
        pair_degrees = self.at.degrees[who] if pair_degrees is None else np.array(pair_degrees)
        self.pairs = pairs_of(self.centres, self.radii, who, pair_degrees, wall)
        heights = self.centres[:, 2] / self.radii if wall else ()
        operators = [operator_of(p, height).ravel() for p, height in zip(degrees, heights, strict=False)]
        self.operators = np.concatenate([np.empty(0), *operators])

    def product(self, y):
        out = np.empty_like(y)
        pair_product(self.at, self.pairs, self.operators, self.wall, y, out)
        return out

    def block(self, i, j):
        """Give what sphere i gets from sphere j as a matrix."""
        own = self.at.own
        columns = np.eye(own[-1])[own[j] : own[j + 1]]
        return np.array([self.product(column)[own[i] : own[i + 1]] for column in columns]).T


def operator_of(p, height):
    out = np.empty((places(p), 5, 3, 3))
    image_operator(p, height, out)
    return out


def test_rigid_motions_and_strain_lie_where_layout_says():
    radius, motion = 0.7, np.array([0.3, 0.2, -0.5, 1.1, -0.4, 0.6])
    y = to_y(3, radius, quadrature.rigid_trace(3, radius, motion))
    np.testing.assert_allclose(y[[*spots(3)]], motion * rigid_units(np.array([radius]))[0])
    np.testing.assert_allclose(np.linalg.norm(y), np.linalg.norm(y[[*spots(3)]]))  # and nowhere else
    np.testing.assert_array_equal(np.sign(rigid_units(np.array([radius]))[0]), SIGNS)
    directions, weights = quadrature.sphere_rule(4, 8, np.array([0.0, 0.0, 1.0]))
    shear = radius * directions[:, [2, 1, 0]] * [1, 0, 1] / np.sqrt(2)
    strained = to_y(2, radius, np.einsum("fkns,ns,n", quadrature.vector_harmonics(2, directions), shear, weights))
    assert strained.reshape(2, 3, -1)[0, W, place(2, 1)] == pytest.approx(strain_unit(radius))
    assert np.linalg.norm(strained) == pytest.approx(strain_unit(radius))


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize(("radii", "degrees", "gap"), [((0.6, 1.0), (3, 5), 0.3), ((1.0, 1.0), (4, 4), 0.01)])
def test_direct_block_is_the_quadratures(direction, radii, degrees, gap):
    offset = (sum(radii) + gap) * np.array(direction) / np.linalg.norm(direction)
    spheres = Spheres([offset, np.zeros(3)], radii, degrees, wall=False)
    (p, q), (a, b) = degrees, radii
    expected = in_layout(quadrature.direct_block(p, a, q, b, offset, n_extra=48), p, a, q, b)
    close(spheres.block(0, 1), expected, 1e-12)
    expected = in_layout(quadrature.direct_block(q, b, p, a, -offset, n_extra=48), q, b, p, a)
    close(spheres.block(1, 0), expected, 1e-12)


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize(("radii", "degrees"), [((0.6, 1.0), (3, 5)), ((1.0, 0.8), (4, 2))])
def test_image_block_is_the_quadratures(direction, radii, degrees):
    offset = (sum(radii) + 0.2) * np.array(direction) / np.linalg.norm(direction)
    lower = np.array([0.4, -0.2, max(radii) + 0.05 + max(0, -offset[2])])
    centres = [lower + offset, lower]
    spheres, free = (Spheres(centres, radii, degrees, wall) for wall in (True, False))
    for i, j in ((0, 1), (1, 0)):
        p, q, a, b = degrees[i], degrees[j], radii[i], radii[j]
        expected = in_layout(quadrature.image_block(p, a, centres[i], q, b, centres[j]), p, a, q, b)
        close(spheres.block(i, j) - free.block(i, j), expected, 1e-12)


def test_a_pair_may_have_lower_degrees_than_its_spheres():
    centres, radii = [[0.0, 0.0, 1.5], [1.0, 1.5, 2.5]], [1.0, 0.7]
    full, less = (Spheres(centres, radii, (5, 4), False, pair_degrees=[d]) for d in ((5, 4), (3, 2)))
    block = full.block(0, 1).reshape(2, 3, places(5), 2, 3, places(4)).copy()
    block[:, :, places(3) :] = 0
    block[..., places(2) :] = 0
    close(less.block(0, 1).ravel(), block.ravel(), 1e-14)


@pytest.mark.parametrize("wall", [False, True])
def test_product_is_symmetric_whatever_the_degrees(wall):
    centres = [[0.0, 0.0, 1.02], [0.3, -2.2, 1.5], [0.2, 0.1, 3.1]]
    spheres = Spheres(
        centres, [1.0, 1.2, 0.9], (7, 4, 9), wall, who=[(0, 1), (2, 1), (2, 0)], pair_degrees=[(5, 4), (3, 4), (9, 6)]
    )
    x, y = np.random.default_rng(3).normal(size=(2, spheres.at.own[-1]))
    one, other = x @ spheres.product(y), y @ spheres.product(x)
    assert abs(one - other) < 1e-14 * np.linalg.norm(x) * np.linalg.norm(y)
    assert abs(one) > 0.1


@pytest.mark.parametrize("height", [1.01, 3.0])
@pytest.mark.parametrize("radius", [1.0, 0.7])
def test_image_is_the_field_that_the_wall_adds(height, radius):
    p, centre = 6, np.array([0.3, -0.4, height * radius])
    y, image = random_sources(p), np.empty((2, 3, places(p + RAISE)))
    image_of(p, operator_of(p, height), y, image)
    points = 3 * radius * np.abs(unit_vectors(8))
    expected = np.tensordot(to_c(p, radius, y), quadrature.image_fields(p, radius, centre, points))
    about_image = quadrature.exterior_fields(p + RAISE, radius, points - quadrature.MIRROR * centre)
    fast = np.tensordot(to_c(p + RAISE, radius, image), about_image)
    close(fast, expected, 1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("gap", [1.0, 0.1, 0.01])
def test_self_inverse_undoes_identity_and_image(gap):
    p, a = 5, 0.8
    centre = np.array([0.0, 0.0, a * (1 + gap)])
    inverse = np.empty(inverse_size(p))
    assert self_inverse(p, 1 + gap, operator_of(p, 1 + gap), inverse)
    own = np.eye(6 * places(p)) + in_layout(quadrature.image_block(p, a, centre, p, a, centre, n_extra=64), p, a, p, a)
    y = random_sources(p).ravel()
    out, at = np.empty_like(y), (np.array([p]), np.array([0, len(y)]), inverse)
    apply_inverse(*at, own @ y, out)
    close(out, y, 1e-12 / min(1, gap))
    motion, trace, answer = np.arange(1.0, 7.0), np.zeros_like(y), np.zeros_like(y)
    trace[[*spots(p)]] = motion
    add_rigid_columns(*at, motion[None], answer)
    apply_inverse(*at, trace, out)
    close(answer, out, 1e-13)


def turns(p, angle):
    """Give for each degree the matrices of cosines and of sines."""
    out = np.full(turn_size(p), np.nan)
    turn_blocks(p, angle, out)
    return [out[turn_start(n) : turn_start(n + 1)].reshape(2, n + 1, n + 1) for n in range(1, p + 1)]


@pytest.mark.parametrize("angle", [0.0, 1e-3, -1.3, np.pi / 2, 3.0, np.pi])
@pytest.mark.parametrize("p", [3, 122])
def test_turns_are_orthogonal(p, angle):
    for cosines, sines in turns(p, angle):
        close(cosines @ cosines.T, np.eye(len(cosines)), 5e-12)
        close(sines[1:, 1:] @ sines[1:, 1:].T, np.eye(len(sines) - 1), 5e-12)
        assert not np.concatenate([sines[0], sines[:, 0]]).any()


def test_turns_compose():
    for one, other, both in zip(turns(60, 0.7), turns(60, -1.9), turns(60, -1.2), strict=True):
        close(one @ other, both, 1e-13)


def scalar_harmonics(p, directions):
    """Give Y (K, n): the radial parts of W."""
    n = orders(p)[0][:, None]
    return np.einsum("kns,ns->kn", quadrature.vector_harmonics(p, directions)[W], directions) * np.sqrt((2 * n + 1) / n)


@pytest.mark.parametrize("p", [6, 60])
@pytest.mark.parametrize("angle", [0.3, -1.2, 2.6])
def test_turned_harmonics_are_those_about_the_turned_axis(p, angle):
    directions = unit_vectors(9)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])  # takes z to (sin, 0, cos)
    plain, about_turned = scalar_harmonics(p, directions), scalar_harmonics(p, directions @ turn)
    for n, (cosines, sines) in enumerate(turns(p, angle), start=1):
        zero = n * n - 1 + n
        close(cosines.T @ plain[zero : zero + n + 1], about_turned[zero : zero + n + 1], 1e-12)
        odd = np.arange(zero - 1, zero - n - 1, -1)
        close(sines[1:, 1:].T @ plain[odd], about_turned[odd], 1e-12)


def moves(p, a, q, b, distance):
    """Yield the axial blocks order by order, as matrices."""
    blocks = np.full(axial_size(p, q), np.nan)
    axial_blocks(p, a, q, b, distance, blocks)
    assert np.isfinite(blocks).all()
    starts = np.cumsum([0] + [6 * count(p, m) * count(q, m) for m in range(min(p, q))])
    yield from (axial_matrix(p, q, m, blocks[start:]) for m, start in enumerate(starts))


def mirrored(p, m):
    """Give the signs of V, W, X of order m in the mirror z -> -z."""
    signs = (-1.0) ** (np.arange(lowest(m), p + 1) - m)
    return np.concatenate([signs, signs, -signs])


@pytest.mark.parametrize(("p", "q"), [(60, 60), (122, 120), (HIGHEST, 12)])
@pytest.mark.parametrize(("a", "distance"), [(1.0, 2.0), (0.05, 1.05), (1.0, 1e4)])
def test_high_degrees_are_finite_and_reciprocal(p, q, a, distance):
    ways = moves(p, a, q, 1.0, distance), moves(q, 1.0, p, a, distance)
    for m, (one, other) in enumerate(zip(*ways, strict=True)):
        seen_from_above = mirrored(q, m)[:, None] * one.T * mirrored(p, m)
        close(other, seen_from_above, 1e-13)


def test_high_degrees_give_the_field_on_a_touching_sphere():
    p, q, a, b = 60, 3, 0.7, 1.0
    spheres, directions = Spheres([[0, 0, a + b], [0, 0, 0]], (a, b), (p, q), wall=False), unit_vectors(6)
    y = np.concatenate([np.zeros(6 * places(p)), random_sources(q).ravel()])
    trace = to_c(p, a, spheres.product(y)[: 6 * places(p)])
    fields = quadrature.exterior_fields(q, b, a * directions + spheres.centres[0])
    field = np.tensordot(to_c(q, b, y[6 * places(p) :]), fields)
    close(np.tensordot(trace, quadrature.vector_harmonics(p, directions)), field, 1e-13)


def radii_of_iteration(p, gap):
    """Give the spectral radii of one sphere's deflated double layer and of its coupling to its image, orders 0 to 2.

    With K the double layer of a lone sphere (diagonal, by continuity of tractions) densities q have traces (1 + K) q,
    and above the wall (1 + T)(1 + K) q, T the trace of the image. Rigid motions, for which 1 + K is zero, are deflated
    by the projector on them (Kim and Karrila, Microhydrodynamics, ch. 17). The coupling is T between all that is not a
    rigid motion: forces and torques are given, and do not iterate.
    """
    operator, radii = operator_of(p, 1 + gap), []
    for m, moved in zip(range(3), moves(p, 1.0, p + RAISE, 1.0, 2 + 2 * gap), strict=False):
        n = np.arange(lowest(m), p + 1)
        image = np.zeros((3, count(p + RAISE, m), 3, len(n)))
        for raised in range(-RAISE, RAISE + 1):
            of = n[n + raised >= n[0]]
            image[:, of + raised - n[0], :, of - n[0]] = operator[place(of, m), raised + RAISE]
        coupling = moved @ image.reshape(moved.shape[1], -1)
        lone = np.concatenate([3 / ((2 * n + 1) * (2 * n + 3)), -3 / ((2 * n - 1) * (2 * n + 1)), -3 / (2 * n + 1)])
        free, root = 1 + lone > 1e-9, np.sqrt(np.maximum(1 + lone, 0))  # (1 + K)^½ makes it symmetric
        deflated = root[:, None] * coupling * root + np.diag(lone * free)
        radii.append([np.abs(np.linalg.eigvalsh(each)).max() for each in (deflated, coupling[np.ix_(free, free)])])
    return np.max(radii, axis=0)


@pytest.mark.parametrize(
    ("gap", "p", "deflated", "coupling", "error"),
    [
        (1e8, 4, 0.6, 0.0, 1e-14),  # as in unbounded fluid, where X of degree 2 has -3/5
        (10, 6, 0.6000, 0.0009, 6e-5),
        (1, 10, 0.6022, 0.1548, 6e-5),
        (0.3, 16, 0.6272, 0.5442, 6e-5),
        (0.1, 30, 0.8518, 0.8450, 6e-5),
        (0.05, 40, 0.9358, 0.9345, 6e-5),
        (0.01, 80, 0.9931, 0.9931, 6e-5),
        (1e-3, 160, 0.99977, 0.99977, 6e-6),  # still 0.9997 at degree 120
    ],
)
def test_spectral_radii_at_the_wall(gap, p, deflated, coupling, error):
    close(radii_of_iteration(p, gap), [deflated, coupling], error)


def test_harmonics_of_degree_one_do_not_see_strain():
    """The coarse level may have no more: what it has of the loads in strain is nothing, not something else."""
    axial = np.empty(axial_size(1, 1))
    axial_blocks(1, 1.0, 1, 1.0, 2.1, axial)
    functions = np.zeros(22)
    subtract_functions(1, 1, 1.0, axial, functions)
    assert (functions[16:] == 0).all()
    assert (functions[[0, 2, 6, 10]] < -6 * np.pi).all()  # each held sphere adds to the other's drag
