"""The double layer and its image in the wall, elements to points; compiled.

Kernel (Kim and Karrila, Microhydrodynamics, ch. 14 to 17; factor 2 of the jump included), r = x - y, n outward at y:

    2 D[q](x) = 3/(2π) ∫ r (r·q)(r·n)/r⁵ dS,    p = (μ/π) ∫ -q·n/r³ + 3 (r·q)(r·n)/r⁵ dS.

The wall z = 0 adds (Lorentz 1907), with J = diag(1, 1, -1) and z the height of x,

    u*(x) = -u(Jx) + 2z J∇u_z(Jx) + (z²/μ) J∇p(Jx).

The kernel times dS has no dimension, so lengths are in radii of the source sphere and the origin is its centre; there
a point on the sphere is its own normal. Sources come in tiles of constant width, which lets the compiler use vectors.
What blurs the kernel near an element, and why, stands in `mesh`.
"""

import math

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.stokeslets import add_free, add_image

TILE = 32  # elements side by side; a mesh is filled up with elements of no weight


@compiled
def _inverse_square(square: float, blur: float) -> float:
    """Give 1/r² with r² + blur²/(r² + blur) in place of r²: at most 1/blur, and little changed where r² is larger."""
    return 1 / (square + blur * blur / (square + blur)) if blur > 0 else 1 / square


@compiled
def _direct_tile(x: float, y: float, z: float, blur: float, points: Array, rows: Array) -> None:
    """Add the kernel of one point of each element of a tile: six rows, xx xy xz yy yz zz."""
    for e in range(TILE):
        nx, ny, nz = points[e], points[TILE + e], points[2 * TILE + e]
        X, Y, Z = x - nx, y - ny, z - nz
        q2 = _inverse_square(X * X + Y * Y + Z * Z, blur)
        f = points[3 * TILE + e] * (X * nx + Y * ny + Z * nz) * q2 * q2 * math.sqrt(q2)
        rows[e] += f * X * X
        rows[TILE + e] += f * X * Y
        rows[2 * TILE + e] += f * X * Z
        rows[3 * TILE + e] += f * Y * Y
        rows[4 * TILE + e] += f * Y * Z
        rows[5 * TILE + e] += f * Z * Z


@compiled
def _image_tile(x: float, y: float, z: float, h: float, blur: float, points: Array, rows: Array) -> None:
    """Add the image's kernel at a point of height h, mirrored to (x, y, z): nine rows, xx xy xz yx ... zz.

    With t = r·n, the three terms of the module's text make component i of the velocity by component k of the density

        3/(2πr⁵) { -r_i r_k t [1 ± 10h (r_z + h)/r²] ± 2h (r_z + h) (n_i r_k + δ_ik t) ± 2h² n_k r_i - 2h δ_iz r_k t },

    the upper signs along the wall (J = 1), the lower ones across it (i = z, J = -1).
    """
    for e in range(TILE):
        nx, ny, nz = points[e], points[TILE + e], points[2 * TILE + e]
        X, Y, Z = x - nx, y - ny, z - nz
        q2 = _inverse_square(X * X + Y * Y + Z * Z, blur)
        t = X * nx + Y * ny + Z * nz
        f = points[3 * TILE + e] * q2 * q2 * math.sqrt(q2)
        bend = 10 * h * (Z + h) * q2 * t
        a, b = -f * (t + bend), f * (t - bend)  # along the wall J leaves the gradient be, across it turns it
        c, d, g = f * 2 * h * (Z + h), f * 2 * h * h, f * 2 * h * t
        s = c * t
        rows[e] += X * (a * X + (c + d) * nx) + s
        rows[TILE + e] += a * X * Y + c * nx * Y + d * ny * X
        rows[2 * TILE + e] += a * X * Z + c * nx * Z + d * nz * X
        rows[3 * TILE + e] += a * X * Y + c * ny * X + d * nx * Y
        rows[4 * TILE + e] += Y * (a * Y + (c + d) * ny) + s
        rows[5 * TILE + e] += a * Y * Z + c * ny * Z + d * nz * Y
        rows[6 * TILE + e] -= (b * Z + g + c * nz) * X + d * nx * Z
        rows[7 * TILE + e] -= (b * Z + g + c * nz) * Y + d * ny * Z
        rows[8 * TILE + e] -= (b * Z + g + (c + d) * nz) * Z + s


@compiled
def _spread(rows: Array, kinds: tuple[int, ...], target: int, first: int, out: Array) -> None:
    """Add a tile's rows to the block; `kinds` says which row holds each of the nine components."""
    points, elements = out.shape[0] // 3, out.shape[1] // 3
    width = min(TILE, elements - first)
    for ik in range(9):
        row = out[(ik // 3) * points + target]
        start, tile = (ik % 3) * elements + first, kinds[ik] * TILE
        for e in range(width):
            row[start + e] += rows[tile + e]


@compiled
def add_double_layer(points: Array, sources: Array, blur: float, image: bool, out: Array) -> None:
    """Add to a block the velocity 2D[q] at points, or that of the image of the double layer in the wall.

    Parameters
    ----------
    points : (m, 4)
        From the sphere's centre, for the image mirrored in the wall; last their heights above the wall. In radii.
    sources : (tiles, s, 4 * TILE)
        s points of each element on the unit sphere: x, y, z, weight (3/(2π) of its share of the area).
    blur
        Square of the distance, in radii, below which the kernel is blurred; 0 leaves it as it is.
    image
        Whether the block is that of the image.
    out : (3 m, 3 n)
        Is added to; x of all points (elements) first, then y, then z.
    """
    rows = np.empty(9 * TILE)
    for target in range(len(points)):
        x, y, z, h = points[target, 0], points[target, 1], points[target, 2], points[target, 3]
        for tile in range(sources.shape[0]):
            rows[:] = 0.0
            for s in range(sources.shape[1]):
                if image:
                    _image_tile(x, y, z, h, blur, sources[tile, s], rows)
                else:
                    _direct_tile(x, y, z, blur, sources[tile, s], rows)
            if image:
                _spread(rows, (0, 1, 2, 3, 4, 5, 6, 7, 8), target, tile * TILE, out)
            else:
                _spread(rows, (0, 1, 2, 1, 3, 4, 2, 4, 5), target, tile * TILE, out)


@compiled
def add_completion(points: Array, centre: Array, scale: float, image: bool, out: Array) -> None:
    """Add to a block the velocity at points by forces and torques of 1 at a sphere's centre (Stokeslets, rotlets).

    Parameters
    ----------
    points : (m, 3)
    centre : (3,)
    scale
        1/(8πη), the sign as wanted.
    image
        Whether to add what the wall adds, rather than the field in unbounded fluid.
    out : (3 m, 6)
        Is added to; x of all points first, then y, then z.
    """
    block, count = np.empty((6, 6)), len(points)
    for target in range(count):
        block[:] = 0.0
        if image:
            add_image(points[target], centre, 0.0, 0.0, scale, block)
        else:
            add_free(points[target] - centre, 0.0, 0.0, scale, block)
        for i in range(3):
            for k in range(6):
                out[i * count + target, k] += block[i, k]
