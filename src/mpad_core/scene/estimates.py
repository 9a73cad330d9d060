"""Rough sizes of what moves the cells of a scene, by which effects are judged; right to a factor of two, no more."""

import math
from functools import cached_property

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.physics.problem import Problem
from mpad_core.scene.groups import HELD_FORCE, HELD_TORQUE, SLIDING, squeeze
from mpad_core.scene.spec import Scene
from mpad_core.units import thermal_energy

APPROACH = 10.0  # radii that a cell is carried while it comes near another: so far does it feel the other's flow
_PAIRS = 10_000_000  # of cells, that are looked at
_BLAKE = 12.0  # h h'/r²: the share of a force's flow that a wall leaves far along it (Blake 1971)
_TAIL = 2 * math.log(1e9)  # on-rates of longer bonds count down to 1e-9 of the largest


@frozen(kw_only=True, eq=False)
class Nearest:
    """Two cells, as near as they may come to each other."""

    names: tuple[str, str]
    gap: float  # µm between the smooth spheres
    felt: float  # what one does to the other's velocity, relative


@frozen(kw_only=True, eq=False, slots=False)  # what is worked out is kept
class Estimates:
    """Sizes for one cell, the one that a passage follows or else the lowest free one, and for the nearest pair."""

    scene: Scene
    problem: Problem

    @cached_property
    def cell(self) -> int:
        """Its number."""
        if self.scene.passage:
            return self.problem.names.index(self.scene.passage.cell)
        staying = self.problem.held | (self.problem.alone_for > 0)  # those that roll at the start are held by bonds
        return int(np.argmin(np.where(self.problem.held if staying.all() else staying, np.inf, self.gaps)))

    @property
    def name(self) -> str:
        """Its name."""
        return self.problem.names[self.cell]

    @property
    def longest(self) -> float:
        """The run's time (s)."""
        return self.scene.stop.time

    @property
    def shear(self) -> float:
        """The flow's rate (1/s)."""
        return abs(self.problem.setting.shear_rate)

    @cached_property
    def gaps(self) -> Array:
        """All smooth gaps (µm) to z = 0."""
        gaps: Array = self.problem.start[:, 2] - self.problem.radii
        return gaps

    @cached_property
    def tip_gaps(self) -> Array:
        """All gaps (µm) between the tips of the bumps of cells and wall; infinite without a wall."""
        tips: Array = self.gaps - self.problem.roughness - self.problem.wall_roughness
        return tips if self.scene.wall else np.full_like(tips, np.inf)

    @cached_property
    def drags(self) -> Array:
        """Drag (pN s/µm) of each cell normal to the wall, at its height."""
        radii, setting = self.problem.radii, self.problem.setting
        pairs = zip(self.gaps, radii, strict=True)
        more = [squeeze(max(gap, 1e-6 * a), a) if setting.wall else 1.0 for gap, a in pairs]
        return np.asarray(6 * math.pi * setting.viscosity * radii * np.array(more))

    @cached_property
    def approach(self) -> float:
        """Time (s) in which the flow carries the cell over ten radii, at most the run's."""
        return min(self.longest, APPROACH / (SLIDING * self.shear)) if self.shear > 0 else self.longest

    def spread(self, time: float) -> float:
        """Thermal spread (µm, one standard deviation) in the cell's height over a time (s)."""
        kT = thermal_energy(self.scene.fluid.temperature)
        return math.sqrt(2 * kT * time / float(self.drags[self.cell]))

    def weights(self, acceleration: float | None = None) -> Array:
        """Weights (pN) along z less buoyancy, as the scene has them or for an acceleration (µm/s²)."""
        if acceleration is None:
            return np.asarray(self.problem.external[:, 2])
        kinds = [self.scene.kinds[kind] for kind in self.problem.kinds]
        excess = np.array([kind.density - self.scene.fluid.density for kind in kinds])
        return np.asarray(-4 / 3 * math.pi * self.problem.radii**3 * excess * acceleration)

    def settled(self, weights: Array) -> Array:
        """How far (µm) weights bring cells down in the run; below zero for those that rise."""
        return np.asarray(-weights / self.drags * self.longest)

    @cached_property
    def range(self) -> tuple[float, str]:
        """The range of heights (µm) that matters for the cell, and what it is."""
        if self.problem.species and self.scene.wall:
            species = max(self.problem.species, key=lambda s: s.rest_length)
            return species.rest_length, f"the length of bond {species.name}"
        if self.problem.setting.wall:
            return float(self.gaps[self.cell]), "its gap to the wall"
        gap = self.nearest.gap if self.nearest else np.inf
        radius = float(self.problem.radii[self.cell])
        return (gap, "the gap between cells") if 0 < gap < np.inf else (radius, "a radius")

    @cached_property
    def reaches(self) -> Array:
        """How near (µm) to the wall each cell's tips may come: settled, shaken, and moved by others; a lower bound."""
        kT = self.problem.thermal_energy
        shaken = 3 * np.sqrt(2 * kT * self.longest / self.drags)
        moved = 0.1 * self.problem.radii if self.problem.coupled and len(self.drags) > 1 else 0.0
        return np.asarray(self.tip_gaps - np.maximum(self.settled(self.weights()), 0.0) - shaken - moved)

    @cached_property
    def bond_range(self) -> float:
        """The longest bond to the wall (µm) that forms at a rate worth the name; 0 without."""
        lengths = []
        for species in self.problem.species:
            if species.partner_kind < 0:
                x = species.rest_length
                pull = np.diff(species.model.tension(np.array([1.01, 1.02]) * x))[0] / (0.01 * x)
                lengths.append(x + math.sqrt(_TAIL * species.kT / max(float(pull), 1e-300)))
        return max(lengths, default=0.0)

    @cached_property
    def nearest(self) -> Nearest | None:
        """The pair of which one may be felt most by the other; None if there is none."""
        n = len(self.problem.radii)
        if n < 2:
            return None
        rows = [(self._felt_from(i), i) for i in range(min(n, max(_PAIRS // n, 1)))]
        (felt, gap, j), i = max(rows, key=lambda row: row[0][0])
        first, second = sorted((i, j))
        return Nearest(names=(self.problem.names[first], self.problem.names[second]), gap=gap, felt=felt)

    def _felt_from(self, i: int) -> tuple[float, float, int]:
        """Give how much cell i is felt at most by another, relative to that one's speed; their gap; and whose."""
        problem, at = self.problem, self.problem.start
        heights, r = np.abs(at[:, 2]), self._distances(i)
        left = np.minimum(1.0, _BLAKE * heights[i] * heights / r**2) if problem.setting.wall else 1.0
        a, viscosity = float(problem.radii[i]), problem.setting.viscosity
        stress = viscosity * self.shear
        pull = float(np.linalg.norm(problem.external[i, :3]))
        if self._may_stay[i]:
            pull += 6 * math.pi * HELD_FORCE * stress * a * heights[i] + 4 * math.pi * HELD_TORQUE * stress * a**2
        pushed = 2 * pull / (8 * math.pi * viscosity * r) + 1.25 * self.shear * a**3 / r**2
        speed = np.maximum(self.shear * heights, np.abs(problem.external[:, 2]) / self.drags)
        with np.errstate(invalid="ignore", divide="ignore"):
            felt = np.where(speed > 0, pushed / speed, 1.5 * a / r) * left  # without either: how motions are correlated
        felt[problem.held] = 0.0
        felt[i] = 0.0
        j = int(np.argmax(felt))
        return float(felt[j]), float(max(r[j] - a - problem.radii[j], 0.0)), j

    def _distances(self, i: int) -> Array:
        """Give how near (µm) cell i may come to the others: as the flow carries one past the other, and they fall."""
        problem, at = self.problem, self.problem.start
        apart = np.abs(at - at[i])
        fall = np.abs(problem.external[:, 2]) / (6 * math.pi * problem.setting.viscosity * problem.radii)
        stays = self._may_stay | self._may_stay[i]
        lag = np.where(stays, np.maximum(at[:, 2], at[i, 2]), apart[:, 2] + 0.1 * problem.radii)
        apart[:, 0] = np.maximum(apart[:, 0] - self.shear * lag * self.longest, 0.0)
        apart[:, 2] = np.maximum(apart[:, 2] - (fall + fall[i]) * self.longest, 0.0)
        near: Array = np.maximum(np.linalg.norm(apart, axis=1), problem.radii + problem.radii[i])
        return near

    @cached_property
    def _may_stay(self) -> Array:
        """Which cells are held, or may be by bonds."""
        return np.asarray(self.problem.held | (self.problem.site_densities > 0).any(axis=1))
