"""Resistance of two spheres in unbounded fluid: look-up of the exact functions, and the 12x12 matrix.

The functions are those of `pair_series`, which see for the equations and their sources. The look-up holds, by octave of
the reduced gap eps, a polynomial for each function; an octave is filled from the series when it is first asked for.

Pair frame: z points from sphere 1, the larger, to sphere 2. Six-vectors are ordered x, y, z of velocity (or force),
x, y, z of angular velocity (or torque, about the centre); twelve-vectors are sphere 1, then sphere 2. The gap decides,
never the distance of centres, which has lost its digits near contact.
"""

from functools import lru_cache
from math import frexp, isfinite, log, nan

import numpy as np
import numpy.typing as npt

from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.pair_series import SIZE, regular_functions, whole_functions

Array = npt.NDArray[np.float64]

ALONG, SPIN, ACROSS, STRAIN_ALONG, STRAIN_ACROSS = 0, 3, 6, 16, 18
"""Where the groups of functions begin; `PairFunctions` lists them."""

NODES = 16
"""Per octave: the functions are singular at eps = 0 only, so Chebyshev's error falls as 5.83^-NODES."""

NEAREST = -20
"""Below eps = 2^NEAREST the lubrication form stands in for the series."""

FARTHEST = 40
"""From eps = 2^FARTHEST the spheres count as alone."""

__all__ = [
    "ACROSS",
    "ALONG",
    "SPIN",
    "STRAIN_ACROSS",
    "STRAIN_ALONG",
    "PairFunctions",
    "exact_functions",
    "pair_resistance",
    "pair_strain_load",
]


def _chebyshev_nodes() -> Array:
    return np.asarray(np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES))


def _values_to_powers() -> Array:
    """Give (NODES, NODES): what turns the values at the Chebyshev nodes into the coefficients of powers of t."""
    to_chebyshev = np.polynomial.chebyshev.chebvander(_chebyshev_nodes(), NODES - 1).T * (2.0 / NODES)
    to_chebyshev[0] /= 2.0
    to_powers = np.zeros((NODES, NODES))
    for degree in range(NODES):
        to_powers[: degree + 1, degree] = np.polynomial.chebyshev.cheb2poly(np.eye(NODES)[degree, : degree + 1])
    return np.asarray(to_powers @ to_chebyshev)


_OCTAVE_NODES = 1.5 + 0.5 * _chebyshev_nodes()  # of an octave that begins at 1
_TO_POWERS = _values_to_powers()


def _sums(ratio: float, eps: Array) -> Array:
    return np.array([regular_functions(ratio, each) for each in eps.tolist()])


def _octave(ratio: float, octave: int) -> Array:
    """Give (NODES, 22): the regular functions from 2^octave to twice that, as powers of t in (-1, 1)."""
    return np.asarray(_TO_POWERS @ _sums(ratio, 2.0**octave * _OCTAVE_NODES))


def _lubrication(ratio: float) -> Array:
    """Give (4, 22): the regular functions near contact, over 1, ln(1/eps), eps and eps ln(1/eps).

    These are the first terms of the expansions of Jeffrey & Onishi (1984, section 4 onwards), matched to the series in
    four points; the next ones, of order eps^2 ln(1/eps), are below 1e-10 there.
    """
    eps = np.ldexp(1.0, np.arange(NEAREST, NEAREST + 4))
    logarithm = np.log(1.0 / eps)
    basis = np.array([np.ones(4), logarithm, eps, eps * logarithm]).T
    unit = np.abs(basis).max(axis=0)
    return np.asarray(np.linalg.solve(basis / unit, _sums(ratio, eps)) / unit[:, None])


def _alone(ratio: float) -> Array:
    """Give the functions of spheres infinitely far apart: Stokes' drag and torque."""
    f = np.zeros(SIZE)
    f[[0, 6]], f[[2, 10]] = 6.0 * np.pi, 6.0 * np.pi * ratio
    f[[3, 13]], f[[5, 15]] = 8.0 * np.pi, 8.0 * np.pi * ratio**3
    return f


@compiled
def _from_powers(coefficients: Array, ratio: float, eps: float, t: float) -> Array:
    f = np.zeros(SIZE)
    for power in range(coefficients.shape[0] - 1, -1, -1):
        for i in range(SIZE):
            f[i] = f[i] * t + coefficients[power, i]
    whole_functions(ratio, eps, f)
    return f


