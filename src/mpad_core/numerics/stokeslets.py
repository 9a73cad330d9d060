r"""Translation-rotation mobilities of spheres from point solutions: Rotne-Prager in unbounded fluid, Blake at a wall.

Each sphere carries the surface tractions of a lone sphere that translates and rotates, and moves with the averages of
the fluid's velocity over its surface (Faxén). With G the velocity of a point force, the block of spheres a and b is

    tt = (1 + a²/6 ∇²)(1 + b²/6 ∇'²) G,    rt = ½∇× (1 + b²/6 ∇'²) G,    tr = rtᵀ with a and b exchanged,
    rr = ¼∇×∇'× G                                          (the curl of ∇²G is zero, hence no radii beyond these).

So the grand matrix is a Galerkin projection of the single layer: symmetric, positive definite where no two spheres are
the same, also where spheres overlap or one holds the other, and never below the exact mobility.

Unbounded fluid: Rotne and Prager, J. Chem. Phys. 50 (1969) 4831; all radii and overlaps: Zuk, Wajnryb, Mizerski and
Szymczak, J. Fluid Mech. 741 (2014) R5, equations 7 to 9.

Wall z = 0: with J = diag(1, 1, -1), the wall adds to any Stokes field (u, p) of sources above it (Lorentz 1907)

    u*(x) = -u(Jx) + 2z J∇u_z(Jx) + (z²/η) J∇p(Jx),

which for the point force is Blake's image, Proc. Camb. Phil. Soc. 70 (1971) 303. The operators above applied to u* give
polynomials in 1/R, where R = (X, Y, Z) = x - Jy points from the image of the source to the target, Z = z + h, z is the
target's height and h the source's. With F∥, T∥ and X∥ the parts along the wall, in units of 1/(8πη):

    U∥ = A F∥ + (B X∥·F∥ + D F_z) X∥ + Q' T∥×ẑ + S' (T∥·ẑ×X∥) X∥ - R⁻³ T_z ẑ×X∥
    U_z = C X∥·F∥ + E F_z - P' T∥·ẑ×X∥
    Ω∥ = Q ẑ×F∥ + (S X∥·F∥ + P F_z) ẑ×X∥ + (7/2 R⁻³ - 6 Z² R⁻⁵) T∥ - (9/2 X∥·T∥ + 3/2 Z T_z) R⁻⁵ X∥
    Ω_z = R⁻³ ẑ·X∥×F∥ + 3/2 Z R⁻⁵ X∥·T∥ + (R⁻³/2 - 3/2 Z² R⁻⁵) T_z

A to E stand in `_image_tt`, P, Q, S in `_image_rt`; a prime exchanges z with h and a with b. For equal radii these are
Swan and Brady, Phys. Fluids 19 (2007) 113306, appendix B. Touching the wall is allowed (z >= a), cutting it is not.

Rows of each sphere: Ux Uy Uz Ωx Ωy Ωz; columns Fx Fy Fz Tx Ty Tz. Any consistent units.
"""

import math

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled


@compiled
def _free_scalars(r: float, a: float, b: float) -> tuple[float, float, float, float, float, float]:
    """Give tt (I, r̂r̂), rt (F×r̂), tr (T×r̂), rr (I, r̂r̂) of spheres a (target) and b (source) at distance r, times 8πη."""
    if r >= a + b:
        s = (a * a + b * b) / (r * r)
        q = 1 / r
        return q * (1 + s / 3), q * (1 - s), q * q, q * q, -0.5 * q * q * q, 1.5 * q * q * q
    if r <= abs(a - b):  # one sphere inside the other moves with it
        c = max(a, b)
        spin = r / (c * c * c)
        return 4 / (3 * c), 0.0, spin if a > b else 0.0, spin if b > a else 0.0, 1 / (c * c * c), 0.0
    d2, r2, r3 = (a - b) ** 2, r * r, r * r * r
    tt = 4 / (3 * a * b * 32 * r3)
    rt = (a - b + r) ** 2 * (b * b + 2 * b * (a + r) - 3 * (a - r) ** 2) / (16 * r2 * a**3 * b)
    tr = (b - a + r) ** 2 * (a * a + 2 * a * (b + r) - 3 * (b - r) ** 2) / (16 * r2 * b**3 * a)
    rr = 1 / ((a * b) ** 3 * 64 * r3)
    w = a * a + 4 * a * b + b * b
    plain = 5 * r3 * r3 - 27 * r2 * r2 * (a * a + b * b) + 32 * r3 * (a**3 + b**3) - 9 * r2 * (a * a - b * b) ** 2
    return (
        tt * (16 * r3 * (a + b) - (d2 + 3 * r2) ** 2),
        tt * 3 * (d2 - r2) ** 2,
        rt,
        tr,
        rr * (plain - d2 * d2 * w),
        rr * 3 * (d2 - r2) ** 2 * (w - r2),
    )


