"""The wall's site density near each cell, sampled on a lattice, for compiled code.

The lattice is fixed in space: sample (i, j) stands for the square from (i s, j s) to ((i + 1) s, (j + 1) s), and has
the density at its middle. Each cell has a window of it that holds all that its molecules may reach, and more. Which
window that is depends on where the cell is and on nothing else, so a resumed run has the windows of one that was never
interrupted; and a sample does not depend on the window. Surfaces that say how finely they vary (`Resolving`) are
sampled at that spacing; a sharp edge is off by half a square's diagonal at most.
"""

from typing import NamedTuple

import numpy as np
from attrs import define, field

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.interfaces.surface import Resolving
from mpad_core.physics.asking import blamed
from mpad_core.physics.problem import BondSpecies, Problem

UNTOLD = 0.05  # µm, spacing for a surface that does not say how finely it varies
AHEAD = 0.9  # µm that a cell can at least move before it leaves its window: twice what one of 5 µm does in a burst
STEP = 0.6  # µm, by which windows move
MOST_SAMPLES = 2000  # on a side: 32 MB for a cell and species


class Densities(NamedTuple):
    """Local density of N cells and K species of bond, by the density that the on-rate is given at; see the module."""

    value: Array  # all windows, one after the other, each row by row
    start: Indices  # (N, K) each window's first value
    first_i: Indices  # (N, K) each window's first sample along x
    first_j: Indices  # (N, K) and along y
    size: Indices  # (N, K) samples on a side; 1: the same everywhere
    spacing: Array  # (K,) µm
    reach: Array  # (N, K) µm, how far to the side of a cell's centre its density may be asked for


@define(kw_only=True, eq=False)
class Rasters:
    """Keeps the windows of all cells, and samples one anew only when its cell has left it.

    It remembers nothing that changes an answer: a new one gives the same.
    """

    problem: Problem
    current: Densities
    _placed: Indices = field()  # (N, K) whether a window has been sampled yet

    def at(self, centres: Array) -> Densities:
        """Give the densities around cells at centres (N, 3), in µm; they hold until this is called again.

        Raises
        ------
        PartError
            If a surface fails, or gives anything but numbers from 0 to its `densest()`, naming it.
        """
        now = self.current
        for k in np.flatnonzero(np.isfinite(now.spacing)):
            species = self.problem.species[k]
            first = _first(centres[:, :2], now.spacing[k], now.size[:, k])
            old = np.stack([now.first_i[:, k], now.first_j[:, k]], axis=1)
            moved = (first != old).any(axis=1) | (self._placed[:, k] == 0)
            for cell in np.flatnonzero(moved & (now.size[:, k] > 1)):
                _sample(now, species, int(cell), int(k), first[cell])
                self._placed[cell, k] = 1
        return now


def rasters(problem: Problem, reach: Array) -> Rasters:
    """Make room for the windows of a problem, and ask its uniform surfaces once.

    Parameters
    ----------
    problem
        The cells and their species of bonds.
    reach : (K,)
        Tip gap (µm) beyond which no bond of a species forms.

    Raises
    ------
    InputError
        If a surface varies too finely to be sampled.
    PartError
        If a surface fails, naming it.
    """
    cells, kinds = len(problem.radii), len(problem.species)
    spacing = np.array([spacing_of(species) for species in problem.species])
    lateral = np.zeros((cells, kinds))
    size = np.ones((cells, kinds), np.int64)
    for k, species in enumerate(problem.species):
        lateral[:, k] = contact_half_width(problem, species, reach[k])
        binding = problem.site_densities[:, species.site_kind] > 0
        if np.isfinite(spacing[k]):
            size[binding, k] = _size(lateral[binding, k], spacing[k])
        _check_size(species, spacing[k], size[:, k])
    start = np.concatenate([[0], np.cumsum(size.ravel() ** 2)])
    none = np.zeros((cells, kinds), np.int64)
    laid = Densities(
        value=np.zeros(start[-1]), start=start[:-1].reshape(cells, kinds), first_i=none.copy(), first_j=none.copy(),
        size=size, spacing=spacing, reach=lateral,
    )  # fmt: skip
    for k, species in enumerate(problem.species):
        if np.isinf(spacing[k]):
            laid.value[laid.start[:, k]] = ratios(species, np.zeros(1), np.zeros(1))[0]
    return Rasters(problem=problem, current=laid, placed=none)


