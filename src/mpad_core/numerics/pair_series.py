"""Exact resistance of two rigid spheres in unbounded Stokes flow, by series in bispherical coordinates.

`pair_series` gives the 22 functions that `pair_functions` looks up, in 0.1 ms at eps = 0.1 and 3 ms at 1e-5; radii may
differ by any factor. Against 40 digits its errors, in units of the drag and torque of each sphere alone, are below
1e-14 for eps > 0.1, 1e-12 at 0.01, 1e-10 at 1e-4 and 5e-9 at 1e-6 (1e-14 of the squeeze resistance, which grows as
1/eps).

Lengths are in units of the focal distance c, c = a sinh(alpha) for each sphere. With (xi, eta) the bispherical
coordinates, sphere 1 is xi = -alpha_1, sphere 2 is xi = alpha_2, L = alpha_1 + alpha_2, zeta = cos(eta),
X = (cosh xi - zeta)^(1/2), S = sinh xi and C = cosh xi on a sphere, N = n + 1/2. For the azimuthal number m (0 along
the line of centres, 1 across it) pressure is p = mu Q cos(m phi) and velocity u = x p/(2 mu) + harmonic vector, that is
    u_z = (z Q/2 + w) cos(m phi),  u_r + u_phi ~ r Q/2 + U+,  u_r - u_phi ~ r Q/2 + U-,
where Q, w, U-, U+ are sums over n of X P_n^(k)(zeta) sin(eta)^k exp(+-N xi) with k = m, m, m-1, m+1 (for m = 0,
U- = U+). On a sphere at rest Q = -2 X^2 y, w = S y, U- and U+ = y sin(eta): the values y_n^s on the two spheres are the
unknowns (O'Neill & Majumdar's A_n and B_n are combinations of them). Continuity is harmonic, so need only hold on the
two spheres, where, all tangential derivatives being zero, it reads
    Q - zeta S Q' - S sin(eta) (U-' + U+')  + 2 (1 - zeta C) w' = 0,    ' = d/dxi.
The derivatives follow from the values on both spheres through kappa_n = N coth(N L) and sigma_n = N / sinh(N L), and
the products of three-term recurrences collapse: with M[f]_n = 2 ((n+1) f_(n+1) + n f_(n-1))/(2n+1) for every m,
    (1 - zeta)(y_s - tau y_t) + (C_s - 1 - s_s k) y_s - (rho tau + s_s h) y_t = -(right-hand side)_s,
    tau = sinh(L) sigma,  k = kappa - M[kappa]/2,  h = M[sigma]/2 - sigma,  s = |S|,  rho = (s_1 + s_2)/sinh(L) - 1,
t being the other sphere. In z = (y_1 - tau y_2, y_2 - tau y_1) the coupling of degrees is (1 - zeta) alone, which is
eliminated in flux form. As k, h, rho and 1 - tau are formed from what is left of the hyperbolic functions beyond
leading order, the system loses no digits near contact; the right-hand side, second differences in n, loses some.

What makes it work at all radii: the flow of each sphere moving alone (its Stokeslet, rotlet, stresslet and what goes
with them, at xi = +-2 alpha) is taken out first. What remains contributes to forces and torques like exp(-2 N L),
however large one sphere is, but for a geometric tail across the line, which `_finish` sums.

References
----------
- Jeffery, G. B. (1915). Proc. London Math. Soc. 14, 327. (spin about the line of centres)
- Stimson, M. & Jeffery, G. B. (1926). Proc. R. Soc. A 111, 110; Maude, A. D. (1961). Brit. J. Appl. Phys. 12, 293.
- O'Neill, M. E. & Majumdar, S. R. (1970). Z. angew. Math. Phys. 21, 164 and 180. (across the line of centres)
- Jeffrey, D. J. & Onishi, Y. (1984). J. Fluid Mech. 139, 261. (the functions; lubrication)
- Grassmann, W. K., Taksar, M. I. & Heyman, D. P. (1985). Oper. Res. 33, 1107. (elimination without subtractions)
"""

