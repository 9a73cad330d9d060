"""What the series of `pair_series` are made of: the operator of the gap, and the flows about one sphere alone.

Notation as there: N = n + 1/2; alpha (2,) holds |xi| of the two spheres, L is their sum; s and c are sinh and cosh of
an alpha; lengths are in units of the focal distance.
"""

from math import cosh, exp, sinh, sqrt

import numpy as np
import numpy.typing as npt

from mpad_core.numerics.compiled import compiled

Array = npt.NDArray[np.float64]

TRANSLATION, ROTATION, STRAIN = range(3)
"""Kinds of motion of a sphere's surface."""

Q, W, MINUS, PLUS = range(4)
"""The harmonic functions of a flow: Q, w, U-, U+."""


@compiled
def _odd_excess(x: float) -> float:
    """Give sinh(x) - x."""
    if x > 1.0:
        return sinh(x) - x
    term = x * x * x / 6.0
    total = term
    for i in range(2, 10):
        term *= x * x / (2.0 * i * (2.0 * i + 1.0))
        total += term
    return total


def cubic_parts(length: float) -> tuple[float, float]:
    """Give 2 sinh^2(L)/L - 3/2 sinh(2L) + L and 2 sinh^2(L)/L - 3 sinh(L) + L cosh(L), both O(L^3), for `gap_operator`.

    Summed term by term. Used for degrees with N L < 1 only, of which there are none when L > 2.
    """
    first = second = 0.0
    power = length
    for i in range(1, 20 if length < 2.0 else 1):
        power *= length * length / (2.0 * i * (2.0 * i + 1.0))
        doubled = 2.0 * 4.0**i
        first += power * doubled * (1.0 / (i + 1.0) - 1.5)
        second += power * (doubled / (i + 1.0) + 2.0 * i - 2.0)
    return first, second


@compiled
def _near_differences(n: int, length: float, parts: tuple[float, float]) -> tuple[float, float, float]:
    """Give 1 - tau, k and h where N L < 1: written in what is left of the hyperbolic functions beyond leading order."""
    N = n + 0.5
    a = N * length
    odd, sinh_length = _odd_excess(a), sinh(length)
    s = a + odd
    even = s * s / (1.0 + sqrt(1.0 + s * s))  # cosh(a) - 1
    below, above = sinh(a - length), sinh(a + length)
    product = (2.0 * n + 1.0) * below * above / N
    square = 2.0 * sinh_length * sinh_length / length
    coth_excess = (a * even - odd) / s
    double_excess = (s * even + odd) / a
    k = parts[0] + square * coth_excess + length * double_excess
    cosh_excess = sinh_length * sinh_length / (1.0 + sqrt(1.0 + sinh_length * sinh_length))  # cosh(L) - 1
    h = parts[1] + 2.0 * N * s * cosh_excess - square * odd / s - 3.0 * even * sinh_length
    h += length * (odd / a) * (1.0 + cosh_excess)
    rest = odd / s - (a / s) * _odd_excess(length) / length
    return rest, -k / product, h / product


@compiled
def _wide_differences(n: int, length: float, q: float) -> tuple[float, float, float]:
    """Give 1 - tau, k and h where N L > 1, with q = exp(-N L) taken out of the hyperbolic functions."""
    N = n + 0.5
    sinh_length, cosh_length = sinh(length), cosh(length)
    s, c = 0.5 * (1.0 - q * q), 0.5 * (1.0 + q * q)
    p = exp(-length)
    product = 0.25 * (2.0 * n + 1.0) * (1.0 - q * q * p * p) * (1.0 - (q / p) * (q / p))
    square = 2.0 * N * N * sinh_length * sinh_length * q * q
    k = square * c / s - 3.0 * N * sinh_length * cosh_length * q * q + s * c
    h = 2.0 * N * N * s * (cosh_length - 1.0) + square / s - 3.0 * N * c * sinh_length + s * cosh_length
    return 1.0 - N * sinh_length * q / s, -k / product, h * q / product


@compiled
def gap_operator(alpha: Array, parts: tuple[float, float], gap: Array, stiffness: Array) -> None:
    """Fill what belongs to the gap and not to the motion.

    Parameters
    ----------
    alpha : (2,)
        |xi| of the spheres.
    parts
        `cubic_parts` of their sum.
    gap : (n, 5)
        Written, by degree: exp(-N alpha_1), exp(-N alpha_2), 1 - tau, kappa + N, sigma.
    stiffness : (n, 2, 2)
        Written: K of (1 - zeta) z + K z = -(right-hand side).
    """
    length = alpha[0] + alpha[1]
    half = sinh(0.5 * length)
    cosh_half = sqrt(1.0 + half * half)
    rho = -2.0 * sinh(0.5 * alpha[0]) * sinh(0.5 * alpha[1]) / cosh_half
    own, other = np.empty(2), np.empty(2)
    for n in range(gap.shape[0]):
        N = n + 0.5
        gap[n, 0], gap[n, 1] = exp(-N * alpha[0]), exp(-N * alpha[1])
        q = gap[n, 0] * gap[n, 1]
        rest, k, h = _near_differences(n, length, parts) if N * length < 1.0 else _wide_differences(n, length, q)
        gap[n, 2] = rest
        shrink = 1.0 - q * q if N * length > 1.0 else 2.0 * q * sinh(N * length)
        gap[n, 3], gap[n, 4] = 2.0 * N / shrink, 2.0 * N * q / shrink
        tau = 1.0 - rest
        for i in range(2):
            s = sinh(alpha[i])
            own[i] = 2.0 * sinh(0.5 * alpha[i]) ** 2 - s * k
            other[i] = -rho * tau - s * h
            stiffness[n, i, i] = (own[i] + tau * other[i]) / (rest * (1.0 + tau))
            stiffness[n, i, 1 - i] = (tau * own[i] + other[i]) / (rest * (1.0 + tau))


