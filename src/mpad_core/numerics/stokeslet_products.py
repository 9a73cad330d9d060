r"""Products of the grand mobility of `stokeslets` with loads on many spheres, without forming the matrix.

Of a target at height z and a source at h let X∥ be the part along the wall of what separates them, d = z - h and
Z = z + h, p = 1/r and q = 1/R the inverse distances to the source and to its image. The vertical through the source is
the axis of both fields, so they are added before the load is known, in units of 1/(8πη):

    U∥ = A F∥ + (B X∥·F∥ + D F_z + S' m) X∥ - Q' ẑ×T∥ - k T_z ẑ×X∥,          m = ẑ·X∥×T∥
    U_z = C X∥·F∥ + E F_z - P' m
    Ω∥ = Q ẑ×F∥ + (S X∥·F∥ + P F_z) ẑ×X∥ + G T∥ - (H X∥·T∥ + K T_z) X∥
    Ω_z = k ẑ·X∥×F∥ + L X∥·T∥ + N T_z

in which the unbounded fluid puts, for spheres apart and with a for the target's radius, b for the source's,

    A = p + ⅓(a² + b²) p³,   B = p³ - (a² + b²) p⁵,   C = D = B d,   E = A + B d²,
    k = -p³,   P = P' = p³,   Q = -Q' = -p³ d,   S = S' = 0,
    G = -½ p³,   H = -3/2 p⁵,   L = -K = 3/2 p⁵ d,   N = 3/2 p⁵ d² - ½ p³,

and the wall adds what `stokeslets` gives. The matrix is symmetric, so the same numbers give what the target's load does
to the source: the block transposed, which is the block with C and D exchanged, Q and Q', S and S', P and -P', K and -L,
and k with its sign changed. Each pair is therefore looked at once.

Spheres lie in tiles, tiles in shares. A task takes one share as targets and half of the circle of shares as sources;
what its targets do to these is kept by itself and added up when all have ended. So no two threads meet, and as the
shares depend on the number of spheres alone, the bits do not depend on the number of threads.
"""

import math

import numba
import numpy as np

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled, compiled_parallel, compiled_sums, compiled_within
from mpad_core.numerics.stokeslets import add_free
from mpad_core.numerics.vectors import aligned_zeros, inverse_root, wide_registers

TILE = 64  # spheres side by side: a few registers of each quantity, and both tiles of a task in the fastest cache
LOAD, ROOT, MOTION, ROWS = 4, 10, 12, 18  # rows of a tile; the first four are x, y, z and the radius
ALONE = 4  # so many tiles take one thread 0.2 ms; waking others saves half of it, and on a busy machine costs more
SHARES = 32  # at most so many threads can help; the memory, 24 N SHARES bytes, is what the reactions take

Translation = tuple[float, float, float, float, float]
Coupling = tuple[float, float, float, float, float, float, float]
Rotation = tuple[float, float, float, float, float]
Six = tuple[float, float, float, float, float, float]


@compiled_within
def _translation(z: float, h: float, p: float, q: float, a2: float, b2: float, wall: bool) -> Translation:
    """Give A, B, C, D, E of the module's text; the wall's part is that of `stokeslets`, ordered by powers of q²."""
    d, p3, s = z - h, p * p * p, a2 * (1 / 3) + b2 * (1 / 3)
    u = s * p * p
    A, B = p + p * u, p3 - 3 * u * p3
    C = B * d
    D, E = C, A + C * d
    if wall:
        Z, q2, product = z + h, q * q, a2 * ((10 / 3) * b2)
        Z2, q3, w = Z * Z, q * q2, z * (2 * h)
        q5, g, x = q3 * q2, a2 * (10 * h) + (10 * b2) * z, Z2 * q2
        y = Z * g + product
        v = 7 * x * product - y
        A += -q - q3 * (w + s + q2 * ((1 / 7) * v - (2 / 35) * y))
        B += q5 * (3 * w + 3 * s + q2 * v) - q3
        odd = Z * q5 * (a2 - b2) - d * q3
        even = q5 * (0.2 * g + Z * (3 * w + q2 * (v - 2 * product)))
        C += odd + even
        D += odd - even
        E += q3 * (w - s - Z2 - q2 * (3 * Z2 * (w - s) + 0.6 * y) + x * q2 * (5 * product - v)) - q
    return A, B, C, D, E


