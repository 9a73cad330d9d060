"""Resistance of a sphere beside a plane no-slip wall: compiled look-up of the exact functions, and the 6x6 matrix.

The functions are those of `wall_series`, which see for their definitions and sources. They are looked up by eps, the
gap over the radius, in three ranges (`benchmarks/make_wall_table.py` says how the coefficients are made): lubrication
form below eps = 2^-10, polynomials by octave of eps to 1, series in a/h beyond. They hold for every eps > 0, however
small or large; for any other they are NaN, so that an overlap does not pass for a number.

The gap is always an argument of its own: height - radius has lost its digits near contact. Six-vectors are ordered
x, y, z of velocity (or force), x, y, z of angular velocity (or torque, about the centre); the wall is z = 0.
"""

from math import frexp, log, nan

import numpy as np
import numpy.typing as npt

from mpad_core.numerics import _wall_table
from mpad_core.numerics.compiled import compiled, compiled_lean
from mpad_core.numerics.wall_series import NAMES

Array = npt.NDArray[np.float64]

FPAR, TPAR, FROT, TROT, FPERP, TSPIN, FSHEAR, TSHEAR = range(8)
"""Places of the functions in every array of them, the order of `NAMES`."""

NEAR = np.array(_wall_table.NEAR).reshape(_wall_table.NEAR_SHAPE)
MIDDLE = np.array(_wall_table.MIDDLE).reshape(_wall_table.MIDDLE_SHAPE)
FAR = np.array(_wall_table.FAR).reshape(_wall_table.FAR_SHAPE)
OCTAVES = len(MIDDLE)
NEAR_LIMIT = 2.0**-OCTAVES

__all__ = [
    "FPAR",
    "FPERP",
    "FROT",
    "FSHEAR",
    "NAMES",
    "TPAR",
    "TROT",
    "TSHEAR",
    "TSPIN",
    "wall_drift",
    "wall_functions",
    "wall_functions_array",
    "wall_mobility",
    "wall_resistance",
    "wall_shear_load",
    "wall_velocity",
]


@compiled_lean
def _near(eps: float, out: Array) -> None:
    logarithm = log(1.0 / eps)
    out[:] = 0.0
    for power in range(NEAR.shape[0] - 1, -1, -1):
        for i in range(8):
            out[i] = out[i] * eps + (NEAR[power, 0, i] + NEAR[power, 1, i] * logarithm)
    out[FPERP] /= eps


@compiled_lean
def _middle(eps: float, out: Array) -> None:
    mantissa, exponent = frexp(eps)
    octave = OCTAVES - 1 + exponent
    t = 4.0 * mantissa - 3.0
    out[:] = 0.0
    for power in range(MIDDLE.shape[1] - 1, -1, -1):
        for i in range(8):
            out[i] = out[i] * t + MIDDLE[octave, power, i]
    out[FPERP] /= eps


@compiled_lean
def _far(eps: float, out: Array) -> None:
    x = 1.0 / (1.0 + eps)
    t = 4.0 * x - 1.0
    out[:] = 0.0
    for power in range(FAR.shape[0] - 1, -1, -1):
        for i in range(8):
            out[i] = out[i] * t + FAR[power, i]
    cube = x * x * x
    out[FPAR] = 1.0 + x * out[FPAR]
    out[TPAR] *= x * cube
    out[TROT] = 1.0 + cube * out[TROT]
    out[FPERP] = 1.0 + x * out[FPERP]
    out[TSPIN] = 1.0 + cube * out[TSPIN]
    out[FSHEAR] = 1.0 + x * out[FSHEAR]
    out[TSHEAR] = 1.0 + cube * out[TSHEAR]


