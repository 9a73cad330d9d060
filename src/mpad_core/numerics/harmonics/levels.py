"""A configuration at given degrees: the blocks, the corrections, and the balance of loads that they need."""

import math
from typing import NamedTuple

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.harmonics.degrees import Degrees
from mpad_core.numerics.harmonics.factors import Blocks, factored
from mpad_core.numerics.harmonics.far import Far, no_far
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
from mpad_core.numerics.pair_functions import exact_functions, pair_resistance, pair_strain_load
from mpad_core.numerics.wall_functions import wall_resistance, wall_shear_load


class Flow(NamedTuple):
    """The ambient flow (rate z, 0, 0), in the parts that do different things to spheres."""

    rate: float  # the shear rate: velocity by height, and twice the rotation
    strain: float  # twice the rate of strain: the shear rate, or 0 to leave out what strain does


@frozen(kw_only=True, eq=False)
class Scene:
    """A configuration and a flow, at unit viscosity."""

    centres: Array
    radii: Array
    gaps: Array  # to the wall
    flow: Flow
    wall: bool
    least_gap: float = 0.0  # (a+b)/(2ab) between two spheres, to which closer ones are put for lubrication


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
def _ambient_traces(at: Places, heights: Array, radii: Array, units: Array, flow: Flow) -> Array:
    """Give the traces of the shear flow on all spheres, flat."""
    out = np.zeros(at.own[-1])
    for i in range(len(radii)):
        own, where = out[at.own[i] : at.own[i + 1]], spots(at.degrees[i])
        own[where[0]] = flow.rate * heights[i] * units[i, 0]
        own[where[4]] = 0.5 * flow.rate * units[i, 4]
        # the strain rate is (e_x e_z + e_z e_x) shear/2
        own[W * places(at.degrees[i]) + place(2, 1)] = strain_unit(radii[i]) * flow.strain * math.sqrt(0.5)
    return out


@compiled
def _held(height: float, gap: float, radius: float, flow: Flow, resistance: Array, out: Array) -> None:
    """Write the exact load (6,) of the flow on a lone sphere held at the wall, with as much of strain as it has."""
    if flow.strain == flow.rate:
        wall_shear_load(height, gap, radius, 1.0, flow.rate, out)
        return
    for k in range(6):
        out[k] = resistance[k, 0] * flow.rate * height + resistance[k, 4] * 0.5 * flow.rate


@compiled
def _alone(
    at: Places, centres: Array, radii: Array, gaps: Array, flow: Flow, inverses: Array, wall: bool, exact: bool
) -> tuple[Array, Array, Array, Array]:
    """Give traces of the flow, resistances (N, 6, 6) of spheres alone, exact less truncated loads (N, 6), and units.

    In unbounded fluid, harmonics have the lone sphere exactly. At the wall, not `exact` leaves theirs as it is.
    """
    n, units = len(radii), rigid_units(radii)
    ambient = _ambient_traces(at, centres[:, 2], radii, units, flow)
    resistance, load = np.zeros((n, 6, 6)), np.zeros((n, 6))
    start = 0
    for i in range(n):
        if wall:
            rigid_resistance(at.degrees[i], inverses[start:], resistance[i])
            start += inverse_size(at.degrees[i])
        else:
            for k in range(6):
                resistance[i, k, k] = 1.0
    if wall and exact:
        answer, held = np.empty_like(ambient), np.empty(6)
        apply_inverse(at.degrees, at.own, inverses, ambient, answer)  # what the flow does to held spheres
        rigid_parts(at, answer, load)
        for i in range(n):
            block = resistance[i]
            wall_resistance(centres[i, 2], gaps[i], radii[i], 1.0, block)
            _held(centres[i, 2], gaps[i], radii[i], flow, block, held)
            for k in range(6):
                load[i, k] = held[k] / units[i, k] - load[i, k]
                for l in range(6):  # noqa: E741
                    block[k, l] /= units[i, k] * units[i, l]
    return ambient, resistance, load, units


