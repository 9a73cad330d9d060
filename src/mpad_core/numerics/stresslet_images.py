r"""What a wall adds to the couplings of forces, torques and stresslets of spheres above it, in closed form.

Fourier transform along the wall z = 0: k is the wave vector, k̂ its direction, and × marks what lies along ẑ×k̂. A sphere
of radius b at height h carries a force F, a torque T and a stresslet S (see `stresslets`). The velocity that it alone
would cause at the wall is e^{-kh}/(4ηk) times s_A along k̂, s_B along ẑ and 2s_C across, and the wall adds to the grand
mobility

    -e^{-k(z+h)}/(4ηk) (s_A* s_A + s_B* s_B + 2 s_C* s_C),

with the starred of the target, at height z with radius a: this cancels the flow at the wall, decays, and is reciprocal.
(For points it is the transform of Blake's image, Proc. Camb. Phil. Soc. 70 (1971) 303.) With D the traceless part of S
along the wall, and

    Φ = F_k - iF_z,    Φ' = F_k + iF_z,    Σ = i(3/2 S_zz - k̂·D·k̂) - 2S_kz,

    s_A - i s_B = Φ + kΣ,
    s_A + i s_B = Φ' - 2(kh - k²b²/3) Φ - 2kT_× + k(1 - 2kh + 2k²b²/5) Σ,
    s_C = F_× + k/2 (T_k - iT_z) - k(S_×z + i k̂·D·(ẑ×k̂)).

The radii come by Faxén's Laplacians: b²/6 of them takes k²b²/3 from kh, b²/10 takes k²b²/5.

Back in space let ρ, φ, Z = z + h be the cylindrical coordinates of the target about the image of the source. A power
k^l at the angular order m becomes (Abramowitz and Stegun 8.5.3 for the ladder in l)

    h_l^m = ∫ k^l e^{-kZ} J_m(kρ) dk = (l+m)! R^{-l-1} P_l^{-m}(Z/R),        h_0^m = (ρ/(R+Z))^m / R,
    h_{l+1}^m = (2l+1) Z/R² h_l^m - (l²-m²)/R² h_{l-1}^m.

So with η = kz - k²a²/c and η' = kh - k²b²/c', c = 3 with forces and 5 with stresslets, the couplings are

    F∥ to U∥    L = 1 - η - η' + 2ηη'               F_z to U_z    1 + η + η' + 2ηη'        F_z to U∥    η - η' + 2ηη'
    F∥ to E     A = k(1 - η - η' + 2ηη')            F_z to E      B = k(η - η' + 2ηη')
    F∥ to Ω     P = k(1 - 2η')                      F_z to Ω      k(1 + 2η')
    S to E      K = k²(1 - η - η' + 2ηη')           T to E        C = k²(1 - 2η)

at the orders that the components of two spheres sum and differ to, and bare powers of k for what lies across.
"""

import math
from typing import NamedTuple

from mpad_core.numerics.compiled import compiled_within

Eleven = tuple[float, float, float, float, float, float, float, float, float, float, float]
Seven = tuple[float, float, float, float, float, float, float]


class Harmonics(NamedTuple):
    """The functions h_l^m of the module's text, by order m and then degree l = 0 .. 6, times a strength."""

    m0: Seven
    m1: Seven
    m2: Seven
    m3: Seven
    m4: Seven


class Mutual(NamedTuple):
    """Couplings of like with like.

    Components of an order m >= 1 have two with each other: in the plane of the spheres' centres and ẑ, and across it.
    """

    force: tuple[float, float]  # F∥ to U∥
    force_up: float  # F_z to U_z
    torque: tuple[float, float]  # T∥ to Ω∥
    spin: tuple[float, float, float, float]  # T_z with F∥; T∥ or S_∥z; T_z; D
    stress_up: tuple[float, float, float]  # S_zz with S_zz, S_∥z, D
    stress_lean: tuple[float, float]  # S_∥z with S_∥z
    stress_mixed: tuple[float, float]  # S_∥z with D
    stress_flat: tuple[float, float]  # D with D


class Rising(NamedTuple):
    """Couplings from loads of lower to motions of higher degree; with the spheres exchanged, those the other way."""

    force_up: float  # F_z to U∥
    torque: tuple[float, float]  # F∥ to Ω∥
    torque_up: float  # F_z to Ω∥
    along: float  # F∥ to E_zz
    lean: tuple[float, float]  # F∥ to E_∥z
    flat: tuple[float, float]  # F∥ to D
    up: tuple[float, float, float]  # F_z to E_zz, E_∥z, D
    turn: float  # T∥ to E_zz
    turn_lean: tuple[float, float]  # T∥ to E_∥z
    turn_flat: tuple[float, float]  # T∥ to D