@compiled
def _derivatives(M: float, n: int, s: float, e: float) -> tuple[float, float, float]:
    """Give (a d/dz)^i, i = 1, 2, 3, of X0^M exp(-N xi0) over itself, where d/dz = X0^2 d/dxi0 (see `_lone_flows`).

    Written in s and e = exp(-alpha), of which no combination cancels when alpha is large.
    """
    k = M - 2.0 * n - 1.0
    first = k * s + M * e
    second = k * (k + 2.0) * s * s + 2.0 * (M + 1.0) * k * s * e + M * (M + 1.0) * e * e
    third = k * (k + 2.0) * ((k + 4.0) * s + 3.0 * (M + 2.0) * e) * s * s
    return first, second, third + (M + 1.0) * (M + 2.0) * (3.0 * k * s + M * e) * e * e


@compiled
def _lone_flows(m: int, n: int, side: float, s: float, e: float, out: Array) -> None:
    """Fill the flows about one sphere alone: their coefficients of degree n, over exp(-2 N alpha).

    They are derivatives of 1/d, d being the distance from the centre, of which
        1/d = X X0 sum exp(-N |xi - xi0|) P_n(zeta), at xi0 = 2 alpha, X0^2 = cosh(xi0) - 1 = 2/a^2,
    and each derivative across the line turns X0 P_n into -X0^3 P_n' sin(eta), then X0^5 P_n'' sin(eta)^2.

    Parameters
    ----------
    side
        -1 for sphere 1, below the origin, 1 for sphere 2.
    s, e
        sinh(alpha) and exp(-alpha) of its alpha.
    out : (3, 4)
        Written: Q, w, U-, U+ for TRANSLATION with unit velocity, ROTATION with unit angular velocity (across the line
        only) and STRAIN, in which the surface moves with -E x, E x being (-x/2, -y/2, z) or (z, 0, x).
    """
    z1, z2, z3 = _derivatives(1.0, n, s, e)
    x1, x2, _ = _derivatives(3.0, n, s, e)
    xx1, _, _ = _derivatives(5.0, n, s, e)
    moved, rotated, strained = out[TRANSLATION], out[ROTATION], out[STRAIN]
    if m == 0:
        moved[Q], moved[W], moved[MINUS], moved[PLUS] = -1.5 * s * z1 * side, 0.75 - 0.25 * z2, 0.0, 0.5 * s * x1 * side
        rotated[Q] = rotated[W] = rotated[MINUS] = rotated[PLUS] = 0.0
        strained[Q], strained[W], strained[MINUS], strained[PLUS] = -2.5 * z2, -0.25 * z3 * side / s, 0.0, 0.5 * x2
    else:
        moved[Q], moved[W], moved[MINUS], moved[PLUS] = 3.0 * s * s, 0.5 * s * x1 * side, 1.5 + 0.25 * z2, -s * s
        rotated[Q], rotated[W], rotated[MINUS], rotated[PLUS] = 0.0, -2.0, -2.0 * z1 * side / s, 0.0
        strained[Q], strained[W] = 20.0 * s * x1 * side / 3.0, 2.0 * x2 / 3.0
        strained[MINUS], strained[PLUS] = z3 * side / (3.0 * s), -4.0 * s * xx1 * side / 3.0
    for kind in range(3):
        out[kind, W] -= 0.5 * side * (s + e) / s * out[kind, Q]  # about the origin instead of the centre


@compiled
def met_flows(m: int, alpha: Array, weights: Array, gap: Array, lone: Array) -> None:
    """Fill lone (n, 2, 4, k): Q, w, U-, U+ on each sphere of the other's lone flow, for k motions weights (k, 2, 3)."""
    flows = np.empty((3, 4))
    for source in range(2):
        s, e = sinh(alpha[source]), exp(-alpha[source])
        for n in range(lone.shape[0]):
            decay = sqrt(2.0) * gap[n, source] * gap[n, source] * gap[n, 1 - source]
            _lone_flows(m, n, 2.0 * source - 1.0, s, e, flows)
            for motion in range(weights.shape[0]):
                for i in range(4):
                    total = 0.0
                    for kind in range(3):
                        total += weights[motion, source, kind] * flows[kind, i]
                    lone[n, 1 - source, i, motion] = decay * total
