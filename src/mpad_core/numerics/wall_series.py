"""Exact resistance of a sphere beside a plane no-slip wall, by series in bispherical coordinates: slow, trusted.

`wall_series` is what the table of the compiled look-up (`wall_functions`) is made from and tested against. It works in
extended precision; given a number of another kind with ``+ - * / **`` (an ``mpmath.mpf``), it works in that kind's.

Lengths are in units of the focal distance c = a sinh(alpha), where cosh(alpha) = h/a. With (xi, eta) the bispherical
coordinates, the wall is xi = 0 and the sphere xi = alpha; X = (cosh xi - cos eta)^(1/2), and e_n = exp(-(n+1/2) alpha).

Motion along the wall (O'Neill 1964): pressure p = mu Q cos(phi) and velocity u = x p/(2 mu) + harmonic vector, that is
    u_r = (r Q + U0 + U2)/2 cos(phi),  u_phi = (U2 - U0)/2 sin(phi),  u_z = (z Q/2 + w) cos(phi),
where Q, w, U0, U2 are sums over n of X P_n^(m)(cos eta) sin(eta)^m times hyperbolic functions of (n+1/2) xi,
m = 1, 1, 0, 2. No slip gives every coefficient from those of w, w_n = A_n sinh (n+1/2) xi. Continuity, which is
harmonic and so need only hold on the two surfaces, gives B_n on the wall and a tridiagonal system for A_n on the
sphere.

References
----------
- Jeffery, G. B. (1915). Proc. London Math. Soc. 14, 327. (spin about the normal)
- Brenner, H. (1961). Chem. Eng. Sci. 16, 242. (towards the wall; equation 2.19)
- Dean, W. R. & O'Neill, M. E. (1963). Mathematika 10, 13; O'Neill, M. E. (1964). Mathematika 11, 67. (along the wall)
- Goldman, A. J., Cox, R. G. & Brenner, H. (1967). Chem. Eng. Sci. 22, 637 and 653. (the eight functions; shear)
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

NAMES = ("fpar", "tpar", "frot", "trot", "fperp", "tspin", "fshear", "tshear")
"""The functions, in the order of every array of them; `wall_series` defines each."""

Numbers = npt.NDArray[Any]

FARTHEST = 1e3
"""Largest gap over radius summed in extended precision: functions falling as (a/h)^4 have lost 9 digits there."""


@dataclass(frozen=True)
class Geometry:
    """The sphere xi = alpha and what the series need of it, for degrees n = 0, 1, ...

    Attributes
    ----------
    sinh, cosh, coth
        Of alpha.
    coth_excess
        coth(alpha) - 1, which is tiny far from the wall.
    decay
        exp(-alpha).
    n, coth_n, k
        Degrees; coth((n+1/2) alpha); (n+1/2) coth((n+1/2) alpha) - coth(alpha).
    e_over_sinh
        e_n / sinh((n+1/2) alpha).
    """

    sinh: Any
    cosh: Any
    coth: Any
    coth_excess: Any
    decay: Any
    n: Numbers
    coth_n: Numbers
    k: Numbers
    e_over_sinh: Numbers


def geometry(eps: Any, digits: int = 22) -> Geometry:
    """Place the sphere.

    Parameters
    ----------
    eps
        Gap over radius, positive. Any float is taken to extended precision, other kinds of number are kept.
    digits
        Decimal digits to which the series are summed; their terms fall like exp(-2 n alpha).

    Raises
    ------
    ValueError
        When eps is not positive, or a float beyond `FARTHEST`.
    """
    if not eps > 0:
        raise ValueError(f"gap over radius must be positive, got {eps}")
    if isinstance(eps, float | int | np.floating):
        if eps > FARTHEST:
            raise ValueError(f"gap over radius beyond {FARTHEST:g} cancels, got {eps}: give a number of more digits")
        eps = np.longdouble(eps)
    one = eps / eps
    sinh = (eps * (2 + eps)) ** (one / 2)
    cosh = 1 + eps
    decay = 1 / (cosh + sinh)
    count = int(digits * np.log(10) / (2 * np.arcsinh(float(sinh)))) + 23
    n = np.array([one * degree for degree in range(count)])
    power = decay ** (2 * n + 1)
    coth_n = (1 + power) / (1 - power)
    return Geometry(
        sinh=sinh,
        cosh=cosh,
        coth=cosh / sinh,
        coth_excess=2 * decay**2 / (1 - decay**2),
        decay=decay,
        n=n,
        coth_n=coth_n,
        k=(n + one / 2) * coth_n - cosh / sinh,
        e_over_sinh=2 * power / (1 - power),
    )


def _shift(values: Numbers, by: int) -> Numbers:
    """Give values[n + by], zero where there is none; by is 1 or -1."""
    shifted = np.roll(values, -by)
    shifted[-1 if by > 0 else 0] = values[0] * 0
    return shifted


@dataclass(frozen=True)
class SurfaceVelocity:
    """Velocity (centre + slope (z - h), 0, -tilt x) on the sphere: rigid rotation has slope = tilt."""

    centre: Any
    slope: Any
    tilt: Any


def _surface_data(at: Geometry, velocity: SurfaceVelocity) -> tuple[Numbers, Numbers, Numbers]:
    """Give U0_n, U2_n and Q_n on the sphere over e_n, as they would be with all A_n zero: no slip at xi = alpha.

    They follow from 1/X = sqrt(2) sum e_n P_n and its derivatives with respect to cos(eta) and alpha.
    """
    n, up, down = at.n, at.decay, 1 / at.decay
    tilt = velocity.tilt / at.sinh
    q = -2 * tilt * (down / (2 * n - 1) - up / (2 * n + 3))
    bend = 2 * tilt * ((n + 1) * (n + 2) / (2 * n + 3) * up - (n - 1) * n / (2 * n - 1) * down)
    u0 = 2 * (velocity.centre + velocity.slope * (2 * n - at.coth_excess)) + bend
    root = (n[1] * 2) ** (n[1] / 2)
    return root * u0, -root * q, root * q


def _right_hand_side(at: Geometry, velocity: SurfaceVelocity, data: tuple[Numbers, Numbers, Numbers]) -> Numbers:
    """Give the part of continuity on the sphere that does not hold A_n, as the coefficient of P_n'."""
    n, sinh = at.n, at.sinh
    rate = (n + n[1] / 2) * at.coth_n
    u0_below, u2_below, q_below = (_shift(rate * value, -1) / at.decay for value in data)
    u0_above, u2_above, q_above = (_shift(rate * value, 1) * at.decay for value in data)
    below = (u0_below - (n - 1) * (n - 2) * u2_below + (n - 1) * q_below) / (2 * n - 1)
    above = (-u0_above + (n + 2) * (n + 3) * u2_above + (n + 2) * q_above) / (2 * n + 3)
    strain = velocity.slope - velocity.tilt
    root = (n[1] * 2) ** (n[1] / 2)
    source = -2 * root * sinh**2 * velocity.centre + root * strain * sinh * (6 * at.cosh - 2 * sinh * (2 * n + 1))
    bracket: Numbers = data[2] + source - sinh * (below + above)
    return bracket * at.e_over_sinh