def densities(problem: Problem, reach: Array, centres: Array) -> Densities:
    """Give the densities around cells at centres (N, 3); arguments as `rasters`."""
    return rasters(problem, reach).at(centres)


def spacing_of(species: BondSpecies) -> float:
    """Give the lattice's spacing (µm) for a species' surface; infinite if it is uniform.

    Raises
    ------
    PartError
        If the surface's `resolution()` is no length.
    """
    surface = species.surface
    if not isinstance(surface, Resolving):
        return UNTOLD
    with blamed(f"surface {surface.name!r}"):
        found = float(surface.resolution())
    if not found > 0:
        raise PartError(f"surface {surface.name!r}: resolution() is {found}, not a length")
    return found


def contact_half_width(problem: Problem, species: BondSpecies, reach: float) -> Array:
    """Give how far (N,) to the side of a cell's centre (µm) bonds of a species with a reach (µm) may hold the wall.

    A molecule in reach lies at most `reach` above the wall's tips, and a cell sinks at most until its smooth sphere
    touches the wall. Where the wall's molecules are told apart, the one it binds may be another `reach` to the side.
    """
    shell = problem.radii + problem.roughness
    depth = np.clip(reach + problem.roughness + max(problem.wall_roughness, 0.0), 0.0, shell)
    widest: Array = np.sqrt(depth * (2 * shell - depth)) + (reach if species.reach == "pairs" else 0.0)
    return widest


def ratios(species: BondSpecies, x: Array, y: Array) -> Array:
    """Give the density at places (µm) by the one that the on-rate's table is made for, checked.

    Where the wall's molecules are told apart the table holds for one molecule, so it is by the densest place's.

    Raises
    ------
    PartError
        If the surface fails, or gives anything but numbers from 0 to its `densest()`.
    """
    surface = species.surface
    with blamed(f"surface {surface.name!r}"):
        most = surface.densest()
        density = np.asarray(surface.density(x, y), float)
    if density.shape != np.broadcast_shapes(x.shape, y.shape):
        raise PartError(f"surface {surface.name!r}: densities have shape {density.shape}, not that of the places")
    if not ((density >= 0) & (density <= most * (1 + 1e-9))).all():
        raise PartError(f"surface {surface.name!r}: densities must lie from 0 to its densest(), {most:g}")
    return density / (most if species.reach == "pairs" and most > 0 else species.at_density)


def _check_size(species: BondSpecies, spacing: float, size: Indices) -> None:
    if size.max(initial=1) > MOST_SAMPLES:
        raise InputError(
            f"bond {species.name!r}: surface {species.surface.name!r} varies within {spacing:.3g} um, which takes "
            f"{size.max()} samples on a side around a cell; the most is {MOST_SAMPLES}: make it coarser"
        )


def _step(spacing: float) -> int:
    """Give by how many samples windows move."""
    return max(round(STEP / spacing), 1)


def _size(lateral: Array, spacing: float) -> Indices:
    """Give the samples on a side of windows: a cell anywhere in its step has its reach and `AHEAD` within them."""
    step = _step(spacing)
    half = np.ceil((lateral + AHEAD) / spacing).astype(np.int64) + step - step // 2
    return 2 * half


def _first(places: Array, spacing: float, size: Indices) -> Indices:
    """Give the first samples (N, 2) of the windows of cells at places (N, 2); windows move by steps."""
    step = _step(spacing)
    tile = np.floor(places / spacing).astype(np.int64) // step
    first: Indices = tile * step + step // 2 - size[:, None] // 2
    return first


def _sample(now: Densities, species: BondSpecies, cell: int, kind: int, first: Indices) -> None:
    """Sample one window."""
    size, at = now.size[cell, kind], now.start[cell, kind]
    x, y = ((k + np.arange(size) + 0.5) * now.spacing[kind] for k in first)
    places = np.broadcast_arrays(x[:, None], y[None, :])  # laws need not know how shapes of two arrays combine
    now.value[at : at + size * size] = ratios(species, *(place.ravel() for place in places))
    now.first_i[cell, kind], now.first_j[cell, kind] = first