from math import asinh, cosh, pi, sinh, sqrt

import numpy as np
import numpy.typing as npt

from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.pair_terms import MINUS, PLUS, STRAIN, TRANSLATION, Q, W, cubic_parts, gap_operator, met_flows

Array = npt.NDArray[np.float64]

SIZE = 22
"""Number of functions of a pair."""

REACH = 24.0  # the sums run to N L = REACH, where exp(-2 N L) with its powers of n is below 1e-16 of the whole


@compiled
def gap_over_larger(ratio: float, eps: float) -> float:
    """Give the gap in units of the larger radius."""
    return 2.0 * ratio * eps / (1.0 + ratio)


@compiled
def squeeze_amplitude(ratio: float) -> float:
    """Give A of the squeeze resistance A/eps, in units of viscosity times the larger radius: 6 pi (ab/(a+b))^2/gap."""
    return 3.0 * pi * ratio / (1.0 + ratio)


@compiled
def strain_velocities(ratio: float, eps: float) -> tuple[float, float]:
    """Give the velocities of the centres at which the forces in the strain (-x/2, -y/2, z) are regular.

    Near contact they are those of the strain about the point of sphere 1 nearest to sphere 2: the surfaces then do not
    approach each other. Far away, where they would grow with the distance, they are made to fall off.
    """
    near = 1.0 / (1.0 + eps)
    return -near, near * (ratio + gap_over_larger(ratio, eps))


@compiled
def _right_hand_side(m: int, alpha: Array, gap: Array, lone: Array, right: Array) -> None:
    """Fill right (n + 1, 2, k): minus what continuity on each sphere has from the lone flows.

    What remains is zero on the sphere that moves, and minus the lone flow on the sphere that this meets. There the
    derivatives are kappa times the values, against -N times for the lone flow itself, which satisfies continuity: kappa
    + N is left; on the sphere that moves, sigma.
    """
    right[:] = 0.0
    half = 1.0 if m == 0 else 0.5  # along the line U- = U+: both in one
    for n in range(lone.shape[0]):
        for met in range(2):
            for sphere in range(2):
                S, C = (2.0 * sphere - 1.0) * sinh(alpha[sphere]), cosh(alpha[sphere])
                rate = (2.0 * met - 1.0) * (gap[n, 3] if met == sphere else gap[n, 4])
                part = rate / (2.0 * n + 1.0)
                for k in range(lone.shape[3]):
                    w, minus, plus = lone[n, met, W, k], 0.5 * lone[n, met, MINUS, k], half * lone[n, met, PLUS, k]
                    mixed = 0.5 * S * lone[n, met, Q, k] + C * w
                    right[n, sphere, k] -= rate * w
                    up = (n + 1.0 - m) * mixed + S * (minus - (n - m) * (n + 1.0 - m) * plus)
                    right[n + 1, sphere, k] += part * up
                    if n > 0:
                        down = (n + m) * mixed - S * (minus - (n + m) * (n + 1.0 + m) * plus)
                        right[n - 1, sphere, k] += part * down


@compiled
def _reduce(m: int, stiffness: Array, right: Array) -> None:
    """Eliminate from below, in place.

    With z = (2n+1) x the equation is (n+1+m)(x_n - x_(n+1)) + (n-m)(x_n - x_(n-1)) + (2n+1) K x_n = r_n; what is left
    is (n+1+m)(x_n - x_(n+1)) + P_n x_n = r'_n, with P_n in the place of K_n.
    """
    for n in range(m, stiffness.shape[0]):
        for i in range(2):
            for j in range(2):
                stiffness[n, i, j] *= 2.0 * n + 1.0
        if n == m:
            continue
        p = float(n + m)
        a, b, c, d = stiffness[n - 1, 0, 0], stiffness[n - 1, 0, 1], stiffness[n - 1, 1, 0], stiffness[n - 1, 1, 1]
        minor = a * d - b * c
        factor = (n - m) / (p * p + p * (a + d) + minor)
        stiffness[n, 0, 0] += factor * (p * a + minor)
        stiffness[n, 0, 1] += factor * p * b
        stiffness[n, 1, 0] += factor * p * c
        stiffness[n, 1, 1] += factor * (p * d + minor)
        for k in range(right.shape[2]):
            one, two = right[n - 1, 0, k], right[n - 1, 1, k]
            right[n, 0, k] += factor * ((p + d) * one - b * two)
            right[n, 1, k] += factor * ((p + a) * two - c * one)