@compiled
def add_free(r: Array, a: float, b: float, scale: float, out: Array) -> None:
    """Add the Rotne-Prager block of two spheres in unbounded fluid, for any radii and any overlap.

    Parameters
    ----------
    r : (3,)
        From the source's centre to the target's.
    a, b
        Radii of target and source; zero gives the point solutions.
    scale
        1/(8πη), by which the block is multiplied.
    out : (6, 6)
        Is added to.
    """
    distance = math.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    tt0, tt1, rt, tr, rr0, rr1 = _free_scalars(distance, a, b)
    inverse = 1 / distance if distance > 0 else 0.0
    e = (r[0] * inverse, r[1] * inverse, r[2] * inverse)
    for i in range(3):
        out[i, i] += scale * tt0
        out[3 + i, 3 + i] += scale * rr0
        for k in range(3):
            out[i, k] += scale * tt1 * e[i] * e[k]
            out[3 + i, 3 + k] += scale * rr1 * e[i] * e[k]
        j, k = (i + 1) % 3, (i + 2) % 3  # (F × e)_i = F_j e_k - F_k e_j
        out[3 + i, j] += scale * rt * e[k]
        out[3 + i, k] -= scale * rt * e[j]
        out[i, 3 + j] += scale * tr * e[k]
        out[i, 3 + k] -= scale * tr * e[j]


@compiled
def _image_tt(z: float, h: float, q: float, a2: float, b2: float) -> tuple[float, float, float, float, float]:
    """Give A, B, C, D, E of the module's text for q = 1/R and squared radii."""
    Z, w, s, p, g = z + h, z * h, (a2 + b2) * (1 / 3), a2 * b2, a2 * h + b2 * z
    Z2, q2 = Z * Z, q * q
    q3 = q * q2
    q5 = q3 * q2
    q7 = q5 * q2
    Zg, Z2p = Z * g, Z2 * p * q2 * (70 / 3)
    A = -q - q3 * (s + 2 * w) + 2 * q5 * (p * (1 / 3) + Zg) - q5 * Z2p * (1 / 7)
    B = -q3 + q5 * (3 * s + 6 * w) - 10 * q7 * (p * (1 / 3) + Zg) + q7 * Z2p
    odd = q3 * (h - z) + q5 * Z * (a2 - b2)
    even = q5 * (2 * g + 6 * Z * w) + Z * q7 * (Z2p - 10 * (p + Zg))
    E = -q + q3 * (2 * w - s - Z2) + q5 * (Z2 * (3 * s - 6 * w) - 2 * p - 6 * Zg) + Z2 * q7 * (20 * p + 10 * Zg - Z2p)
    return A, B, odd + even, odd - even, E


@compiled
def _image_rt(z: float, h: float, q: float, b2: float) -> tuple[float, float, float]:
    """Give P, Q, S of the module's text for q = 1/R; the source at h has the squared radius b2."""
    Z, q2 = z + h, q * q
    q3 = q * q2
    q5 = q3 * q2
    bend = 10 * Z * b2 * q5 * q2
    return -q3 - q5 * (2 * b2 + 6 * Z * h) + Z * bend, (z - h) * q3 + 2 * Z * b2 * q5, 6 * h * q5 - bend


