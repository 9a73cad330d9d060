"""What each effect does to the velocities over one outer step, taken apart by the balance of loads.

At given heights the equation that a burst follows is linear. For one cell, with r its own exact resistance and f its
own load in the flow, the rest being what the others add through the fluid,

    r(h) U = f(h) + F_weight + F_repulsion + F_bonds + (k − C U) ,

so r⁻¹ times each load is a velocity of its own, and these add up to U: those of shear, gravity, repulsion and bonds are
what the cell would do alone, and the last one is the coupling's. Loads are means over the outer step, the heights its
mean heights, C and k what the coupling was. The wall, which is no load, is told by leaving it out.
"""

import math
from collections.abc import Iterator

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array, Indices
from mpad_core.physics.coupling import Coupling, contact_range, joined, lone_cell
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import State
from mpad_core.running import assembly

LOADS = ("shear", "gravity", "repulsion", "bonds")  # what acts on a cell alone
_LOOKS = 64  # places of a step's way at which repulsion is looked at


@frozen(kw_only=True, eq=False)
class OuterStep:
    """One outer step, and the coupling that it was taken with."""

    problem: Problem
    before: State
    after: State
    coupling: Coupling

    @property
    def lasted(self) -> float:
        """Its time (s)."""
        return self.after.time - self.before.time

    def gaps(self) -> Array:
        """Give the mean gap (µm) of every cell to the wall."""
        way = self.after.way
        gaps: Array = self.after.wall_gaps if way is None else way.wall_gaps.mean(axis=0)
        return gaps

    def repulsion(self) -> Array:
        """Give the mean repulsion (N, 6) on every cell.

        A cell without bonds has no other load than this and its weight, so there it is the rest, exactly.
        """
        problem, rest = self.problem, self.after.mean_loads - self.problem.external
        if problem.contact is None:
            return np.zeros_like(rest)
        bound = (self.before.bond_counts() + self.after.bond_counts()) > 0
        bound[self.after.events["cell"]] = True
        bound[self.after.events["partner"][self.after.events["partner"] >= 0]] = True
        return np.where(bound[:, None], self._repulsion_on_the_way(), rest) if bound.any() else rest

    def _repulsion_on_the_way(self) -> Array:
        problem, way = self.problem, self.after.way
        assert way is not None
        some = slice(None, None, max(len(way.times) // _LOOKS, 1))
        centres, gaps = way.centres[some], way.wall_gaps[some]
        loads = np.zeros((len(problem.radii), 6))
        loads[:, 2] = _force(problem, gaps - problem.roughness - problem.wall_roughness).mean(axis=0)
        for i, j in assembly.near_pairs(problem, self.after.centres, contact_range(problem)):
            between = centres[:, i] - centres[:, j]
            distance = np.linalg.norm(between, axis=1)
            tips = problem.radii[[i, j]].sum() + problem.roughness[[i, j]].sum()
            push = (_force(problem, distance - tips)[:, None] * between / distance[:, None]).mean(axis=0)
            loads[i, :3] += push
            loads[j, :3] -= push
        return loads

    def velocities(self) -> dict[str, Array]:
        """Give velocities (N, 6), zero for held cells: of each effect, the `whole`, and that alone and `unbounded`."""
        found: dict[str, Array] = {}
        for part in self.parts():
            alone, whole = part.alone(), part.whole()
            own = dict(zip(LOADS, alone, strict=True)) | {"coupling": whole - alone.sum(axis=0), "whole": whole}
            own |= {"unbounded": part.unbounded(), "thermal": part.shaken(self.lasted)}
            for name, velocity in own.items():
                found.setdefault(name, np.zeros((len(self.problem.radii), 6)))[part.cells] = velocity
        return found

    def parts(self) -> Iterator["Part"]:
        """Yield every group of free cells with its loads, each on its own."""
        problem, gaps, repulsion = self.problem, self.gaps(), self.repulsion()
        bonds = self.after.mean_loads - problem.external - repulsion
        coupling = joined(self.coupling, self.before.bonds.pairs())
        for group, matrix in zip(coupling.groups, coupling.matrices, strict=True):
            lone = [_lone(problem, float(problem.radii[cell]), float(gaps[cell])) for cell in group]
            ambient = np.array([load for _, load in lone])
            yield Part(
                problem=problem, cells=group, heights=gaps[group] + problem.radii[group], coupling=matrix,
                lone=np.array([resistance for resistance, _ in lone]), added=coupling.loads[group],
                loads=np.array([ambient, *(x[group] for x in (problem.external, repulsion, bonds))]),
            )  # fmt: skip


def _force(problem: Problem, tip_gaps: Array) -> Array:
    """Give the repulsion (pN) at tip gaps (µm), continued by its tangent and by nothing as in the burst."""
    assert problem.contact is not None
    low, high = problem.contact.gaps()
    step = 1e-3 * (high - low)
    first, second = problem.contact.force(np.array([low, low + step]))
    inside = problem.contact.force(np.clip(tip_gaps, low, high))
    below: Array = first + (second - first) / step * (tip_gaps - low)
    return np.where(tip_gaps > high, 0.0, np.where(tip_gaps < low, below, inside))


def _lone(problem: Problem, radius: float, gap: float) -> tuple[Array, Array]:
    return lone_cell(problem.setting, radius, gap + radius, gap)


@frozen(kw_only=True, eq=False)
class Part:
    """A group of n free cells, and the loads on it."""

    problem: Problem
    cells: Indices
    heights: Array  # (n,) µm
    coupling: Array  # (6n, 6n)
    added: Array  # (n, 6) the coupling's load
    lone: Array  # (n, 6, 6) each cell's own resistance
    loads: Array  # (4, n, 6) as `LOADS`

    def _resistance(self) -> Array:
        total = self.coupling.copy()
        for k, own in enumerate(self.lone):
            total[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] += own
        return total

    def alone(self) -> Array:
        """Give the velocities (4, n, 6) that each load would have without the other cells."""
        return np.asarray(np.linalg.solve(self.lone, self.loads[..., None])[..., 0])

    def whole(self) -> Array:
        """Give the velocities (n, 6) under all loads."""
        right = self.loads.sum(axis=0) + self.added
        return np.asarray(np.linalg.solve(self._resistance(), right.ravel()).reshape(-1, 6))

    def unbounded(self) -> Array:
        """Give the velocities (n, 6) that each cell would have without the others and without the wall (Stokes)."""
        setting, radii = self.problem.setting, self.problem.radii[self.cells, None]
        velocity: Array = self.loads[1:].sum(axis=0) / (6 * math.pi * setting.viscosity * radii)
        velocity[:, 3:] *= 0.75 / radii**2
        velocity[:, 0] += setting.shear_rate * self.heights
        velocity[:, 4] += 0.5 * setting.shear_rate
        return velocity

    def shaken(self, lasted: float) -> Array:
        """Give the root mean square (n, 6) of the velocities that heat alone has over a time (s)."""
        mobility = np.diagonal(np.linalg.inv(self.lone), axis1=1, axis2=2)
        return np.asarray(np.sqrt(2 * self.problem.thermal_energy * mobility / lasted))