@compiled
def _substitute(m: int, stiffness: Array, beyond: Array, right: Array) -> None:
    """Turn what `_reduce` left into x, in place, from above, where x_(n+1) is `beyond` times x_n on either sphere."""
    last = stiffness.shape[0] - 1
    for n in range(last, m - 1, -1):
        p = n + 1.0 + m
        a, b, c, d = p + stiffness[n, 0, 0], stiffness[n, 0, 1], stiffness[n, 1, 0], p + stiffness[n, 1, 1]
        if n == last:
            a -= p * beyond[0]
            d -= p * beyond[1]
        factor = 1.0 / (a * d - b * c)
        for k in range(right.shape[2]):
            one, two = right[n, 0, k], right[n, 1, k]
            if n < last:
                one += p * right[n + 1, 0, k]
                two += p * right[n + 1, 1, k]
            right[n, 0, k] = factor * (d * one - b * two)
            right[n, 1, k] = factor * (a * two - c * one)
    for k in range(right.shape[2]):
        for i in range(2):
            right[last + 1, i, k] = beyond[i] * right[last, i, k]


@compiled
def _values(gap: Array, x: Array) -> None:
    """Turn x into y, in place; the last row lies where the spheres do not feel each other, tau = 0."""
    for n in range(x.shape[0]):
        rest = gap[n, 2] if n < gap.shape[0] else 1.0
        factor = (2.0 * n + 1.0) / (rest * (2.0 - rest))
        for k in range(x.shape[2]):
            one, two = x[n, 0, k], x[n, 1, k]
            x[n, 0, k] = factor * (one + (1.0 - rest) * two)
            x[n, 1, k] = factor * (two + (1.0 - rest) * one)


@compiled
def _loads(m: int, alpha: Array, gap: Array, lone: Array, y: Array, out: Array) -> None:
    """Fill out (k, 4): F1, F2 and, across the line, T1, T2 about the origin, on the fluid, of all but the lone flows.

    What grows with |xi| towards a sphere is singular inside it. Its Stokeslet is the monopole of w (m = 0) or of U-/2
    (m = 1), its moment about the origin minus the dipole of w, all times 8 pi mu.
    """
    axial, minus = np.zeros(2), np.zeros(2)
    out[:] = 0.0
    for n in range(gap.shape[0]):
        q = gap[n, 0] * gap[n, 1]
        unit = 8.0 * pi * sqrt(2.0) * gap[n, 3] / (2.0 * n + 1.0)  # over 1 - exp(-2 N L)
        for k in range(out.shape[0]):
            for i in range(2):
                axial[i] = (2.0 * i - 1.0) * sinh(alpha[i]) * y[n, i, k] - lone[n, i, W, k]
                minus[i] = (n + 1.0) * (n + 2.0) * y[n + 1, i, k] / (2.0 * n + 3.0) - lone[n, i, MINUS, k]
                if n > 0:
                    minus[i] -= (n - 1.0) * n * y[n - 1, i, k] / (2.0 * n - 1.0)
            for i in range(2):
                dipole = unit * gap[n, i] * (axial[i] - q * axial[1 - i])
                if m == 0:
                    out[k, i] += dipole
                else:
                    out[k, i] += 0.5 * unit * gap[n, i] * (minus[i] - q * minus[1 - i])
                    out[k, 2 + i] -= n * (n + 1.0) * dipole