@compiled_within
def _ladder(m: int, start: float, q: float, c: float, q2: float) -> Seven:
    """Climb from h_0^m to h_6^m, with c = Z/R²."""
    square = m * m
    h1 = start * (c + m * q)
    h2 = 3 * c * h1 - (1 - square) * q2 * start
    h3 = 5 * c * h2 - (4 - square) * q2 * h1
    h4 = 7 * c * h3 - (9 - square) * q2 * h2
    h5 = 9 * c * h4 - (16 - square) * q2 * h3
    h6 = 11 * c * h5 - (25 - square) * q2 * h4
    return start, h1, h2, h3, h4, h5, h6


@compiled_within
def harmonics(rho: float, Z: float, strength: float) -> Harmonics:
    """Give the harmonics at (ρ, Z), times the strength."""
    R2 = rho * rho + Z * Z
    R = math.sqrt(R2)
    q2 = 1 / R2
    q, c, slope = R * q2, Z * q2, rho / (R + Z)
    h0 = strength * q
    h1 = h0 * slope
    h2 = h1 * slope
    h3 = h2 * slope
    h4 = h3 * slope
    return Harmonics(
        _ladder(0, h0, q, c, q2),
        _ladder(1, h1, q, c, q2),
        _ladder(2, h2, q, c, q2),
        _ladder(3, h3, q, c, q2),
        _ladder(4, h4, q, c, q2),
    )


@compiled_within
def _parted(plus: float, minus: float) -> tuple[float, float]:
    """Give the couplings along and across the line of centres from those of differing and of summed order."""
    return plus - minus, plus + minus


@compiled_within
def _both(n: int, waves: Seven, Z: float, w: float, g: float, p: float) -> float:
    """Give k^n (1 - η - η' + 2ηη') at one order, from the coefficients of its powers of k."""
    return waves[n] - Z * waves[n + 1] + w * waves[n + 2] - g * waves[n + 3] + p * waves[n + 4]


@compiled_within
def mutual(waves: Harmonics, z: float, h: float, a2: float, b2: float) -> Mutual:
    """Give the couplings of like with like of a target at height z and a source at height h, with squared radii."""
    m0, m1, m2, m3, m4 = waves
    Z, w, s, g, p = z + h, 2 * z * h, a2 + b2, z * b2 + h * a2, a2 * b2
    s3, g3, p3 = s * (1 / 3), g * (2 / 3), p * (2 / 9)
    w5, g5, p5 = w + s * (1 / 5), g * (2 / 5), p * (2 / 25)
    K0, K1, K2 = _both(2, m0, Z, w5, g5, p5), _both(2, m1, Z, w5, g5, p5), _both(2, m2, Z, w5, g5, p5)
    K3, K4 = _both(2, m3, Z, w5, g5, p5), _both(2, m4, Z, w5, g5, p5)
    return Mutual(
        _parted(_both(0, m0, Z, w + s3, g3, p3) + 2 * m0[0], _both(0, m2, Z, w + s3, g3, p3) - 2 * m2[0]),
        0.5 * _both(0, m0, -Z, w - s3, g3, p3),
        _parted(2.5 * m0[2], 1.5 * m2[2]),
        (2 * m1[1], m1[2], m0[2], 2 * m2[2]),
        (0.5 * K0, K1, K2),
        _parted(K0 + 0.5 * m0[2], K2 - 0.5 * m2[2]),
        _parted(K1 + m1[2], K3 - m3[2]),
        _parted(K0 + 2 * m0[2], 2 * m4[2] - K4),
    )


@compiled_within
def _bent(n: int, waves: Seven, z: float, a2: float) -> float:
    """Give k^n (1 - 2kz + 2k²a2) at one order."""
    return waves[n] - 2 * (z * waves[n + 1] - a2 * waves[n + 2])


@compiled_within
def _leaning(n: int, waves: Seven, D: float, w: float, g: float, p: float) -> float:
    """Give k^n (η - η' + 2ηη') at one order, from the coefficients of its powers of k."""
    return D * waves[n + 1] + w * waves[n + 2] - g * waves[n + 3] + p * waves[n + 4]