@frozen(kw_only=True, eq=False)
class Level:
    """A system to solve, the traces of the flow, and the corrections' loads, all in the units of `layout`."""

    scene: Scene
    system: System
    blocks: Blocks  # of the resistance of lone spheres and near pairs, with every correction
    ambient: Array  # (n,)
    load: Array  # (N, 6)
    units: Array  # (N, 6)

    @classmethod
    def of(cls, scene: Scene, degrees: Degrees, lubrication: bool, far: Far | None = None) -> "Level":
        """Form all blocks, and the corrections of spheres alone and of near pairs, if wanted.

        Parameters
        ----------
        scene, degrees
            The spheres, the degrees, and the pairs that are treated by them.
        lubrication
            Whether to add what isolated near pairs and lone spheres at the wall lack.
        far
            The pairs that are not among those of `degrees`.

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
        ambient, alone, load, units = _alone(
            at, scene.centres, scene.radii, scene.gaps, scene.flow, inverses, scene.wall, lubrication
        )
        chosen = np.flatnonzero(degrees.near) if lubrication else np.zeros(0, np.intp)
        missing = _missing(scene, pairs, chosen, units, load)
        blocks = Blocks(alone, degrees.who[chosen], missing)
        beyond = no_far() if far is None else far
        system = System(at, pairs, beyond, scene.wall, operators, inverses, factored(blocks))
        return cls(scene=scene, system=system, blocks=blocks, ambient=ambient, load=load, units=units)


def _missing(scene: Scene, pairs: Pairs, chosen: Indices, units: Array, load: Array) -> Array:
    """Give (K, 12, 12), what isolated near pairs have exactly and truncated harmonics lack, in the units of `layout`.

    F_lub = -ΔR (U - U_∞) + ΔF, ΔR the exact resistance of the isolated pair less that of the same harmonics, ΔF the
    same difference of loads in the ambient strain (Durlofsky, Brady and Bossis, J. Fluid Mech. 180 (1987) 21; Cichocki,
    Jones, Kutteh and Wajnryb, J. Chem. Phys. 112 (2000) 2548). Harmonics are a Galerkin projection, so ΔR is never
    negative.

    Parameters
    ----------
    scene, pairs
        The spheres and their blocks.
    chosen : (K,)
        The near pairs among the rows of `pairs`.
    units, load : (N, 6)
        Of all spheres; to `load`, ΔR U_∞ + ΔF is added. Rows of ΔR: target, then source.
    """
    ratios, gaps = _gaps(scene.centres, scene.radii, pairs.rows[chosen])
    exact = exact_functions(ratios, np.maximum(gaps, scene.least_gap))
    out = np.empty((len(chosen), 12, 12))
    _add_missing(scene.centres, scene.radii, scene.flow, pairs, chosen, exact, units, out, load)
    return out


@compiled
def _gaps(centres: Array, radii: Array, rows: Indices) -> tuple[Array, Array]:
    """Give the ratios of radii and the gaps (a+b)/(2ab) of pairs."""
    ratios, gaps = np.empty(len(rows)), np.empty(len(rows))
    for k in range(len(rows)):
        i, j = rows[k, TARGET], rows[k, SOURCE]
        a, b = radii[j], radii[i]
        ratios[k] = b / a
        gaps[k] = (between(centres, i, j) - a - b) * (a + b) / (2 * a * b)
    return ratios, gaps


@compiled
def _add_missing(
    centres: Array, radii: Array, flow: Flow, pairs: Pairs, chosen: Indices, exact: Array, units: Array,
    out: Array, load: Array,
) -> None:  # fmt: skip
    """Write the missing resistances (K, 12, 12) of pairs; add ΔR U_∞ + ΔF to the loads (N, 6)."""
    block, extra, strain = np.empty((12, 12)), np.empty(12), np.zeros((3, 3))
    direction = np.empty(3)
    strain[0, 2] = strain[2, 0] = 0.5 * flow.strain
    for n in range(len(chosen)):
        row = pairs.rows[chosen[n]]
        small, large = row[TARGET], row[SOURCE]
        a, b, distance = radii[large], radii[small], between(centres, small, large)
        for x in range(3):
            direction[x] = (centres[small, x] - centres[large, x]) / distance
        missing = exact[n]
        subtract_functions(row[TARGET_DEGREE], row[SOURCE_DEGREE], b / a, pairs.axial[row[AXIAL] :], missing)
        pair_resistance(missing, direction, a, b, 1.0, block)
        pair_strain_load(missing, direction, a, 1.0, strain, extra)
        spheres = (large, small)
        for k in range(12):
            i, part, to = spheres[k // 6], k % 6, (k + 6) % 12
            for l in range(12):  # noqa: E741
                j, other = spheres[l // 6], l % 6
                out[n, to, (l + 6) % 12] = block[k, l] / (units[i, part] * units[j, other])
                if other == 0:
                    extra[k] += block[k, l] * flow.rate * centres[j, 2]
                elif other == 4:
                    extra[k] += block[k, l] * 0.5 * flow.rate
            load[i, part] += extra[k] / units[i, part]