@compiled_lean
def wall_functions(eps: float, out: Array) -> None:
    """Look the eight functions up, to about 1e-12 of each.

    Parameters
    ----------
    eps
        Gap over radius, positive; NaN comes out for any other.
    out : (8,)
        Written: fpar, tpar, frot, trot, fperp, tspin, fshear, tshear, as `wall_series.wall_series` defines them.
    """
    if not eps > 0.0:
        out[:] = nan
    elif eps < NEAR_LIMIT:
        _near(eps, out)
    elif eps < 1.0:
        _middle(eps, out)
    else:
        _far(eps, out)
    out[FROT] = 4.0 / 3.0 * out[TPAR]  # the reciprocal theorem, to the last bit


@compiled
def wall_functions_array(eps: Array) -> Array:
    """Look the functions up for many spheres.

    Parameters
    ----------
    eps : (N,)
        Gaps over radii, as for `wall_functions`.

    Returns
    -------
    functions : (N, 8)
    """
    out = np.empty((eps.size, 8))
    for i in range(eps.size):
        wall_functions(eps[i], out[i])
    return out


@compiled
def wall_resistance(height: float, gap: float, radius: float, viscosity: float, out: Array) -> None:
    """Give the resistance matrix R of a sphere above the wall z = 0: F = R U is what it takes to move it.

    Parameters
    ----------
    height
        Of the centre above the wall, m; height = gap + radius up to rounding, only the gap counts here.
    gap
        From wall to surface, m; positive.
    radius
        m.
    viscosity
        Pa s.
    out : (6, 6)
        Written: symmetric positive definite; N s/m, N s and N m s.
    """
    f = np.empty(8)
    wall_functions(gap / radius, f)
    force = 6.0 * np.pi * viscosity * radius
    torque = 8.0 * np.pi * viscosity * radius**3
    cross = 6.0 * np.pi * viscosity * radius**2 * f[FROT]
    out[:] = 0.0
    out[0, 0] = out[1, 1] = force * f[FPAR]
    out[2, 2] = force * f[FPERP]
    out[3, 3] = out[4, 4] = torque * f[TROT]
    out[5, 5] = torque * f[TSPIN]
    out[0, 4] = out[4, 0] = -cross  # the wall holds back the near side: a sphere dragged along x rolls about +y
    out[1, 3] = out[3, 1] = cross


@compiled
def wall_mobility(height: float, gap: float, radius: float, viscosity: float, out: Array) -> None:
    """Give the mobility matrix M of a sphere above the wall, the inverse of `wall_resistance`: U = M F.

    Parameters
    ----------
    height, gap, radius, viscosity
        As for `wall_resistance`.
    out : (6, 6)
        Written: symmetric positive definite; m/(N s), 1/(N s) and 1/(N m s).
    """
    wall_resistance(height, gap, radius, viscosity, out)
    translation, rotation, cross = out[0, 0], out[4, 4], out[0, 4]
    determinant = translation * rotation - cross * cross
    out[0, 0] = out[1, 1] = rotation / determinant
    out[3, 3] = out[4, 4] = translation / determinant
    out[0, 4] = out[4, 0] = -cross / determinant
    out[1, 3] = out[3, 1] = cross / determinant
    out[2, 2] = 1.0 / out[2, 2]
    out[5, 5] = 1.0 / out[5, 5]


@compiled
def _perpendicular_slope(eps: float) -> float:
    """Give the derivative of 1/fperp by eps; the ranges and forms are those of `wall_functions`."""
    value, slope = 0.0, 0.0  # below eps = 1: of eps fperp, and eps times its derivative
    if not eps > 0.0:
        return nan
    if eps >= 1.0:
        x = 1.0 / (1.0 + eps)
        t = 4.0 * x - 1.0
        for power in range(FAR.shape[0] - 1, -1, -1):
            slope = slope * t + value
            value = value * t + FAR[power, FPERP]
        f = 1.0 + x * value
        return x * x * (value + 4.0 * x * slope) / (f * f)
    if eps < NEAR_LIMIT:
        logarithm = log(1.0 / eps)
        for power in range(NEAR.shape[0] - 1, -1, -1):
            term = NEAR[power, 0, FPERP] + NEAR[power, 1, FPERP] * logarithm
            value = value * eps + term
            slope = slope * eps + power * term - NEAR[power, 1, FPERP]
    else:
        mantissa, exponent = frexp(eps)
        octave, t = OCTAVES - 1 + exponent, 4.0 * mantissa - 3.0
        for power in range(MIDDLE.shape[1] - 1, -1, -1):
            slope = slope * t + value
            value = value * t + MIDDLE[octave, power, FPERP]
        slope *= 4.0 * mantissa
    return (value - slope) / (value * value)


