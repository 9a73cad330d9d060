"""The sphere as a cubed-sphere mesh of constant elements, and its own block of the equations.

Seen from its own sphere an element is one point, its centroid. Seen from other spheres and by way of the wall it is
several Gauss points, and the kernel is blurred over a part of its width (as in regularised Stokeslets, Cortez, SIAM J.
Sci. Comput. 23 (2001) 1204). Without, what two surfaces at a small gap do to each other depends on whether elements
happen to face each other, and the discrete mobility is not even positive: integrating exactly does not help, for the
surface's own part has errors of the size of the small eigenvalues that contact makes. With it, elements resolve of the
lubrication nearly the same from all sides, and less than there is, so that the rest can be added. The blur fades with
the square of the distance; it changes the mobility of two spheres by 2e-3 at a gap of 0.3 radii, by 1e-5 at 1.
"""

from functools import cache

import numpy as np
from attrs import frozen

from mpad_cdlbiem.elements.kernels import TILE
from mpad_core.arrays import Array

EXACT = 8  # Gauss points across an element that give its area and centroid to rounding
BLUR = 0.3  # of an element's width; not less than the distance of its Gauss points
FACES = tuple((axis, sign) for axis in range(3) for sign in (1.0, -1.0))


@frozen(kw_only=True, eq=False)
class Mesh:
    """A unit sphere of n elements; vectors on it are ordered x of all elements, then y, then z."""

    points: Array  # (n, 3), where the equations hold, the centroids of the elements, on the sphere
    weights: Array  # (n,), areas; their sum is 4π
    sources: Array  # (tiles, s, 4 TILE), for the kernels
    blur: float  # square of the length, in radii, over which elements are blurred when seen from other surfaces
    own: Array  # (3 n, 3 n), the deflated operator of the sphere in unbounded fluid
    velocity: Array  # (6, 3 n), takes a density to its sphere's velocity and angular velocity (times the radius)


def _nodes(side: int, inner: int) -> tuple[Array, Array]:
    """Give the Gauss points (side, inner) of intervals of equal angle over a face, and their weights (inner,)."""
    nodes, weights = np.polynomial.legendre.leggauss(inner)
    width = np.pi / (2 * side)
    middles = (np.arange(side) + 0.5) * width - np.pi / 4
    return middles[:, None] + nodes * width / 2, weights * width / 2


def _sampled(side: int, inner: int) -> tuple[Array, Array]:
    """Give points (6 side², inner², 3) and weights (6 side², inner²) on the unit sphere."""
    angles, weights = _nodes(side, inner)
    slopes = np.tan(angles)
    X, Y = slopes[:, None, :, None], slopes[None, :, None, :]
    square = 1 + X**2 + Y**2
    area = (1 + X**2) * (1 + Y**2) / square**1.5 * weights[:, None] * weights[None, :]
    face = np.stack(np.broadcast_arrays(1.0, X, Y)) / np.sqrt(square)
    turned = [np.roll(face * np.array([sign, 1, 1]).reshape(3, 1, 1, 1, 1), axis, axis=0) for axis, sign in FACES]
    points = np.concatenate(turned, axis=1)
    areas = np.tile(area.reshape(side**2, inner**2), (6, 1))
    return points.reshape(3, 6 * side**2, inner**2).transpose(1, 2, 0), areas


def packed(points: Array, weights: Array) -> Array:
    """Lay the points (n, s, 3) of the elements out in tiles for the kernels, filled up with points of no weight."""
    count, inner = weights.shape
    tiles = -(-count // TILE)
    full = np.zeros((tiles * TILE, inner, 4))
    full[:count, :, :3] = points
    full[:count, :, 3] = 3 / (2 * np.pi) * weights
    return np.ascontiguousarray(full.reshape(tiles, TILE, inner, 4).transpose(0, 2, 3, 1)).reshape(tiles, inner, -1)


def _motions(points: Array) -> Array:
    """Give the six unit rigid motions as columns (3 n, 6)."""
    x, y, z = points.T
    one, none = np.ones_like(x), np.zeros_like(x)
    columns = [(one, none, none), (none, one, none), (none, none, one), (none, -z, y), (z, none, -x), (-y, x, none)]
    return np.asarray(np.array(columns).reshape(6, -1).T)


def _kernel(points: Array, weights: Array) -> Array:
    """Give K on the sphere, (3, n, 3, n), from one point an element, its own part left out."""
    r = points[:, None] - points[None]
    square = np.einsum("tei,tei->te", r, r)
    np.fill_diagonal(square, 1.0)  # r is zero there, and so is what follows
    along = np.einsum("tei,ei->te", r, points)
    strength = 3 / (2 * np.pi) * weights * along / square**2.5
    return np.asarray(np.einsum("te,tei,tek->itke", strength, r, r, optimize=True))


def _own(points: Array, weights: Array, rigid: Array, weighted: Array) -> Array:
    """Give 1 + K on the sphere, plus the projection on rigid motions, less that on the normal.

    1 + K takes constants to zero, and that makes an element's own part. Since the kernel is symmetric on a sphere, the
    discrete operator has the rigid motions, rotations too, as null vectors on both sides: lone spheres are exact.
    """
    count = len(weights)
    block, at = _kernel(points, weights), np.arange(count)
    block[:, at, :, at] -= block.sum(axis=3).transpose(1, 0, 2)
    normal = points.T.reshape(-1)
    outward = normal * np.tile(weights, 3) / (4 * np.pi)
    own: Array = block.reshape(3 * count, 3 * count) + rigid @ weighted.T - np.outer(normal, outward)
    return own


@cache
def mesh_of(side: int, inner: int) -> Mesh:
    """Make the mesh of side x side elements a face, each with inner x inner points for the other spheres to see."""
    nodes, shares = _sampled(side, EXACT)
    weights = shares.sum(axis=1)
    points = np.einsum("es,esi->ei", shares, nodes)
    points /= np.linalg.norm(points, axis=1)[:, None]
    nodes, shares = (points[:, None], weights[:, None]) if inner == 1 else _sampled(side, inner)
    shares = shares * (weights / shares.sum(axis=1))[:, None]
    motions, area = _motions(points), np.tile(weights, 3)[:, None]
    factor = np.linalg.cholesky(motions.T @ (area * motions))
    rigid = np.linalg.solve(factor, motions.T).T  # orthonormal in the product weighted by the areas
    return Mesh(
        points=points,
        weights=weights,
        sources=packed(nodes, shares),
        blur=BLUR**2 * 4 * np.pi / len(points),
        own=_own(points, weights, rigid, area * rigid),
        velocity=-np.linalg.solve(factor.T, (area * rigid).T),
    )