def _finish(alpha: Array, gap: Array, y: Array, out: Array) -> None:
    """Take the torques from the origin to the centres, and add to the loads across the line the degrees left out.

    There, beyond exp(-N L), x_n = const exp(-n alpha)/(n (n+1)), of which the sums are geometric. It falls off slowly
    when alpha is small: a large sphere's torque about its centre is spread along the line from centre to surface.
    """
    n = len(gap) - 1
    tail = 8.0 * pi * sqrt(2.0) * n * (n + 1.0) / (2.0 * n + 1.0) * gap[n, :2] * np.exp(-alpha) * y[n].T
    out[:, 2:] -= _SIDE * (out[:, :2] / np.tanh(alpha) + (n + 1.0) * tail)
    out[:, :2] -= 0.5 * tail


def _motions(m: int, alpha: Array, weights: Array, gap: Array, stiffness: Array) -> Array:
    """Give F1, F2, T1, T2 (k, 4) on the fluid for k motions weights (k, 2, 3), in units of c; spoils stiffness.

    What each sphere would exert alone, Stokes' drag and torque, is left out.
    """
    count, motions = len(gap), len(weights)
    lone, y, out = np.empty((count, 2, 4, motions)), np.empty((count + 1, 2, motions)), np.empty((motions, 4))
    met_flows(m, alpha, weights, gap, lone)
    _right_hand_side(m, alpha, gap, lone, y)
    _reduce(m, stiffness, y)
    _substitute(m, stiffness, m * np.exp(-alpha) * (count - 1.0) / (count + 1.0), y)
    _values(gap, y)
    _loads(m, alpha, gap, lone, y, out)
    if m == 1:
        _finish(alpha, gap, y, out)
    return out


def _spin(gap: Array) -> Array:
    """Give (3,): torque about the line, 11, 12, 22, beyond that of lone spheres, in units of c (Jeffery 1915).

    The velocity is a harmonic function of its own; the degrees do not couple.
    """
    n = np.arange(len(gap))
    first, second = gap[:, 0] ** 2, gap[:, 1] ** 2
    term = 32.0 * pi * n * (n + 1.0) / (2.0 * n + 1.0) * first * second * gap[:, 3]
    return np.array([(term * first).sum(), -term.sum(), (term * second).sum()])


def _along(first: float, second: float) -> Array:
    """Give the motions (3, 2, 3) along the line to solve for, by sphere and kind, in units of c.

    They are both spheres, the second alone, and held in the strain with the given velocities at the centres.
    """
    weights = np.zeros((3, 2, 3))
    weights[0, :, TRANSLATION] = weights[1, 1, TRANSLATION] = weights[2, :, STRAIN] = 1.0
    weights[2, :, TRANSLATION] = -first, -second
    return weights


def _across() -> Array:
    """Give the motions (5, 2, 3) across the line: U1, U2, Omega1, Omega2, and held in the strain about the centres."""
    weights = np.zeros((5, 2, 3))
    weights[:4, :, :STRAIN] = np.eye(4).reshape(4, 2, 2).swapaxes(1, 2)
    weights[4, :, STRAIN] = 1.0
    return weights


_SIDE = np.array([-1.0, 1.0])
_ACROSS = _across()
_UPPER = np.triu_indices(4)