@compiled_within
def _coupling(z: float, h: float, p: float, q: float, a2: float, b2: float, wall: bool) -> Coupling:
    """Give k, P, Q, S, P', Q', S' of the module's text."""
    k, S, S_ = -p * p * p, 0.0, 0.0
    P, P_, Q, Q_ = -k, -k, k * (z - h), -k * (z - h)
    if wall:
        Z, q3, q5 = z + h, q * q * q, q * q * (q * q) * q
        k += q3
        near, far = a2 * (Z * q5), b2 * (Z * q5)
        S, S_ = 6 * h * q5 - 10 * far * (q * q), 6 * (z * q5) - 10 * near * (q * q)
        Q, Q_ = k * (z - h) + 2 * far, 2 * near - k * (z - h)
        P, P_ = -k - 2 * b2 * q5 - Z * S, -k - 2 * a2 * q5 - Z * S_
    return k, P, Q, S, P_, Q_, S_


@compiled_within
def _rotation(z: float, h: float, p: float, q: float, wall: bool) -> Rotation:
    """Give G, H, K, L, N of the module's text."""
    d, p3 = z - h, p * p * p
    twist = 1.5 * p3 * (p * p)
    G, H, L = -0.5 * p3, -twist, twist * d
    K, N = -L, L * d - 0.5 * p3
    if wall:
        Z, q3, q5 = z + h, q * q * q, q * q * (q * q) * q
        tilt = Z * q5
        G += 3.5 * q3 - 6 * Z * tilt
        H += 4.5 * q5
        K += 1.5 * tilt
        L += 1.5 * tilt
        N += 0.5 * q3 - 1.5 * Z * tilt
    return G, H, K, L, N


@compiled_within
def _motion(X: float, Y: float, tt: Translation, rt: Coupling, rr: Rotation, load: Six) -> Six:
    """Give velocity and rotation under a load; X and Y are those of X∥."""
    A, B, C, D, E = tt
    k, P, Q, S, P_, Q_, S_ = rt
    G, H, K, L, N = rr
    fx, fy, fz, tx, ty, tz = load
    f, m, w = X * fx + Y * fy, X * ty - Y * tx, X * tx + Y * ty
    along, turn, spin, kz = B * f + D * fz + S_ * m, S * f + P * fz, H * w + K * tz, k * tz
    return (
        A * fx + along * X + Q_ * ty + kz * Y,
        A * fy + along * Y - Q_ * tx - kz * X,
        C * f + E * fz - P_ * m,
        G * tx - Q * fy - turn * Y - spin * X,
        G * ty + Q * fx + turn * X - spin * Y,
        k * (X * fy - Y * fx) + L * w + N * tz,
    )


@compiled_within
def _inverse_distances(here: Array, x: float, y: float, h: float, b: float, wall: bool) -> bool:
    """Write 1/r and 1/R of a tile from a source, 1/r = 0 where spheres overlap, and tell whether any does.

    A loop of its own: the roots are a long chain of products, of which many then run side by side.
    """
    near = False
    for t in range(TILE):
        X, Y, z, reach = here[t] - x, here[TILE + t] - y, here[2 * TILE + t], here[3 * TILE + t] + b
        flat = X * X + Y * Y
        square = flat + (z - h) * (z - h)
        overlap = square < reach * reach
        near |= overlap
        root = inverse_root(square)
        here[ROOT * TILE + t] = 0.0 if overlap else root
        if wall:
            here[(ROOT + 1) * TILE + t] = inverse_root(flat + (z + h) * (z + h))
    return near


@compiled
def _add_overlaps(here: Array, there: Array, s: int, width: int, back: Array) -> None:
    """Add the unbounded part between a source and those spheres of a tile that overlap it, both ways."""
    block, r = np.empty((6, 6)), np.empty(3)
    for t in range(TILE):
        a, b = here[3 * TILE + t], there[3 * TILE + s]
        for i in range(3):
            r[i] = here[i * TILE + t] - there[i * TILE + s]
        if r[0] * r[0] + r[1] * r[1] + r[2] * r[2] >= (a + b) * (a + b):
            continue
        block[:] = 0.0
        add_free(r, a, b, 1.0, block)
        for i in range(width):
            for k in range(width):
                here[(MOTION + i) * TILE + t] += block[i, k] * there[(LOAD + k) * TILE + s]
                back[i * TILE + s] += block[k, i] * here[(LOAD + k) * TILE + t]


