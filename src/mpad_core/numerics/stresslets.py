r"""Far couplings of spheres that carry forces, torques and stresslets, unbounded or above a wall: blocks and product.

The tractions of sphere j on the fluid are those of a lone sphere that translates, rotates and resists strain,

    f = F/(4πb²) + 3/(8πb³) T×n + 3/(4πb³) S·n,

and a sphere moves with the averages of the fluid's velocity u over its surface that are conjugate to them,

    U = <u> = (1 + a²/6 ∇²) u,   Ω = 3/(2a) <n×u> = ½ ∇×u,   E = 3/a <sym un> = (1 + a²/10 ∇²) sym ∇u      (Faxén).

So S, symmetric and traceless, is the first moment of what the sphere does to the fluid, and the grand matrix of
(U, Ω, E) over (F, T, S) a Galerkin projection of the single layer, symmetric and positive definite with the energy
F·U + T·Ω + S:E. A lone sphere in unbounded fluid has E = S/((20/3)πηa³) of its own. A rigid one in the flow E∞·x has
E = -E∞: S = -(20/3)πηa³E∞. The stresslet of Batchelor (J. Fluid Mech. 41 (1970) 545), of tractions of the fluid on the
sphere, is -S. Unbounded, with r from source to target, in units of 1/(8πη) and for spheres that do not overlap,

    U = r (r·S·r) (3r⁻⁵ - 30 m r⁻⁷) + 12 m r⁻⁵ S·r,         m = a²/6 + b²/10,
    Ω = 3r⁻⁵ (S·r)×r,
    E = dev[rr (r·S·r)(105 n r⁻⁹ - 15 r⁻⁷) + 2 r (S·r)(3r⁻⁵ - 30 n r⁻⁷)] + 6 n r⁻⁵ S,         n = (a² + b²)/5,

and their transposes; dev is the symmetric traceless part. Forces and torques: `stokeslets`. See Durlofsky, Brady and
Bossis, J. Fluid Mech. 180 (1987) 21, and, at a wall, Swan and Brady, Phys. Fluids 19 (2007) 113306, for the method.
What the wall adds stands in `stresslet_images`. Spheres that overlap are given the same formulas, which grow as r⁻⁵ and
are not their surface averages then; where centres are the same, zero.

Rows of each sphere: Ux Uy Uz Ωx Ωy Ωz E0..E4; columns Fx Fy Fz Tx Ty Tz S0..S4. Strains and stresslets are components
on the orthonormal tensors (so that S:E = Σ S_k E_k)

    (2zz - xx - yy)/√6,   (xz + zx)/√2,   (yz + zy)/√2,   (xx - yy)/√2,   (xy + yx)/√2.
"""

import math

import numba
import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled, compiled_parallel, compiled_sums, compiled_within
from mpad_core.numerics.stresslet_images import Eleven, couple, harmonics, mutual, rising, turned
from mpad_core.numerics.vectors import wide_registers

TILE = 32  # spheres side by side in the product: a few vector registers of each quantity
SHARES = 32  # of the product, the most threads that it can use; each takes memory for all motions, 88 bytes a sphere
SIZE = 11

# inside, loads are F_x F_y 2F_z T 3S_zz 2S_xz 2S_yz (S_xx - S_yy)/2 S_xy and motions U_x U_y U_z/2 Ω E_zz/2 E_xz E_yz
# E_xx - E_yy 2E_xy, which spares factors in the couplings; both are these times the components outside
UNITS = np.array([1, 1, 2, 1, 1, 1, math.sqrt(6), math.sqrt(2), math.sqrt(2), math.sqrt(0.5), math.sqrt(0.5)])