def loads(ratio: float, eps: float) -> tuple[Array, Array, Array]:
    """Sum the series: what moving spheres exert on the fluid, beyond Stokes' drag and torque of each alone.

    Parameters
    ----------
    ratio
        Smaller radius over larger, in (0, 1].
    eps
        Gap (a+b)/(2ab), positive.

    Returns
    -------
    spin : (3,)
        Torque resistance about the line, 11, 12, 22.
    along : (3, 4)
        F1, F2, 0, 0 for the motions along the line: both spheres, the second alone, and held in the strain
        (-x/2, -y/2, z) with the velocities at the centres that `strain_velocities` gives.
    across : (5, 4)
        F1x, F2x, T1y, T2y for U1x, U2x, Omega1y, Omega2y, and held in the strain (z, 0, x) about either centre.
    """
    width = gap_over_larger(ratio, eps)
    half = sqrt(width * (2.0 + 2.0 * ratio + width) / (4.0 * ratio))  # sinh(L/2)
    focal = 2.0 * ratio * half * sqrt(1.0 + half * half) / (1.0 + ratio + width)
    alpha = np.array([asinh(focal), asinh(focal / ratio)])
    count = int(REACH / alpha.sum()) + 10
    gap, stiffness = np.empty((count, 5)), np.empty((count, 2, 2))
    gap_operator(alpha, cubic_parts(float(alpha.sum())), gap, stiffness)
    first, second = strain_velocities(ratio, eps)
    along = _motions(0, alpha, _along(first / focal, second / focal), gap, stiffness.copy())
    across = _motions(1, alpha, _ACROSS, gap, stiffness)
    along[2] *= focal  # a rate of strain, as an angular velocity, is a velocity over c, and a torque a force times c
    across[2:] *= focal
    across[:, 2:] *= focal
    return _spin(gap) * focal**3, along * focal, across * focal


def regular_functions(ratio: float, eps: float) -> Array:
    """Give the 22 functions without what is singular as 1/eps.

    Parameters
    ----------
    ratio, eps
        As for `pair_series`, unchecked.

    Returns
    -------
    functions : (22,)
        As `pair_functions.PairFunctions` lists them, but for five: 0 is R11 + R12, 1 is R22 - `squeeze_amplitude`/eps,
        2 is R12 + R22; 16 and 17 have more in them, namely R times `strain_velocities`.
    """
    spin, along, across = loads(ratio, eps)
    drag, torque = 6.0 * pi * np.array([1.0, ratio]), 8.0 * pi * np.array([1.0, ratio**3])
    f = np.empty(SIZE)
    f[0], f[2] = drag + along[0, :2]
    f[1] = drag[1] + along[1, 1] - squeeze_amplitude(ratio) / eps
    f[3:6] = spin
    f[3:6:2] += torque
    f[6:16] = across[_UPPER]
    f[6:11:4] += drag
    f[13:16:2] += torque
    f[16:18] = drag * strain_velocities(ratio, eps) - along[2, :2]
    f[18:] = -across[4]
    return f


@compiled
def whole_functions(ratio: float, eps: float, f: Array) -> None:
    """Turn `regular_functions` into the 22 functions, in place."""
    both_first, second, both_second = f[0], f[1] + squeeze_amplitude(ratio) / eps, f[2]
    f[2] = second
    f[1] = both_second - second
    f[0] = both_first - f[1]
    first, second = strain_velocities(ratio, eps)
    f[16] -= f[0] * first + f[1] * second
    f[17] -= f[1] * first + f[2] * second


def pair_series(ratio: float, eps: float) -> Array:
    """Give the 22 functions of two spheres, summed: see `pair_functions.PairFunctions`, which looks them up.

    Parameters
    ----------
    ratio
        Smaller radius over larger, in (0, 1].
    eps
        Gap (a+b)/(2ab), positive.

    Returns
    -------
    functions : (22,)
        In units of viscosity and the larger radius.

    Raises
    ------
    ValueError
        When ratio or eps is out of range.
    """
    if not 0.0 < ratio <= 1.0:
        raise ValueError(f"smaller radius over larger must be in (0, 1], got {ratio}")
    if not eps > 0.0:
        raise ValueError(f"gap over radius must be positive, got {eps}")
    f = regular_functions(ratio, eps)
    whole_functions(ratio, eps, f)
    return f