@compiled_within
def _sweep(here: Array, there: Array, back: Array, wall: bool) -> None:
    """Add to the motions of a tile what another's loads do, and the reverse."""
    wide_registers()
    for s in range(TILE):
        x, y, h, b = there[s], there[TILE + s], there[2 * TILE + s], there[3 * TILE + s]
        if b == 0:  # no sphere, no load
            continue
        fx, fy, fz = there[LOAD * TILE + s], there[(LOAD + 1) * TILE + s], there[(LOAD + 2) * TILE + s]
        tx, ty, tz = there[(LOAD + 3) * TILE + s], there[(LOAD + 4) * TILE + s], there[(LOAD + 5) * TILE + s]
        if _inverse_distances(here, x, y, h, b, wall):
            _add_overlaps(here, there, s, 6, back)
        ux, uy, uz, ox, oy, oz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for t in range(TILE):
            X, Y, z = here[t] - x, here[TILE + t] - y, here[2 * TILE + t]
            a2, b2 = here[3 * TILE + t] * here[3 * TILE + t], b * b
            p, q = here[ROOT * TILE + t], here[(ROOT + 1) * TILE + t]
            A, B, C, D, E = _translation(z, h, p, q, a2, b2, wall)
            k, P, Q, S, P_, Q_, S_ = _coupling(z, h, p, q, a2, b2, wall)
            G, H, K, L, N = _rotation(z, h, p, q, wall)
            moved = _motion(X, Y, (A, B, C, D, E), (k, P, Q, S, P_, Q_, S_), (G, H, K, L, N), (fx, fy, fz, tx, ty, tz))
            here[MOTION * TILE + t] += moved[0]
            here[(MOTION + 1) * TILE + t] += moved[1]
            here[(MOTION + 2) * TILE + t] += moved[2]
            here[(MOTION + 3) * TILE + t] += moved[3]
            here[(MOTION + 4) * TILE + t] += moved[4]
            here[(MOTION + 5) * TILE + t] += moved[5]
            force = here[LOAD * TILE + t], here[(LOAD + 1) * TILE + t], here[(LOAD + 2) * TILE + t]
            torque = here[(LOAD + 3) * TILE + t], here[(LOAD + 4) * TILE + t], here[(LOAD + 5) * TILE + t]
            reverse = (-k, -P_, Q_, S_, -P, Q, S)
            moved = _motion(X, Y, (A, B, D, C, E), reverse, (G, H, -L, -K, N), (*force, *torque))
            ux += moved[0]
            uy += moved[1]
            uz += moved[2]
            ox += moved[3]
            oy += moved[4]
            oz += moved[5]
        back[s] += ux
        back[TILE + s] += uy
        back[2 * TILE + s] += uz
        back[3 * TILE + s] += ox
        back[4 * TILE + s] += oy
        back[5 * TILE + s] += oz


@compiled_within
def _sweep_forces(here: Array, there: Array, back: Array, wall: bool) -> None:
    """Add to the velocities of a tile what another's forces do, and the reverse."""
    wide_registers()
    for s in range(TILE):
        x, y, h, b = there[s], there[TILE + s], there[2 * TILE + s], there[3 * TILE + s]
        if b == 0:  # no sphere, no load
            continue
        fx, fy, fz = there[LOAD * TILE + s], there[(LOAD + 1) * TILE + s], there[(LOAD + 2) * TILE + s]
        if _inverse_distances(here, x, y, h, b, wall):
            _add_overlaps(here, there, s, 3, back)
        ux, uy, uz = 0.0, 0.0, 0.0
        for t in range(TILE):
            X, Y, z = here[t] - x, here[TILE + t] - y, here[2 * TILE + t]
            a2, b2 = here[3 * TILE + t] * here[3 * TILE + t], b * b
            p, q = here[ROOT * TILE + t], here[(ROOT + 1) * TILE + t]
            A, B, C, D, E = _translation(z, h, p, q, a2, b2, wall)
            f = X * fx + Y * fy
            along = B * f + D * fz
            here[MOTION * TILE + t] += A * fx + along * X
            here[(MOTION + 1) * TILE + t] += A * fy + along * Y
            here[(MOTION + 2) * TILE + t] += C * f + E * fz
            Fx, Fy, Fz = here[LOAD * TILE + t], here[(LOAD + 1) * TILE + t], here[(LOAD + 2) * TILE + t]
            f = X * Fx + Y * Fy
            along = B * f + C * Fz
            ux += A * Fx + along * X
            uy += A * Fy + along * Y
            uz += D * f + E * Fz
        back[s] += ux
        back[TILE + s] += uy
        back[2 * TILE + s] += uz


@compiled_sums
def sweep_wall(here: Array, there: Array, back: Array) -> None:
    """Do `_sweep` above a wall; `wall` is a constant here, and not asked for within the loops."""
    _sweep(here, there, back, True)


@compiled_sums
def sweep_free(here: Array, there: Array, back: Array) -> None:
    """Do `_sweep` in unbounded fluid."""
    _sweep(here, there, back, False)


@compiled_sums
def sweep_forces_wall(here: Array, there: Array, back: Array) -> None:
    """Do `_sweep_forces` above a wall."""
    _sweep_forces(here, there, back, True)


@compiled_sums
def sweep_forces_free(here: Array, there: Array, back: Array) -> None:
    """Do `_sweep_forces` in unbounded fluid."""
    _sweep_forces(here, there, back, False)