@compiled
def wall_drift(gap: float, radius: float, viscosity: float) -> float:
    """Give the derivative of the mobility M_zz of a sphere above the wall by its height, in m/(N s) a metre.

    It is all that the divergence of a lone sphere's mobility is made of: M changes with the height alone, and a force
    along z turns nothing and moves nothing sideways. Parameters as for `wall_mobility`.
    """
    return _perpendicular_slope(gap / radius) / (6.0 * np.pi * viscosity * radius * radius)


@compiled
def wall_shear_load(height: float, gap: float, radius: float, viscosity: float, shear_rate: float, out: Array) -> None:
    """Give the force and torque that the shear flow u = (shear_rate z, 0, 0) exerts on a sphere held above the wall.

    Parameters
    ----------
    height, gap, radius, viscosity
        As for `wall_resistance`; the force grows with the height.
    shear_rate
        1/s, of either sign.
    out : (6,)
        Written: force, N, and torque about the centre, N m.
    """
    f = np.empty(8)
    wall_functions(gap / radius, f)
    out[:] = 0.0
    out[0] = 6.0 * np.pi * viscosity * radius * height * shear_rate * f[FSHEAR]
    out[4] = 4.0 * np.pi * viscosity * radius**3 * shear_rate * f[TSHEAR]


@compiled_lean
def add_wall_resistance(
    o: int, height: float, gap: float, radius: float, viscosity: float, shear_rate: float, functions: Array,
    resistance: Array, load: Array,
) -> None:  # fmt: skip
    """Add what `wall_resistance` and `wall_shear_load` give, by one look-up, to larger matrices from place `o` on.

    `functions` (8,) is overwritten.
    """
    f = functions
    wall_functions(gap / radius, f)
    force = 6.0 * np.pi * viscosity * radius
    torque = 8.0 * np.pi * viscosity * radius**3
    cross = 6.0 * np.pi * viscosity * radius**2 * f[FROT]
    resistance[o, o] += force * f[FPAR]
    resistance[o + 1, o + 1] += force * f[FPAR]
    resistance[o + 2, o + 2] += force * f[FPERP]
    resistance[o + 3, o + 3] += torque * f[TROT]
    resistance[o + 4, o + 4] += torque * f[TROT]
    resistance[o + 5, o + 5] += torque * f[TSPIN]
    resistance[o, o + 4] -= cross
    resistance[o + 4, o] -= cross
    resistance[o + 1, o + 3] += cross
    resistance[o + 3, o + 1] += cross
    load[o] += force * height * shear_rate * f[FSHEAR]
    load[o + 4] += 0.5 * torque * shear_rate * f[TSHEAR]


@compiled
def wall_velocity(height: float, gap: float, radius: float, viscosity: float, load: Array, out: Array) -> None:
    """Give the velocity of a sphere above the wall under a load: `wall_mobility` times load, in closed form.

    Parameters
    ----------
    height, gap, radius, viscosity
        As for `wall_resistance`.
    load : (6,)
        Force, N, and torque about the centre, N m, that of the ambient flow (`wall_shear_load`) included.
    out : (6,)
        Written: velocity, m/s, and angular velocity, 1/s.
    """
    mobility = np.empty((6, 6))
    wall_mobility(height, gap, radius, viscosity, mobility)
    for i in range(6):
        out[i] = 0.0
        for j in range(6):
            out[i] += mobility[i, j] * load[j]