@compiled
def _from_lubrication(coefficients: Array, ratio: float, eps: float) -> Array:
    f = np.empty(SIZE)
    logarithm = log(1.0 / eps)
    for i in range(SIZE):
        constant = coefficients[0, i] + coefficients[1, i] * logarithm
        f[i] = constant + eps * (coefficients[2, i] + coefficients[3, i] * logarithm)
    whole_functions(ratio, eps, f)
    return f


class PairFunctions:
    """The resistance functions of two spheres of a given ratio of radii, looked up to about 1e-11.

    Numbers are in units of viscosity and the larger radius. Index by index, with z along the line from sphere 1 (the
    larger) to sphere 2 and R the resistance, F = R U being what it takes to move the spheres:

    - 0-2 (`ALONG`): R11, R12, R22 between velocity and force along z;
    - 3-5 (`SPIN`): R11, R12, R22 between angular velocity and torque about z;
    - 6-15 (`ACROSS`): the upper triangle, row by row, of the symmetric matrix that gives (F1x, F2x, T1y, T2y) from
      (U1x, U2x, Omega1y, Omega2y); it also gives (F1y, F2y, -T1x, -T2x) from (U1y, U2y, -Omega1x, -Omega2x);
    - 16-17 (`STRAIN_ALONG`): F1z, F2z in the ambient flow (-x/2, -y/2, z);
    - 18-21 (`STRAIN_ACROSS`): F1x, F2x, T1y, T2y in the ambient flow (z, 0, x).

    The last six are the loads that the fluid exerts on the spheres held fixed, less R times the ambient velocity at the
    centres; they do not depend on where the flow has its origin (X^G, Y^G and Y^H of Kim & Karrila 1991, chapter 11).

    Pieces are filled when first asked for; what comes out does not depend on the order of asking.

    Parameters
    ----------
    ratio
        Smaller radius over larger, in (0, 1].

    Raises
    ------
    ValueError
        When ratio is out of range.
    """

    def __init__(self, ratio: float) -> None:
        if not 0.0 < ratio <= 1.0:
            raise ValueError(f"smaller radius over larger must be in (0, 1], got {ratio}")
        self.ratio = float(ratio)
        self._pieces: dict[int, Array] = {}

    @classmethod
    def of(cls, ratio: float) -> "PairFunctions":
        """Give the instance of that ratio that is shared by all who ask here."""
        return _shared(float(ratio))

    def __repr__(self) -> str:
        """Name the ratio."""
        return f"PairFunctions({self.ratio})"

    def __call__(self, eps: float) -> Array:
        """Look the functions up.

        Parameters
        ----------
        eps
            Gap (a+b)/(2ab), for equal spheres gap/a. From 2^40 the spheres count as alone.

        Returns
        -------
        functions : (22,)
            NaN when eps is not positive, so that an overlap does not pass for a number.
        """
        if not eps > 0.0:
            return np.full(SIZE, nan)
        mantissa, exponent = frexp(eps)
        octave = exponent - 1
        if octave >= FARTHEST or not isfinite(eps):
            return _alone(self.ratio)
        if octave < NEAREST:
            return _from_lubrication(self._piece(NEAREST - 1), self.ratio, eps)
        return _from_powers(self._piece(octave), self.ratio, eps, 4.0 * mantissa - 3.0)

    def _piece(self, octave: int) -> Array:
        piece = self._pieces.get(octave)
        if piece is None:
            piece = _lubrication(self.ratio) if octave < NEAREST else _octave(self.ratio, octave)
            self._pieces[octave] = piece
        return piece


TABLES = 64
"""Ratios of radii among many pairs up to which each gets its look-up; beyond, the series is summed for every pair."""


def exact_functions(ratios: Array, gaps: Array) -> Array:
    """Give the functions (K, 22) of `PairFunctions` for many pairs.

    Parameters
    ----------
    ratios : (K,)
        Smaller radius over larger.
    gaps : (K,)
        Times (a+b)/(2ab); NaN comes of those that are not positive.
    """
    listed = ratios.tolist()
    if len(set(listed)) <= TABLES:
        each = [PairFunctions.of(ratio)(gap) for ratio, gap in zip(listed, gaps.tolist(), strict=True)]
        return np.array(each).reshape(-1, SIZE)
    return np.array([_summed(*pair) for pair in zip(listed, gaps.tolist(), strict=True)])


