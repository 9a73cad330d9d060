"""What is measured on a state: overlap, distance from the partner, capture hazard."""

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.physics.problem import Problem


@frozen(kw_only=True, eq=False)
class Hazards:
    """The rate at which each cell would form its first bond, worked out from the on-rate, probes included.

    Molecules are taken as spread evenly over each cell, so the hazard is a smooth function of the height.
    """

    problem: Problem
    tables: tuple[object, ...]  # a HazardTable for each species

    def at(self, centres: Array) -> Array:
        """Give the hazard (1/s) of every cell at centres (N, 3)."""
        problem = self.problem
        shell = problem.radii + problem.roughness
        total = np.zeros(len(shell))
        for species, table in zip(problem.species, self.tables, strict=True):
            sites = problem.hazard_densities[:, species.site_kind] * (problem.radii / shell) ** 2
            density = species.surface.density(centres[:, 0], centres[:, 1]) / species.at_density
            tip_gap = centres[:, 2] - shell - problem.wall_roughness
            total += table.rate(tip_gap, shell, sites, density)  # type: ignore[attr-defined]
        return total


def hazards(problem: Problem, on_rate: float | None = None) -> Hazards:
    """Make the hazards of a problem; `on_rate` (1/s) replaces that of its species."""
    if not problem.species:
        return Hazards(problem=problem, tables=())
    from mpad_core.physics.reactions import BondLaw, hazard_table

    tables = tuple(hazard_table(BondLaw(species=species), on_rate) for species in problem.species)
    return Hazards(problem=problem, tables=tables)


def dx_of(problem: Problem, centres: Array) -> Array:
    """Give every cell's distance (µm) along the flow from its partner, or from the fixed place that stands for it."""
    partner = problem.partner
    x = centres[:, 0]
    distance: Array = x - np.where(partner >= 0, x[partner], problem.dx_from)
    return distance
