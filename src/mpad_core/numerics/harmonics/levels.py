"""A configuration at given degrees: the blocks, the corrections, and the balance of loads that they need."""

import math

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.harmonics.definite import invert
from mpad_core.numerics.harmonics.degrees import Degrees
from mpad_core.numerics.harmonics.image import REACH, image_at, image_terms
from mpad_core.numerics.harmonics.isolated import subtract_functions
from mpad_core.numerics.harmonics.krylov import System, rigid_parts
from mpad_core.numerics.harmonics.layout import W, between, place, places, rigid_units, spots, strain_unit
from mpad_core.numerics.harmonics.pairs import (
    AXIAL,
    SOURCE,
    SOURCE_DEGREE,
    TARGET,
    TARGET_DEGREE,
    Pairs,
    Places,
    pairs_of,
    places_of,
)
from mpad_core.numerics.harmonics.selves import apply_inverse, inverse_size, rigid_resistance, self_inverse
from mpad_core.numerics.pair_functions import PairFunctions, pair_resistance, pair_strain_load
from mpad_core.numerics.wall_functions import wall_resistance, wall_shear_load


@frozen(kw_only=True, eq=False)
class Scene:
    """A configuration and a flow, at unit viscosity."""

    centres: Array
    radii: Array
    gaps: Array  # to the wall
    shear_rate: float
    wall: bool


@compiled
def _selves_of(at: Places, heights: Array, terms: Array) -> tuple[Array, Array, int]:
    """Give image operators and inverses of all spheres, and the first sphere whose matrix is not definite, or -1."""
    size = 0
    for p in at.degrees:
        size += inverse_size(p)
    operators, inverses, start = np.empty(at.operator[-1]), np.empty(size), 0
    for i in range(len(at.degrees)):
        p = at.degrees[i]
        operator = operators[at.operator[i] : at.operator[i + 1]]
        image_at(terms, heights[i], operator)
        shaped = operator.reshape(places(p), REACH, 3, 3)
        if not self_inverse(p, heights[i], shaped, inverses[start : start + inverse_size(p)]):
            return operators, inverses, i
        start += inverse_size(p)
    return operators, inverses, -1


@compiled
def _ambient_traces(at: Places, heights: Array, radii: Array, units: Array, shear_rate: float) -> Array:
    """Give the traces of the shear flow on all spheres, flat."""
    out = np.zeros(at.own[-1])
    for i in range(len(radii)):
        own, where = out[at.own[i] : at.own[i + 1]], spots(at.degrees[i])
        own[where[0]] = shear_rate * heights[i] * units[i, 0]
        own[where[4]] = 0.5 * shear_rate * units[i, 4]
        # the strain rate is (e_x e_z + e_z e_x) shear/2
        own[W * places(at.degrees[i]) + place(2, 1)] = strain_unit(radii[i]) * shear_rate * math.sqrt(0.5)
    return out


@compiled
def _alone(
    at: Places, centres: Array, radii: Array, gaps: Array, shear_rate: float, inverses: Array, wall: bool, exact: bool
) -> tuple[Array, Array, Array, Array]:
    """Give traces of the flow, resistance (6N, 6N) of spheres alone, exact less truncated loads (N, 6), and units.

    In unbounded fluid, harmonics have the lone sphere exactly. At the wall, not `exact` leaves theirs as it is.
    """
    n, units = len(radii), rigid_units(radii)
    ambient = _ambient_traces(at, centres[:, 2], radii, units, shear_rate)
    resistance, load, block = np.eye(6 * n), np.zeros((n, 6)), np.empty((6, 6))
    if wall and not exact:
        start = 0
        for i in range(n):
            own = resistance[6 * i : 6 * i + 6, 6 * i : 6 * i + 6]
            rigid_resistance(at.degrees[i], inverses[start:], own)
            start += inverse_size(at.degrees[i])
    elif wall:
        answer, held = np.empty_like(ambient), np.empty(6)
        apply_inverse(at.degrees, at.own, inverses, ambient, answer)  # what the flow does to held spheres
        rigid_parts(at, answer, load)
        for i in range(n):
            wall_resistance(centres[i, 2], gaps[i], radii[i], 1.0, block)
            wall_shear_load(centres[i, 2], gaps[i], radii[i], 1.0, shear_rate, held)
            for k in range(6):
                load[i, k] = held[k] / units[i, k] - load[i, k]
                for l in range(6):  # noqa: E741
                    resistance[6 * i + k, 6 * i + l] = block[k, l] / (units[i, k] * units[i, l])
    return ambient, resistance, load, units