@compiled_within
def _free(r: tuple[float, float, float], q2: float, a2: float, b2: float, load: Eleven) -> Eleven:
    """Give the motion of a target at r from a source in unbounded fluid, with q2 = 1/r² and squared radii."""
    X, Y, Z = r
    fx, fy, fz2, tx, ty, tz, s, gx, gy, d, e = load
    fz, down = 0.5 * fz2, -s * (1 / 6)
    q = math.sqrt(q2)
    q3 = q * q2
    q5 = q3 * q2
    m, back, n = a2 * (1 / 6) + b2 * 0.1, a2 * 0.1 + b2 * (1 / 6), (a2 + b2) * 0.2
    wide, slope = (a2 + b2) * q2, 3 * q5
    sx = (down + d) * X + e * Y + 0.5 * gx * Z
    sy = e * X + (down - d) * Y + 0.5 * gy * Z
    sz = 0.5 * (gx * X + gy * Y) - 2 * down * Z
    rsr, rf = X * sx + Y * sy + Z * sz, X * fx + Y * fy + Z * fz
    spin = 0.5 * slope * (X * tx + Y * ty + Z * tz)
    bx, by, bz = ty * Z - tz * Y, tz * X - tx * Z, tx * Y - ty * X  # T × r
    across, along = q * (1 + wide * (1 / 3)), q3 * (1 - wide) * rf + slope * (1 - 10 * m * q2) * rsr
    lean = 12 * m * q5
    cx, cy, cz = q3 * fx + slope * sx, q3 * fy + slope * sy, q3 * fz + slope * sz
    stretch = slope * (q2 * (35 * n * q2 - 5) * rsr - (1 - 10 * back * q2) * rf)
    shear, pull = 2 * slope * (1 - 10 * n * q2), 12 * back * q5
    wx = stretch * X + shear * sx - pull * fx - slope * bx
    wy = stretch * Y + shear * sy - pull * fy - slope * by
    wz = stretch * Z + shear * sz - pull * fz - slope * bz
    own = n * q5
    return (
        across * fx + along * X + lean * sx + q3 * bx,
        across * fy + along * Y + lean * sy + q3 * by,
        0.5 * (across * fz + along * Z + lean * sz + q3 * bz),
        cy * Z - cz * Y + spin * X - 0.5 * q3 * tx,
        cz * X - cx * Z + spin * Y - 0.5 * q3 * ty,
        cx * Y - cy * X + spin * Z - 0.5 * q3 * tz,
        (2 * Z * wz - X * wx - Y * wy) * (1 / 6) + own * s,
        0.5 * (X * wz + Z * wx) + 3 * own * gx,
        0.5 * (Y * wz + Z * wy) + 3 * own * gy,
        X * wx - Y * wy + 12 * own * d,
        X * wy + Y * wx + 12 * own * e,
    )


@compiled_within
def _taken(load: Array) -> Eleven:
    """Give an array (11,) as a tuple, which kernels keep in registers."""
    return load[0], load[1], load[2], load[3], load[4], load[5], load[6], load[7], load[8], load[9], load[10]


@compiled
def _unit(k: int) -> Array:
    """Give the load of one and of no other component, as it is inside."""
    load = np.zeros(SIZE)
    load[k] = UNITS[k]
    return load


@compiled_within
def _direction(X: float, Y: float) -> tuple[float, float, float]:
    """Give the length of a vector along the wall, and the cosine and sine of its angle."""
    square = X * X + Y * Y
    rho = math.sqrt(square)
    inverse = 1 / (rho if square > 0 else 1.0)
    return rho, X * inverse if square > 0 else 1.0, Y * inverse


@compiled
def add_free_fts(r: Array, a: float, b: float, scale: float, out: Array) -> None:
    """Add the block of two spheres in unbounded fluid; nothing where their centres are the same.

    Parameters
    ----------
    r : (3,)
        From the source's centre to the target's.
    a, b
        Radii of target and source; zero gives the point solutions.
    scale
        1/(8πη), by which the block is multiplied.
    out : (11, 11)
        Is added to.
    """
    square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    if square == 0:
        return
    for k in range(SIZE):
        motion = _free((r[0], r[1], r[2]), 1 / square, a * a, b * b, _taken(_unit(k)))
        for i in range(SIZE):
            out[i, k] += scale * UNITS[i] * motion[i]


