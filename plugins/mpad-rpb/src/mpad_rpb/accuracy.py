"""How wrong the answer may be: an estimate of what the method leaves out, for the right-hand side at hand; compiled.

Four things are left out, and their parts are added as if independent.

1. Squeezing between two spheres. Lubrication takes away a share of their speed of approach, which by the exact and the
   Rotne-Prager mobilities of two equal spheres is 1/(1 + 2.5 x + 0.75 x² + 0.1 x⁴), x = gap (a+b)/(ab).
2. Sliding between two spheres. The same by the leading term πηa ln(1/x) of the resistance (Jeffrey and Onishi, J. Fluid
   Mech. 139 (1984) 261, equations 3.17 and 4.1) and the slip's mobility (1/3 + 1/4)/(πηa), of which 4/7 is translation.
3. Stresslets. A sphere of radius b in the rate of strain E makes velocities up to 5/2 b³ E/r² (Einstein), E being half
   the shear rate, and 2 F/(8πη r²) from each force and from a sphere's own image; cut down above a wall by 12 h h'/r².
4. With bare lone spheres, what each lacks when it is alone, which is known; all of it for a sphere cut by the wall.

Against exact solutions (28 cases of two to four spheres, radii 1 to 0.01, gaps 1e-3 to 5) the estimate bounds the true
error of free motion in shear and of motion under loads in shear always, at 2.3 and 3.2 times the truth in the median;
under random loads without flow in 98 % of 560 cases (6 times), under one single force or torque in 93 % of 372
(5 times); the rest, contacts of spheres ten times different, exceed it by less than a factor of two.
"""

import math

import numba
import numpy as np
from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled, compiled_parallel
from mpad_core.numerics.stokeslets import self_mobilities
from mpad_core.numerics.wall_functions import wall_mobility, wall_shear_load

from mpad_rpb.scene import Spheres

SERIAL = 64  # spheres; for fewer, starting the threads costs more than the work


@compiled
def _square(v: Array) -> float:
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]


@compiled
def _screen(z: float, h: float, square: float, wall: bool) -> float:
    """Give the share of a flow that the wall leaves: Blake's far field 12 h z/r² of a force along the wall."""
    return min(1.0, 12 * z * h / square) if wall else 1.0


@compiled
def _strain(i: int, centres: Array, radii: Array, push: Array, shear_rate: float, wall: bool) -> float:
    """Estimate the rate of strain at sphere i; `push` holds |F|/(8πη)."""
    total = 0.5 * abs(shear_rate)
    if wall:
        total += 0.5 * push[i] / centres[i, 2] ** 2
    for j in range(len(radii)):
        if j != i:
            square = max(_square(centres[i] - centres[j]), radii[j] ** 2)
            total += 2 * push[j] / square * _screen(centres[i, 2], centres[j, 2], square, wall)
    return total


@compiled
def _near(gap: float, a: float, b: float, approach: float, slip: Array, e: Array, out: Array) -> None:
    """Take from a sphere's velocity what lubrication takes, and add the square of what it takes from the spin."""
    x = max(gap * (a + b) / (a * b), 1e-8)
    drag = 0.29 * math.log(1 + 1 / (x * x))  # 7/12 ln(1/x) near contact
    squeezed = approach / (1 + 2.5 * x + 0.75 * x * x + 0.1 * x**4)
    slid = drag / (1 + drag)
    mine = b / (a + b)
    out[1:] -= mine * (squeezed * e + 4 / 7 * slid * slip)
    out[0] += (3 / 7 * mine * slid) ** 2 * _square(slip)


@compiled
def _missing(i: int, centres: Array, radii: Array, strain: Array, velocity: Array, wall: bool, out: Array) -> None:
    """Write for sphere i: the square of what stresslets and sliding miss, and the change of U by lubrication (3)."""
    out[:] = 0.0
    slip = np.empty(3)
    a, flow, spin = radii[i], 0.0, 0.0
    for j in range(len(radii)):
        if j == i:
            continue
        b = radii[j]
        e = centres[i] - centres[j]
        square = max(_square(e), (1e-3 * (a + b)) ** 2)
        r = math.sqrt(square)
        reach = max(r, a + b)
        made = 2.5 * b**3 * strain[j] / reach**2 * _screen(centres[i, 2], centres[j, 2], square, wall)
        flow += made
        spin += made * a / reach
        if r - a - b > 10 * min(a, b):
            continue
        e /= r
        for k in range(3):
            m, n = (k + 1) % 3, (k + 2) % 3
            roll_m = a * velocity[i, 3 + m] + b * velocity[j, 3 + m]
            roll_n = a * velocity[i, 3 + n] + b * velocity[j, 3 + n]
            slip[k] = velocity[i, k] - velocity[j, k] - (roll_m * e[n] - roll_n * e[m])
        approach = slip[0] * e[0] + slip[1] * e[1] + slip[2] * e[2]
        slip -= approach * e
        _near(r - a - b, a, b, approach, slip, e, out)
    out[0] += flow * flow + spin * spin