def _solve_tridiagonal(lower: Numbers, diagonal: Numbers, upper: Numbers, right: Numbers) -> Numbers:
    """Eliminate without pivoting (Thomas); plain, because no library solves in extended precision."""
    factor, x = list(upper), list(right)
    factor[0], x[0] = upper[0] / diagonal[0], right[0] / diagonal[0]
    for i in range(1, len(x)):
        pivot = diagonal[i] - lower[i] * factor[i - 1]
        factor[i] = upper[i] / pivot
        x[i] = (right[i] - lower[i] * x[i - 1]) / pivot
    for i in range(len(x) - 2, -1, -1):
        x[i] = x[i] - factor[i] * x[i + 1]
    return np.array(x)


def force_and_torque(at: Geometry, velocity: SurfaceVelocity) -> tuple[Any, Any]:
    """Give the force along x and the torque about y, at its centre, that the sphere exerts on the fluid.

    The sphere's singularities are the terms growing with xi: their Stokeslet is the monopole of U0, their force moment
    about the origin the dipole of w. The sums with cosh and the wall's B_n telescope to nothing.

    Parameters
    ----------
    at
        Where the sphere is.
    velocity
        Velocity on the sphere, in units of U for the force and torque below; lengths in units of c.

    Returns
    -------
    force, torque
        Over pi mu c U and pi mu c^2 U.
    """
    n, k = at.n, at.k
    data = _surface_data(at, velocity)
    before = (2 * n - 1) * _shift(k, -1) - (2 * n - 3) * k
    after = (2 * n + 5) * k - (2 * n + 3) * _shift(k, 1)
    system = (
        before * (n - 1) / (2 * n - 1),
        -(before * n + after * (n + 1)) / (2 * n + 1),
        after * (n + 2) / (2 * n + 3),
        _right_hand_side(at, velocity, data),
    )
    inner = slice(1, len(n) - 1)  # degree 0 does not exist for m = 1; the last row lacks its neighbour
    weighted = (n * (n + 1))[inner] * _solve_tridiagonal(*(row[inner] for row in system))
    root = (n[1] * 2) ** (n[1] / 2)
    stokeslet = (weighted * (k[2:] - k[:-2]) / (2 * n + 1)[inner]).sum() + (data[0] * at.e_over_sinh)[:-1].sum()
    return 2 * root * stokeslet, -4 * root * weighted.sum() - at.coth * 2 * root * stokeslet