@compiled
def add_image_fts(x: Array, y: Array, a: float, b: float, scale: float, out: Array) -> None:
    """Add what the wall z = 0 adds to the block of two spheres (or, with x = y and a = b, to a sphere's own).

    Parameters
    ----------
    x, y : (3,)
        Centres of target and source, each not nearer to the wall than its radius.
    a, b
        Radii of target and source; zero gives the point solutions.
    scale
        1/(8πη), by which the block is multiplied.
    out : (11, 11)
        Is added to.
    """
    rho, c, s = _direction(x[0] - y[0], x[1] - y[1])
    z, h, a2, b2 = x[2], y[2], a * a, b * b
    waves = harmonics(rho, z + h, -0.5)
    like, to, back = mutual(waves, z, h, a2, b2), rising(waves, z, h, a2, b2), rising(waves, h, z, b2, a2)
    for k in range(SIZE):
        motion = turned(c, -s, couple(like, to, back, turned(c, s, _taken(_unit(k)))))
        for i in range(SIZE):
            out[i, k] += scale * UNITS[i] * motion[i]


@compiled
def pair_block_fts(x: Array, y: Array, a: float, b: float, scale: float, wall: bool, out: Array) -> None:
    """Write the block (11, 11) of target (x, a) and source (y, b), with the wall's part if there is a wall."""
    for i in range(SIZE):
        for k in range(SIZE):
            out[i, k] = 0.0
    add_free_fts(x - y, a, b, scale, out)
    if wall:
        add_image_fts(x, y, a, b, scale, out)


@compiled
def image_self_fts(x: Array, a: float, scale: float, out: Array) -> None:
    """Write what the wall adds to a sphere's own block (11, 11)."""
    for i in range(SIZE):
        for k in range(SIZE):
            out[i, k] = 0.0
    add_image_fts(x, x, a, a, scale, out)


# a tile's work, TILE each: x y z radius, loads, motions, and the motions that each sphere gives to a source
LOADS, MOTIONS, RETURNS, WORK = 4 * TILE, 15 * TILE, 26 * TILE, 37 * TILE


@compiled_within
def _load_at(work: Array, t: int) -> Eleven:
    """Give the load of a tile's sphere."""
    return (
        work[LOADS + t],
        work[LOADS + TILE + t],
        work[LOADS + 2 * TILE + t],
        work[LOADS + 3 * TILE + t],
        work[LOADS + 4 * TILE + t],
        work[LOADS + 5 * TILE + t],
        work[LOADS + 6 * TILE + t],
        work[LOADS + 7 * TILE + t],
        work[LOADS + 8 * TILE + t],
        work[LOADS + 9 * TILE + t],
        work[LOADS + 10 * TILE + t],
    )


@compiled_within
def _add_at(work: Array, start: int, motion: Eleven) -> None:
    """Add a motion to a tile's."""
    for k in range(SIZE):
        work[start + k * TILE] += motion[k]


@compiled_sums
def _free_onto_tile(work: Array, source: Array, load: Array, first: int) -> None:
    """Add the unbounded motions of a tile's spheres, from the first on, by a source, and those that they give it."""
    wide_registers()
    x, y, z, b2, sent = source[0], source[1], source[2], source[3] * source[3], _taken(load)
    for t in range(TILE):
        X, Y, Z, a2 = work[t] - x, work[TILE + t] - y, work[2 * TILE + t] - z, work[3 * TILE + t] ** 2
        square = X * X + Y * Y + Z * Z
        apart = t >= first and square > 0
        q2 = (1.0 if apart else 0.0) / (square if apart else 1.0)
        _add_at(work, MOTIONS + t, _free((X, Y, Z), q2, a2, b2, sent))
        _add_at(work, RETURNS + t, _free((-X, -Y, -Z), q2, b2, a2, _load_at(work, t)))


@compiled_sums
def _image_onto_tile(work: Array, source: Array, load: Array, first: int) -> None:
    """Add what the wall adds to these motions."""
    wide_registers()
    x, y, h, b2, sent = source[0], source[1], source[2], source[3] * source[3], _taken(load)
    for t in range(TILE):
        z, a2 = work[2 * TILE + t], work[3 * TILE + t] ** 2
        rho, c, s = _direction(work[t] - x, work[TILE + t] - y)
        waves = harmonics(rho, z + h, -0.5 if t >= first else 0.0)
        like, to, back = mutual(waves, z, h, a2, b2), rising(waves, z, h, a2, b2), rising(waves, h, z, b2, a2)
        _add_at(work, MOTIONS + t, turned(c, -s, couple(like, to, back, turned(c, s, sent))))
        # from the target, the source lies the other way
        _add_at(work, RETURNS + t, turned(-c, s, couple(like, back, to, turned(-c, -s, _load_at(work, t)))))


