"""How wrong the answer may be: an estimate of what the method leaves out, for the right-hand side at hand; compiled.

Four things are left out, and their parts are added as if independent.

1. Squeezing between two spheres. Lubrication takes away a share of their speed of approach, which by the exact and the
   Rotne-Prager mobilities of two equal spheres is 1/(1 + 2.5 x + 0.75 x² + 0.1 x⁴), x = gap (a+b)/(ab).
2. Sliding between two spheres. The same by the leading term πηa ln(1/x) of the resistance (Jeffrey and Onishi, J. Fluid
   Mech. 139 (1984) 261, equations 3.17 and 4.1) and the slip's mobility (1/3 + 1/4)/(πηa), of which 4/7 is translation.
3. Stresslets. A sphere of radius b in the rate of strain E makes velocities up to 5/2 b³ E/r² (Einstein), E being half
   the shear rate, and 2 F/(8πη r²) from each force and from a sphere's own image; cut down above a wall by 12 h h'/r².
4. With bare lone spheres, what each lacks when it is alone, which is known; all of it for a sphere cut by the wall.
   Errors are relative to the velocities less this.

Strains and stresslets add up as if their directions were independent. Against exact solutions (28 cases of two to four
spheres, radii 1 to 0.01, gaps 1e-3 to 5) the estimate bounds the true error of free motion in shear and of motion under
loads in shear always, at 2.1 and 2.9 times the truth in the median; under random loads without flow in 98 % of 560
cases (4.6 times), under one single force or torque in 93 % of 372 (4.7 times). What it misses are contacts of spheres
of radii one to ten, by less than a factor of two. For more than four spheres there was nothing to compare with.
"""

import math

import numba
import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled, compiled_parallel
from mpad_core.numerics.stokeslets import self_mobilities
from mpad_core.numerics.wall_functions import wall_mobility, wall_shear_load
from mpad_rpb.lone import wall_inverse
from mpad_rpb.scene import Spheres

SERIAL = 64  # spheres; for fewer, starting the threads costs more than the work
LOOKED_UP = 1e-12  # relative error of the table of wall functions, all that a lone sphere has


