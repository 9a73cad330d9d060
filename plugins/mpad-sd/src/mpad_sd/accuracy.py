"""How wrong the answer may be, by the size of the last moments; compiled.

What the moments above a sphere's degree p would add is judged by those of degree p in the solution: of a sphere with
near neighbours by themselves, of one without by what other spheres make of them, since alone it is exact by its
correction. In the units of `harmonics.layout`, in which squares are energies, the relative error is SHARE of their
norm over that of the velocities. Measured for two spheres above the wall (radii to 5:1, gaps 1e-3 to 1, any
orientation; shear, loads, both): the truth is below the estimate in 98 % of cases, and a third of it in the median.
"""

import math

import numpy as np

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.values import Configuration
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.harmonics.krylov import System, balance
from mpad_core.numerics.harmonics.layout import place, places
from mpad_core.numerics.neighbours import closest_pair

SHARE = 0.045

FAR = 550.0
"""What far spheres leave out falls as the cube of the distance, in smaller radii, from which on they are far.

Measured for eight to twelve spheres at gaps of 1e-3 to 1 and of 0.3 to 6, with reaches of 1.5, 4 and 8; and such that
no pair just beyond a reach of 1.5 errs by more than six times the estimate.
"""

LEAST = 1e-10
"""Of the exact functions, all that a lone sphere has."""


@compiled
def _last_moments(p: int, own: Array) -> float:
    """Give the square of the norm of the coefficients of degree p of one sphere (flat)."""
    t, total = places(p), 0.0
    for row in range(6):
        for m in range(p + 1):
            total += own[row * t + place(p, m)] ** 2
    return total


@compiled
def error_of(system: System, ambient: Array, load: Array, y: Array, u: Array, lonely: Indices) -> float:
    """Estimate the relative error of one column.

    Parameters
    ----------
    system, ambient, load
        As `krylov.solve_columns` has them; load (N, 6).
    y, u : (n,), (N, 6)
        The solution.
    lonely : (N,)
        1 for spheres without near neighbours.
    """
    at, alone, motion = system.at, np.empty_like(y), np.empty_like(u)
    balance(system, -ambient, load, alone, motion)
    missed, size = 0.0, 0.0
    for i in range(len(lonely)):
        own = y[at.own[i] : at.own[i + 1]].copy()
        if lonely[i]:
            for k in range(len(own)):
                own[k] -= alone[at.own[i] + k]
        missed += _last_moments(at.degrees[i], own)
        for k in range(6):
            size += u[i, k] * u[i, k]
    return max(LEAST, SHARE * math.sqrt(missed / size)) if size > 0 else 0.0


def missed_afar(system: System, reach: float) -> float:
    """Give by how much the estimate grows where pairs with gaps above `reach` smaller radii have their moments only."""
    count = len(system.at.degrees)
    every = count * (count - 1) // 2
    return 1.0 if len(system.pairs.rows) == every else 1 + FAR / (2 + reach) ** 3


def feigned_by(configuration: Configuration, least: float, wall: bool) -> float:
    """Estimate the relative error of giving closer surfaces the lubrication of the least gap (smaller radii).

    What changes visibly is sliding, whose resistance grows as the logarithm of the gap ε: along a wall as
    8/15 ln 1/ε + 0.96 (Goldman, Cox and Brenner, Chem. Eng. Sci. 22 (1967) 637), of a sphere past another as
    1/6 ln 1/ε + 1 (Jeffrey and Onishi, J. Fluid Mech. 139 (1984) 261). Touching surfaces do not slide at all: 1.
    """
    errors = [0.0]
    if wall:
        errors.append(_slid(float((configuration.wall_gaps / configuration.radii).min()), least, 8 / 15, 0.96))
    i, j, gap = closest_pair(configuration.centres, configuration.radii)
    if i != j:
        errors.append(_slid(gap / float(min(configuration.radii[i], configuration.radii[j])), least, 1 / 6, 1.0))
    return max(errors)


def _slid(gap: float, least: float, slope: float, rest: float) -> float:
    """Give the share of the sliding speed at the least gap that the true gap would take away."""
    if gap >= least:
        return 0.0
    if gap <= 0:
        return 1.0
    near, far = slope * math.log(1 / gap) + rest, slope * math.log(1 / least) + rest
    return near / far - 1