@compiled
def add_image(x: Array, y: Array, a: float, b: float, scale: float, out: Array) -> None:
    """Add what the wall z = 0 adds to the block of two spheres (or, with x = y and a = b, to a sphere's own).

    Parameters
    ----------
    x, y : (3,)
        Centres of target and source, each not nearer to the wall than its radius.
    a, b
        Radii of target and source; zero gives the point solutions.
    scale
        1/(8πη), by which the block is multiplied.
    out : (6, 6)
        Is added to.
    """
    X, Y, z, h = x[0] - y[0], x[1] - y[1], x[2], y[2]
    Z = z + h
    q = 1 / math.sqrt(X * X + Y * Y + Z * Z)
    q3, q5 = q**3 * scale, q**5 * scale
    A, B, C, D, E = _image_tt(z, h, q, a * a, b * b)
    P, Q, S = _image_rt(z, h, q, b * b)
    P_, Q_, S_ = _image_rt(h, z, q, a * a)
    out[0, 0] += scale * (A + B * X * X)
    out[0, 1] += scale * B * X * Y
    out[1, 0] += scale * B * X * Y
    out[1, 1] += scale * (A + B * Y * Y)
    out[0, 2] += scale * D * X
    out[1, 2] += scale * D * Y
    out[2, 0] += scale * C * X
    out[2, 1] += scale * C * Y
    out[2, 2] += scale * E
    out[3, 0] -= scale * S * X * Y
    out[3, 1] -= scale * (Q + S * Y * Y)
    out[4, 0] += scale * (Q + S * X * X)
    out[4, 1] += scale * S * X * Y
    out[3, 2] -= scale * P * Y
    out[4, 2] += scale * P * X
    out[5, 0] -= q3 * Y
    out[5, 1] += q3 * X
    out[0, 3] -= scale * S_ * X * Y
    out[0, 4] += scale * (Q_ + S_ * X * X)
    out[1, 3] -= scale * (Q_ + S_ * Y * Y)
    out[1, 4] += scale * S_ * X * Y
    out[2, 3] += scale * P_ * Y
    out[2, 4] -= scale * P_ * X
    out[0, 5] += q3 * Y
    out[1, 5] -= q3 * X
    plain = 3.5 * q3 - 6 * Z * Z * q5
    out[3, 3] += plain - 4.5 * q5 * X * X
    out[4, 4] += plain - 4.5 * q5 * Y * Y
    out[3, 4] -= 4.5 * q5 * X * Y
    out[4, 3] -= 4.5 * q5 * X * Y
    out[3, 5] -= 1.5 * Z * q5 * X
    out[4, 5] -= 1.5 * Z * q5 * Y
    out[5, 3] += 1.5 * Z * q5 * X
    out[5, 4] += 1.5 * Z * q5 * Y
    out[5, 5] += 0.5 * q3 - 1.5 * Z * Z * q5


@compiled
def pair_block(x: Array, y: Array, a: float, b: float, scale: float, wall: bool, out: Array) -> None:
    """Write the block (6, 6) of target (x, a) and source (y, b), with the wall's part if there is a wall."""
    out[:] = 0.0
    add_free(x - y, a, b, scale, out)
    if wall:
        add_image(x, y, a, b, scale, out)


@compiled
def self_mobilities(centres: Array, radii: Array, viscosity: float, wall: bool) -> Array:
    """Give each sphere's own block of the grand mobility, (N, 6, 6): its mobility if it were alone."""
    count = len(radii)
    blocks = np.empty((count, 6, 6))
    for i in range(count):
        pair_block(centres[i], centres[i], radii[i], radii[i], 1 / (8 * math.pi * viscosity), wall, blocks[i])
    return blocks


@compiled
def grand_mobility(centres: Array, radii: Array, viscosity: float, wall: bool) -> Array:
    """Give the grand mobility (6N, 6N) of all spheres; symmetric to the last bit.

    Parameters
    ----------
    centres : (N, 3)
        With a wall, no centre nearer to it than the radius.
    radii : (N,)
        All positive.
    viscosity
        Of the fluid.
    wall
        Whether there is a no-slip wall at z = 0.
    """
    count = len(radii)
    grand = np.empty((6 * count, 6 * count))
    block = np.empty((6, 6))
    for i in range(count):
        for j in range(i + 1):
            pair_block(centres[i], centres[j], radii[i], radii[j], 1 / (8 * math.pi * viscosity), wall, block)
            for k in range(6):
                for m in range(6):
                    grand[6 * i + k, 6 * j + m] = block[k, m]
                    grand[6 * j + m, 6 * i + k] = block[k, m]
    return grand