@compiled
def _square(v: Array) -> float:
    return float(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


@compiled
def _apart(i: int, j: int, centres: Array, radii: Array) -> tuple[float, float, float, float]:
    """Give the vector from j to i and its length, which is kept from zero."""
    x, y, z = centres[i, 0] - centres[j, 0], centres[i, 1] - centres[j, 1], centres[i, 2] - centres[j, 2]
    return x, y, z, max(math.sqrt(x * x + y * y + z * z), 1e-3 * (radii[i] + radii[j]))


@compiled
def _screened(z: float, h: float, r: float, wall: bool) -> float:
    """Give 1/r², less what a wall takes: by Blake's far field of a force along it, 12 z h/r² is left."""
    square = 1 / (r * r)
    return square * min(1.0, 12 * z * h * square) if wall else square


@compiled
def _strain(i: int, centres: Array, radii: Array, push: Array, shear_rate: float, wall: bool) -> float:
    """Estimate the rate of strain at sphere i; `push` holds |F|/(8πη)."""
    total = (0.5 * push[i] / centres[i, 2] ** 2) ** 2 if wall else 0.0
    for j in range(len(radii)):
        if j != i:
            r = max(_apart(i, j, centres, radii)[3], radii[j])
            total += (2 * push[j] * _screened(centres[i, 2], centres[j, 2], r, wall)) ** 2
    return 0.5 * abs(shear_rate) + math.sqrt(total)


@compiled
def _lubricate(i: int, j: int, centres: Array, radii: Array, velocity: Array, out: Array) -> None:
    """Take from sphere i's velocity what lubrication takes, and add the square of what it takes from the spin."""
    a, b = radii[i], radii[j]
    x, y, z, r = _apart(i, j, centres, radii)
    x, y, z = x / r, y / r, z / r
    px, py = a * velocity[i, 3] + b * velocity[j, 3], a * velocity[i, 4] + b * velocity[j, 4]
    pz = a * velocity[i, 5] + b * velocity[j, 5]
    sx = velocity[i, 0] - velocity[j, 0] - (py * z - pz * y)
    sy = velocity[i, 1] - velocity[j, 1] - (pz * x - px * z)
    sz = velocity[i, 2] - velocity[j, 2] - (px * y - py * x)
    approach = sx * x + sy * y + sz * z
    sx, sy, sz = sx - approach * x, sy - approach * y, sz - approach * z
    gap = max((r - a - b) * (a + b) / (a * b), 1e-8)
    drag = 0.29 * math.log(1 + 1 / (gap * gap))  # 7/12 ln(1/x) near contact
    slid = b / (a + b) * drag / (1 + drag)
    squeezed = b / (a + b) * approach / (1 + 2.5 * gap + 0.75 * gap * gap + 0.1 * gap**4)
    out[0] += (3 / 7 * slid) ** 2 * (sx * sx + sy * sy + sz * sz)
    out[1] -= squeezed * x + 4 / 7 * slid * sx
    out[2] -= squeezed * y + 4 / 7 * slid * sy
    out[3] -= squeezed * z + 4 / 7 * slid * sz


@compiled
def _missing(i: int, centres: Array, radii: Array, strain: Array, velocity: Array, wall: bool, out: Array) -> None:
    """Write for sphere i: the square of what stresslets and sliding miss, and the change of U by lubrication (3)."""
    out[:] = 0.0
    a, flow = radii[i], 0.0
    for j in range(len(radii)):
        if j != i:
            b = radii[j]
            r = _apart(i, j, centres, radii)[3]
            reach = max(r, a + b)
            made = 2.5 * b * b * b * strain[j] * _screened(centres[i, 2], centres[j, 2], reach, wall)
            flow += made * made * (1 + (a / reach) ** 2)
            if r - a - b < 10 * min(a, b):
                _lubricate(i, j, centres, radii, velocity, out)
    out[0] += flow


@compiled
def _missing_of_few(centres: Array, radii: Array, push: Array, velocity: Array, shear_rate: float, wall: bool) -> Array:
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
    worst = LOOKED_UP
    for k in range(loads.shape[1]):
        load = loads[:, k].copy().reshape(-1, 6)
        motion = velocity[:, k].copy().reshape(-1, 6)
        push = _pushes(radii, viscosity, load)
        missing = _missing_of_few(centres, radii, push, motion, shear_rate, wall)
        worst = max(worst, _ratio(missing, radii, motion, 0.0))
    return worst


@compiled
def lone_differences(
    centres: Array, radii: Array, gaps: Array, viscosity: float, shear_rate: float, velocity: Array
) -> Array:
    """Give what the wall alone would take from the velocities (N, 6) of bare spheres.

    Each is under its own loads and those by which the others move it, M⁻¹(U − u_∞) with its own bare M. Zero for
    spheres that touch the wall or are cut by it, which have no exact velocity.
    """
    own = self_mobilities(centres, radii, viscosity, True)
    exact, plain, held, out = np.empty((6, 6)), np.empty((6, 6)), np.empty(6), np.zeros((len(radii), 6))
    for i in range(len(radii)):
        if gaps[i] > 0:
            wall_mobility(centres[i, 2], gaps[i], radii[i], viscosity, exact)
            wall_shear_load(centres[i, 2], gaps[i], radii[i], viscosity, shear_rate, held)
            wall_inverse(own[i], plain)
            moved = velocity[i].copy()
            moved[0] -= shear_rate * centres[i, 2]
            moved[4] -= 0.5 * shear_rate
            out[i] = velocity[i] - exact @ (plain @ moved + held)
    return out


@compiled
def _lost_alone(difference: Array, radii: Array, gaps: Array, velocity: Array) -> float:
    """Give the square of the error (U, aΩ) that the wall makes; it is the whole of a velocity without an exact one."""
    total = 0.0
    for i in range(len(radii)):
        wrong = difference[i] if gaps[i] > 0 else velocity[i]
        total += _square(wrong[:3]) + radii[i] ** 2 * _square(wrong[3:])
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
    worst = LOOKED_UP
    for k in range(loads.shape[1]):
        load, motion = (np.ascontiguousarray(block[:, k]).reshape(-1, 6) for block in (loads, velocity))
        alone = 0.0
        if bare:
            difference = lone_differences(at, radii, spheres.gaps, fluid.viscosity, fluid.shear_rate, motion)
            alone = _lost_alone(difference, radii, spheres.gaps, motion)
            motion = motion - difference  # what is too fast near the wall must not make its own error look small
        missing = rows(at, radii, _pushes(radii, fluid.viscosity, load), motion, fluid.shear_rate, fluid.wall)
        worst = max(worst, _ratio(missing, radii, motion, alone))
    return worst