@compiled
def _missing_of_few(
    centres: Array, radii: Array, push: Array, velocity: Array, shear_rate: float, wall: bool
) -> Array:
    strain, out = np.empty(len(radii)), np.empty((len(radii), 4))
    for i in range(len(radii)):
        strain[i] = _strain(i, centres, radii, push, shear_rate, wall)
    for i in range(len(radii)):
        _missing(i, centres, radii, strain, velocity, wall, out[i])
    return out


@compiled_parallel
def _missing_of_many(
    centres: Array, radii: Array, push: Array, velocity: Array, shear_rate: float, wall: bool
) -> Array:
    strain, out = np.empty(len(radii)), np.empty((len(radii), 4))
    for i in numba.prange(len(radii)):
        strain[i] = _strain(i, centres, radii, push, shear_rate, wall)
    for i in numba.prange(len(radii)):
        _missing(i, centres, radii, strain, velocity, wall, out[i])
    return out


@compiled
def _pushes(radii: Array, viscosity: float, loads: Array) -> Array:
    """Give |F|/(8πη), a torque counting as a force at the radius."""
    push = np.empty(len(radii))
    for i in range(len(radii)):
        size = math.sqrt(_square(loads[i, :3])) + math.sqrt(_square(loads[i, 3:])) / radii[i]
        push[i] = size / (8 * math.pi * viscosity)
    return push


@compiled
def _ratio(missing: Array, radii: Array, velocity: Array, alone: float) -> float:
    """Give the relative error: what is missing over the velocities as lubrication leaves them."""
    lost, whole = alone, 0.0
    for i in range(len(radii)):
        lost += missing[i, 0] + _square(missing[i, 1:])
        whole += _square(velocity[i, :3] + missing[i, 1:]) + radii[i] ** 2 * _square(velocity[i, 3:])
    return math.sqrt(lost / whole) if whole > 0 else 0.0


@compiled
def _error_of_few(
    centres: Array, radii: Array, viscosity: float, shear_rate: float, wall: bool, loads: Array, velocity: Array
) -> float:
    worst = 0.0
    for k in range(loads.shape[1]):
        load = loads[:, k].copy().reshape(-1, 6)
        motion = velocity[:, k].copy().reshape(-1, 6)
        push = _pushes(radii, viscosity, load)
        missing = _missing_of_few(centres, radii, push, motion, shear_rate, wall)
        worst = max(worst, _ratio(missing, radii, motion, 0.0))
    return worst


@compiled
def lone_error(
    centres: Array, radii: Array, gaps: Array, viscosity: float, shear_rate: float, loads: Array, velocity: Array
) -> float:
    """Give the square of the error (U, aΩ) that bare spheres would make if each were alone above the wall."""
    own = self_mobilities(centres, radii, viscosity, True)
    exact, held = np.empty((6, 6)), np.empty(6)
    total = 0.0
    for i in range(len(radii)):
        difference = velocity[i].copy()
        if gaps[i] > 0:
            wall_mobility(centres[i, 2], gaps[i], radii[i], viscosity, exact)
            wall_shear_load(centres[i, 2], gaps[i], radii[i], viscosity, shear_rate, held)
            difference = (own[i] - exact) @ loads[i] - exact @ held
            difference[0] += shear_rate * centres[i, 2]
            difference[4] += 0.5 * shear_rate
        total += _square(difference[:3]) + radii[i] ** 2 * _square(difference[3:])
    return total


def error_of(spheres: Spheres, loads: Array, velocity: Array) -> float:
    """Estimate the relative 2-norm error of (U, aΩ), the largest over the columns.

    Parameters
    ----------
    spheres
        Where they are.
    loads, velocity : (6N, k)
        Right-hand sides and answers.
    """
    fluid, at, radii = spheres.setting, spheres.centres, spheres.radii
    bare = fluid.wall and not spheres.exact
    if len(radii) <= SERIAL and not bare:
        return _error_of_few(at, radii, fluid.viscosity, fluid.shear_rate, fluid.wall, loads, velocity)
    rows = _missing_of_few if len(radii) <= SERIAL else _missing_of_many
    worst = 0.0
    for k in range(loads.shape[1]):
        load, motion = (np.ascontiguousarray(block[:, k]).reshape(-1, 6) for block in (loads, velocity))
        alone = lone_error(at, radii, spheres.gaps, fluid.viscosity, fluid.shear_rate, load, motion) if bare else 0.0
        missing = rows(at, radii, _pushes(radii, fluid.viscosity, load), motion, fluid.shear_rate, fluid.wall)
        worst = max(worst, _ratio(missing, radii, motion, alone))
    return worst