def _summed(ratio: float, eps: float) -> Array:
    """Give the functions without filling an octave, where the series converges."""
    if not 2.0**NEAREST <= eps < 2.0**FARTHEST:
        return PairFunctions.of(ratio)(eps)
    f = regular_functions(ratio, eps)
    whole_functions(ratio, eps, f)
    return f


@lru_cache(maxsize=1024)  # as many ratios as there are pairs of kinds; a full table is 0.2 MB
def _shared(ratio: float) -> PairFunctions:
    return PairFunctions(ratio)


@compiled
def _write_block(parallel: float, perpendicular: float, e: Array, out: Array) -> None:
    """Write parallel e e + perpendicular (1 - e e) into out (3, 3)."""
    for i in range(3):
        for j in range(3):
            out[i, j] = (parallel - perpendicular) * (e[i] * e[j])  # symmetric to the last bit
        out[i, i] += perpendicular


@compiled
def _write_cross(factor: float, e: Array, out: Array) -> None:
    """Write the matrix of v -> factor v x e into out (3, 3)."""
    out[:] = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        out[i, j] = factor * e[k]
        out[i, k] = -factor * e[j]


@compiled
def pair_resistance(f: Array, e: Array, a: float, b: float, viscosity: float, out: Array) -> None:
    """Give the resistance matrix R of two spheres: F = R U is what it takes to move them.

    Parameters
    ----------
    f : (22,)
        `PairFunctions` of b/a at their gap.
    e : (3,)
        Unit vector from sphere 1, the larger, to sphere 2.
    a, b
        Radii of spheres 1 and 2, m; a >= b. f knows b/a, so only a counts here.
    viscosity
        Pa s.
    out : (12, 12)
        Written: symmetric positive definite; N s/m, N s and N m s. Rows U1, Omega1, U2, Omega2.
    """
    force = viscosity * a
    for i in range(2):
        for j in range(2):
            line = i + j
            translation, cross, rotation = ACROSS + line + 2 * i * j, ACROSS + 2 + 3 * i + j, ACROSS + 7 + line
            rows, columns = slice(6 * i, 6 * i + 3), slice(6 * j, 6 * j + 3)
            turns, spins = slice(6 * i + 3, 6 * i + 6), slice(6 * j + 3, 6 * j + 6)
            _write_block(force * f[ALONG + line], force * f[translation], e, out[rows, columns])
            _write_block(force * a * a * f[SPIN + line], force * a * a * f[rotation], e, out[turns, spins])
            _write_cross(force * a * f[cross], e, out[rows, spins])
            _write_cross(-force * a * f[cross], e, out[spins, rows])


@compiled
def pair_strain_load(f: Array, e: Array, a: float, viscosity: float, strain: Array, out: Array) -> None:
    """Give the load that an ambient strain exerts on two spheres held fixed, less R times the velocity at the centres.

    Parameters
    ----------
    f, e, a, viscosity
        As for `pair_resistance`.
    strain : (3, 3)
        E of the ambient flow E x, symmetric and traceless; 1/s.
    out : (12,)
        Written: F1, T1, F2, T2; N and N m. A rotation of the ambient flow is not in it: it counts as a velocity.
    """
    stretch, turn = np.zeros(3), np.empty(3)
    for i in range(3):
        for j in range(3):
            stretch[i] += strain[i, j] * e[j]
    along = e[0] * stretch[0] + e[1] * stretch[1] + e[2] * stretch[2]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        turn[i] = e[j] * stretch[k] - e[k] * stretch[j]
    force = viscosity * a * a
    for sphere in range(2):
        pull, shove = f[STRAIN_ALONG + sphere], f[STRAIN_ACROSS + sphere]
        for i in range(3):
            out[6 * sphere + i] = force * (pull * along * e[i] + shove * (stretch[i] - along * e[i]))
            out[6 * sphere + 3 + i] = force * a * f[STRAIN_ACROSS + 2 + sphere] * turn[i]