@compiled_within
def _meet(here: Array, there: Array, back: Array, wall: bool, width: int) -> None:
    """Let the loads on two tiles move each other's spheres: `here`, and in `back` those `there`."""
    if width == 6:
        if wall:
            sweep_wall(here, there, back)
        else:
            sweep_free(here, there, back)
    elif wall:
        sweep_forces_wall(here, there, back)
    else:
        sweep_forces_free(here, there, back)


@compiled
def tiles_of(centres: Array, radii: Array, scale: float, loads: Array) -> Array:
    """Give the tiles (tiles, ROWS * TILE) of spheres, with their loads times a scale.

    What is left of the last tile are copies of the last sphere without radius and load.
    """
    count, width = loads.shape
    tiles = aligned_zeros((count + TILE - 1) // TILE, ROWS * TILE)
    for i in range(len(tiles) * TILE):
        tile, t, sphere = i // TILE, i % TILE, min(i, count - 1)
        for k in range(3):
            tiles[tile, k * TILE + t] = centres[sphere, k]
        if i < count:
            tiles[tile, 3 * TILE + t] = radii[i]
            for k in range(width):
                tiles[tile, (LOAD + k) * TILE + t] = loads[i, k] * scale
    return tiles


@compiled
def _takes(share: int, further: int, circle: int) -> bool:
    """Tell whether a share meets the one so much further on; of two that face each other one does, by turns."""
    half = circle // 2
    return 2 * further < circle or (share % 2 == 0 if share < half else (share - half) % 2 == 1)


@compiled
def _share(share: int, starts: Indices, tiles: Array, wall: bool, width: int, back: Array) -> None:
    """Move the spheres of a share, and write to `back` what those further on in the circle get of it."""
    circle, unused = len(starts) - 1, np.zeros(6 * TILE)
    for further in range(circle // 2 + 1):
        other = (share + further) % circle
        back[further] = 0.0
        if not _takes(share, further, circle):
            continue
        for i in range(starts[share], starts[share + 1]):
            for k in range(starts[other], starts[other + 1]):
                if further > 0 or k >= i:
                    within = further == 0 and k == i  # where each sphere is target and source in turn
                    out = unused if within else back[further, k - starts[other]]
                    _meet(tiles[i], tiles[k], out, wall, width)


@compiled_parallel
def _shares(starts: Indices, tiles: Array, wall: bool, width: int, back: Array) -> None:
    """Do all shares, each on whatever thread."""
    for share in numba.prange(len(back)):
        _share(share, starts, tiles, wall, width, back[share])


@compiled
def _gathered(starts: Indices, tiles: Array, back: Array, count: int, width: int) -> Array:
    """Give the velocities: of each sphere as a target, and what it got as a source, in the order of the circle."""
    circle, total, velocity = len(back), np.empty(TILE), np.empty((count, width))
    for share in range(circle):
        for tile in range(starts[share], starts[share + 1]):
            for k in range(width):
                for t in range(TILE):
                    total[t] = tiles[tile, (MOTION + k) * TILE + t]
                for further in range(circle // 2 + 1):
                    for t in range(TILE):
                        total[t] += back[(share - further) % circle, further, tile - starts[share], k * TILE + t]
                for t in range(min(TILE, count - tile * TILE)):
                    velocity[tile * TILE + t, k] = total[t]
    return velocity


def _product(centres: Array, radii: Array, viscosity: float, wall: bool, loads: Array) -> Array:
    """Give the grand mobility times loads of six columns, or of three if these are forces alone."""
    tiles = tiles_of(centres, radii, 1 / (8 * math.pi * viscosity), loads)
    (count, width), circle = loads.shape, max(1, min(len(tiles), SHARES))
    starts = np.arange(circle + 1, dtype=np.int64) * len(tiles) // circle
    back = np.empty((circle, circle // 2 + 1, math.ceil(len(tiles) / circle), 6 * TILE))
    if circle <= ALONE:
        for share in range(circle):
            _share(share, starts, tiles, wall, width, back[share])
    else:
        _shares(starts, tiles, wall, width, back)
    return _gathered(starts, tiles, back, count, width)


def mobility_product(centres: Array, radii: Array, viscosity: float, wall: bool, loads: Array) -> Array:
    """Give the grand mobility times loads (N, 6), without forming the matrix: velocities (N, 6).

    The arguments are those of `grand_mobility`; the bits do not depend on the number of threads.
    """
    return _product(centres, radii, viscosity, wall, loads)


def translation_product(centres: Array, radii: Array, viscosity: float, wall: bool, forces: Array) -> Array:
    """Give the velocities (N, 3) of spheres under forces (N, 3) and no torques, as `mobility_product` does."""
    return _product(centres, radii, viscosity, wall, forces)