@frozen(kw_only=True, eq=False)
class Level:
    """A system to solve, the traces of the flow, and the corrections' loads, all in the units of `layout`."""

    scene: Scene
    system: System
    ambient: Array  # (n,)
    load: Array  # (N, 6)
    units: Array  # (N, 6)

    @classmethod
    def of(cls, scene: Scene, degrees: Degrees, lubrication: bool) -> "Level":
        """Form all blocks, and the corrections of spheres alone and of near pairs, if wanted.

        Raises
        ------
        FloatingPointError
            If the mobility at these degrees is not positive definite.
        """
        at = places_of(degrees.spheres, scene.wall)
        pairs = pairs_of(scene.centres, scene.radii, degrees.who, degrees.pairs, scene.wall)
        operators, inverses, bad = np.empty(0), np.empty(0), -1
        if scene.wall:
            terms = image_terms(int(degrees.spheres.max())).reshape(3, -1)
            operators, inverses, bad = _selves_of(at, scene.centres[:, 2] / scene.radii, terms)
        if bad >= 0:
            raise FloatingPointError(f"the wall's block of sphere {bad} is not positive definite")
        ambient, resistance, load, units = _alone(
            at, scene.centres, scene.radii, scene.gaps, scene.shear_rate, inverses, scene.wall, lubrication
        )
        if lubrication:
            _add_lubrication(scene, degrees, pairs, units, resistance, load)
        if not invert(resistance):
            raise FloatingPointError("the resistance is not positive definite")
        system = System(at, pairs, scene.wall, operators, inverses, resistance)
        return cls(scene=scene, system=system, ambient=ambient, load=load, units=units)


def _add_lubrication(
    scene: Scene, degrees: Degrees, pairs: Pairs, units: Array, resistance: Array, load: Array
) -> None:
    """Add what isolated near pairs have exactly and truncated harmonics lack, in the units of `layout`.

    F_lub = -ΔR (U - U_∞) + ΔF, ΔR the exact resistance of the isolated pair less that of the same harmonics, ΔF the
    same difference of loads in the ambient strain (Durlofsky, Brady and Bossis, J. Fluid Mech. 180 (1987) 21; Cichocki,
    Jones, Kutteh and Wajnryb, J. Chem. Phys. 112 (2000) 2548). Harmonics are a Galerkin projection, so ΔR is never
    negative.

    Parameters
    ----------
    scene, degrees, pairs, units
        The spheres and their blocks.
    resistance : (6N, 6N)
        Of all spheres; changed.
    load : (N, 6)
        Changed: ΔR U_∞ + ΔF is added.
    """
    for k in map(int, np.flatnonzero(degrees.near)):
        ratio, eps = _gap(scene.centres, scene.radii, pairs.rows[k])
        exact = PairFunctions.of(ratio)(eps)
        _add_missing(scene.centres, scene.radii, scene.shear_rate, pairs, k, exact, units, resistance, load)


@compiled
def _gap(centres: Array, radii: Array, row: Indices) -> tuple[float, float]:
    """Give the radius ratio of a pair and its gap (a+b)/(2ab)."""
    a, b = radii[row[SOURCE]], radii[row[TARGET]]
    return b / a, (between(centres, row[TARGET], row[SOURCE]) - a - b) * (a + b) / (2 * a * b)


@compiled
def _add_missing(
    centres: Array, radii: Array, shear_rate: float, pairs: Pairs, k: int, exact: Array, units: Array,
    resistance: Array, load: Array,
) -> None:  # fmt: skip
    """Add one pair's missing resistance to (6N, 6N), and ΔR U_∞ + ΔF to the loads (N, 6)."""
    block, extra, strain = np.empty((12, 12)), np.empty(12), np.zeros((3, 3))
    row = pairs.rows[k]
    small, large = row[TARGET], row[SOURCE]
    a, b = radii[large], radii[small]
    direction, missing = np.empty(3), exact.copy()
    for x in range(3):
        direction[x] = (centres[small, x] - centres[large, x]) / between(centres, small, large)
    subtract_functions(row[TARGET_DEGREE], row[SOURCE_DEGREE], b / a, pairs.axial[row[AXIAL] :], missing)
    strain[0, 2] = strain[2, 0] = 0.5 * shear_rate
    pair_resistance(missing, direction, a, b, 1.0, block)
    pair_strain_load(missing, direction, a, 1.0, strain, extra)
    spheres = (large, small)
    for k in range(12):
        i, part = spheres[k // 6], k % 6
        for l in range(12):  # noqa: E741
            j, other = spheres[l // 6], l % 6
            resistance[6 * i + part, 6 * j + other] += block[k, l] / (units[i, part] * units[j, other])
            if other == 0:
                extra[k] += block[k, l] * shear_rate * centres[j, 2]
            elif other == 4:
                extra[k] += block[k, l] * 0.5 * shear_rate
        load[i, part] += extra[k] / units[i, part]