def squeeze(at: Geometry) -> Any:
    """Give the force for motion towards the wall over 6 pi mu a U (Brenner 1961, equation 2.19).

    His denominator 4 sinh^2 (n+1/2) alpha - (2n+1)^2 sinh^2 alpha is formed from a sum of squares: as it stands it
    loses a factor alpha^2 of precision.
    """
    n, eps = at.n[1:], at.cosh - 1
    degree = 2 * n + 1
    half_sinh = (eps / 2) ** (n[0] / 2)
    half_cosh_excess = eps / 2 / (1 + (1 + eps / 2) ** (n[0] / 2))
    powers = at.decay**n
    difference = 2 * half_sinh * (np.cumsum((1 - powers) ** 2 / powers) - degree * half_cosh_excess)
    denominator = difference * (difference + 2 * degree * at.sinh)
    excess = 2 * (1 - at.decay**degree) + 2 * degree * at.sinh * at.cosh + (degree * at.sinh) ** 2
    return 4 * at.sinh / 3 * (n * (n + 1) / ((2 * n - 1) * (2 * n + 3)) * excess / denominator).sum()


def spin(at: Geometry) -> Any:
    """Give the torque for rotation about the wall's normal over 8 pi mu a^3 Omega (Jeffery 1915)."""
    powers = at.decay ** at.n[1:]
    return ((2 * at.sinh * powers / (1 - powers**2)) ** 3).sum()


def wall_series(eps: Any, digits: int = 22) -> Numbers:
    """Give the eight functions of a sphere beside a wall.

    Parameters
    ----------
    eps
        Gap between sphere and wall over the sphere's radius a; the centre is at h = a (1 + eps).
    digits
        Decimal digits to which the series are summed.

    Returns
    -------
    functions : (8,)
        In the order of `NAMES`:
        fpar, tpar: force along the wall over 6 pi mu a U and torque over 8 pi mu a^2 U, translation along the wall;
        frot, trot: force over 6 pi mu a^2 Omega and torque over 8 pi mu a^3 Omega, rotation about an axis in the wall;
        fperp: force over 6 pi mu a U, translation towards the wall;
        tspin: torque over 8 pi mu a^3 Omega, rotation about the normal;
        fshear, tshear: force over 6 pi mu a h S and torque over 4 pi mu a^3 S on the sphere held in u_x = S z.
        All are magnitudes and positive; `wall_functions.wall_resistance` has the signs.

    Raises
    ------
    ValueError
        When eps is not positive, or a float beyond `FARTHEST`.

    Notes
    -----
    Measured relative errors with a 64-bit mantissa, against 40 digits: below 2e-12 for eps from 1e-7 to 100, 2e-15 from
    1e-4 to 1, and 5e-10 (tpar, frot only) at 1000. Where numpy's long double is double, expect 2000 times these.
    """
    at = geometry(eps, digits)
    one, zero = at.n[1], at.n[0]
    force, _ = force_and_torque(at, SurfaceVelocity(one, zero, zero))
    cross, torque = force_and_torque(at, SurfaceVelocity(zero, one, one))
    drag, twist = force_and_torque(at, SurfaceVelocity(-at.coth, -one, zero))  # cancels the shear on the sphere
    fpar = at.sinh * force / 6
    frot = -(at.sinh**2) * cross / 6
    trot = at.sinh**3 * torque / 8
    fshear, tshear = -(at.sinh**2) * drag / (6 * at.cosh), -(at.sinh**3) * twist / 4
    # The torque under translation equals 3/4 frot (reciprocal theorem) but cancels far from the wall.
    return np.array([fpar, 3 * frot / 4, frot, trot, squeeze(at), spin(at), fshear, tshear])