@compiled_within
def rising(waves: Harmonics, z: float, h: float, a2: float, b2: float) -> Rising:
    """Give the couplings from lower to higher degree of a target at height z and a source at height h."""
    m0, m1, m2, m3, _ = waves
    Z, D, w, a3, a5, b3 = z + h, z - h, 2 * z * h, a2 * (1 / 3), a2 * (1 / 5), b2 * (1 / 3)
    wa, wb, g, p = w + b3 + a5, w + b3 - a5, 2 * (z * b3 + h * a5), 2 * a5 * b3
    A0, A1 = _both(1, m0, Z, wa, g, p), _both(1, m1, Z, wa, g, p)
    A2, A3 = _both(1, m2, Z, wa, g, p), _both(1, m3, Z, wa, g, p)
    C0, C1, C2, C3 = _bent(2, m0, z, a5), _bent(2, m1, z, a5), _bent(2, m2, z, a5), _bent(2, m3, z, a5)
    return Rising(
        _leaning(0, m1, D, w + b3 - a3, 2 * (z * b3 + h * a3), 2 * a3 * b3),
        _parted(_bent(1, m0, h, b3) + m0[1], _bent(1, m2, h, b3) - m2[1]),
        m1[1] + 2 * (h * m1[2] - b3 * m1[3]),
        A1,
        _parted(A0 + m0[1], A2 - m2[1]),
        _parted(A1 + 2 * m1[1], A3 - 2 * m3[1]),
        (0.5 * _leaning(1, m0, D, wb, g, p), _leaning(1, m1, D, wb, g, p), _leaning(1, m2, D, wb, g, p)),
        C1,
        _parted(C0 + 0.5 * m0[2], C2 - 0.5 * m2[2]),
        _parted(C1 + m1[2], C3 - m3[2]),
    )


@compiled_within
def couple(like: Mutual, to: Rising, back: Rising, load: Eleven) -> Eleven:
    """Give the motion of the target of a load on the source, both in cylindrical components about the source's image.

    Loads are F_ρ F_φ 2F_z T_ρ T_φ T_z 3S_zz 2S_ρz 2S_φz D_ρρ D_ρφ, motions U_ρ U_φ U_z/2 Ω_ρ Ω_φ Ω_z E_zz/2 E_ρz E_φz
    E_ρρ-E_φφ 2E_ρφ, whose factors spare others. `back` is `to` with the spheres exchanged.
    """
    f, F, z, t, T, y, s, g, G, d, D = load
    return (
        like.force[0] * f + to.force_up * z - back.torque[0] * T - back.along * s - back.lean[0] * g + back.flat[0] * d,
        like.force[1] * F + back.torque[1] * t + like.spin[0] * y - back.lean[1] * G + back.flat[1] * D,
        like.force_up * z - back.force_up * f - back.torque_up * T - back.up[0] * s + back.up[1] * g - back.up[2] * d,
        to.torque[1] * F + like.torque[1] * t + like.spin[1] * y - back.turn_lean[1] * G + back.turn_flat[1] * D,
        to.torque_up * z
        - to.torque[0] * f
        + like.torque[0] * T
        + back.turn * s
        + back.turn_lean[0] * g
        - back.turn_flat[0] * d,
        like.spin[1] * (G - t) - like.spin[0] * F + like.spin[2] * y - like.spin[3] * D,
        to.along * f
        - to.up[0] * z
        - to.turn * T
        + like.stress_up[0] * s
        - like.stress_up[1] * g
        + like.stress_up[2] * d,
        to.turn_lean[0] * T
        - to.lean[0] * f
        - to.up[1] * z
        + like.stress_up[1] * s
        + like.stress_lean[0] * g
        - like.stress_mixed[0] * d,
        like.stress_lean[1] * G - to.lean[1] * F - to.turn_lean[1] * t - like.spin[1] * y - like.stress_mixed[1] * D,
        to.turn_flat[0] * T
        - to.flat[0] * f
        - to.up[2] * z
        + like.stress_up[2] * s
        + like.stress_mixed[0] * g
        + like.stress_flat[0] * d,
        like.stress_mixed[1] * G - to.flat[1] * F - to.turn_flat[1] * t - like.spin[3] * y + like.stress_flat[1] * D,
    )


@compiled_within
def turned(c: float, s: float, load: Eleven) -> Eleven:
    """Give loads or motions in axes turned about z by the angle of cosine c and sine s; D turns by twice the angle."""
    x, y, z, p, q, r, o, g, e, d, f = load
    c2, s2 = c * c - s * s, 2 * c * s
    return (
        c * x + s * y,
        c * y - s * x,
        z,
        c * p + s * q,
        c * q - s * p,
        r,
        o,
        c * g + s * e,
        c * e - s * g,
        c2 * d + s2 * f,
        c2 * f - s2 * d,
    )