@compiled_sums
def _tiles(i: int, j: int, spheres: Array, loads: Array, count: int, wall: bool, motions: Array) -> None:
    """Add the motions of tile i's spheres by tile j's, and those of j's by i's."""
    wide_registers()
    work = np.zeros(WORK)
    for t in range(TILE):
        for k in range(4):
            work[k * TILE + t] = spheres[i * TILE + t, k]
        for k in range(SIZE):
            work[LOADS + k * TILE + t] = loads[i * TILE + t, k]
    for s in range(j * TILE, min((j + 1) * TILE, count)):
        first = s - j * TILE + 1 if i == j else 0  # within a tile each pair once
        for t in range(RETURNS, WORK):
            work[t] = 0.0
        _free_onto_tile(work, spheres[s], loads[s], first)
        if wall:
            _image_onto_tile(work, spheres[s], loads[s], first)
        for k in range(SIZE):
            total = 0.0
            for t in range(TILE):
                total += work[RETURNS + k * TILE + t]
            motions[s, k] += total
    for t in range(TILE):
        for k in range(SIZE):
            motions[i * TILE + t, k] += work[MOTIONS + k * TILE + t]


@compiled
def _share(share: int, shares: int, spheres: Array, loads: Array, count: int, wall: bool, motions: Array) -> None:
    """Add one share of all pairs of tiles: every so-many-th tile, with the half of the tiles that follow it round."""
    tiles = len(spheres) // TILE
    for i in range(share, tiles, shares):
        for gap in range(tiles // 2 + 1):
            if 2 * gap < tiles or i < gap:  # two that are opposite meet once
                _tiles(i, (i + gap) % tiles, spheres, loads, count, wall, motions)


@compiled
def _prepared(centres: Array, radii: Array, loads: Array) -> tuple[Array, Array, Array]:
    """Give whole tiles of spheres (x, y, z, radius) and of loads in the units inside, and room for the shares' sums."""
    count = len(radii)
    tiles = (count + TILE - 1) // TILE
    spheres = np.ones((tiles * TILE, 4))  # what fills up the last tile has no load
    inside = np.zeros((tiles * TILE, SIZE))
    for i in range(count):
        for k in range(3):
            spheres[i, k] = centres[i, k]
        spheres[i, 3] = radii[i]
        for k in range(SIZE):
            inside[i, k] = loads[i, k] * UNITS[k]
    return spheres, inside, np.zeros((min(tiles, SHARES), tiles * TILE, SIZE))


@compiled
def _summed(parts: Array, scale: float, count: int) -> Array:
    """Give the sum of the shares in the units outside."""
    out = np.zeros((count, SIZE))
    for share in range(len(parts)):
        for i in range(count):
            for k in range(SIZE):
                out[i, k] += parts[share, i, k] * UNITS[k] * scale
    return out


@compiled_parallel
def fts_product(centres: Array, radii: Array, viscosity: float, wall: bool, loads: Array) -> Array:
    """Give each sphere's motion by the loads of all others (not by its own, nor its own image), in O(N) memory.

    Each pair of spheres is met once, for both. The pairs are dealt in shares, whose sums are kept apart, so the bits do
    not depend on the number of threads.

    Parameters
    ----------
    centres : (N, 3)
        With a wall, no centre nearer to it than the radius. Spheres should not overlap: see the module's text.
    radii : (N,)
        All positive.
    viscosity
        Of the fluid.
    wall
        Whether there is a no-slip wall at z = 0.
    loads : (N, 11)
        Forces, torques and stresslets.

    Returns
    -------
    (N, 11)
        Velocities, angular velocities and rates of strain.
    """
    count = len(radii)
    spheres, inside, parts = _prepared(centres, radii, loads)  # whole-array arithmetic here would wake the threads
    shares = len(parts)
    if shares <= 4:  # waking them costs more
        for share in range(shares):
            _share(share, shares, spheres, inside, count, wall, parts[share])
    else:
        for share in numba.prange(shares):
            _share(share, shares, spheres, inside, count, wall, parts[share])
    return _summed(parts, 1 / (8 * math.pi * viscosity), count)
