"""From a problem to the data of the burst: laws tabulated, molecules placed; made once a run."""

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.numerics.streams import key_of
from mpad_core.numerics.tables import Tables, no_tables, tabulate, together
from mpad_core.physics.asking import blamed
from mpad_core.physics.coupling import NOT_FELT, Coupling
from mpad_core.physics.molecules import identity_of, place_sites
from mpad_core.physics.problem import BondSpecies, Problem
from mpad_core.physics.state import BondList, State
from mpad_core.running.layout import Bodies, Bonds, Contacts, Groups, Molecules, Motion, Species, System, Thermal
from mpad_core.running.reacting import MOST_LIGANDS, SQUARE

_FORCE_ERROR = 1e-6  # relative, of the tabulated repulsion


@frozen(kw_only=True, eq=False)
class Fixed:
    """What stays the same in all bursts of a run."""

    bodies: Bodies
    molecules: Molecules
    species: Species
    thermal: Thermal
    contact_law: Tables
    contact_reach: float  # µm; minus infinity without a law
    reference_density: Array  # (K,) 1/µm²
    key: np.uint64


def _species(problem: Problem) -> Species:
    """Tabulate every species' law; with none, tables of length zero, and the modules that make them stay unloaded."""
    if not problem.species:
        empty = np.zeros(0)
        return Species(no_tables(3), np.zeros(0, np.int64), empty, empty, np.zeros(0, np.uint8), empty)
    from mpad_core.physics.reactions import BondLaw

    for species in problem.species:
        _check_crowding(species)
    laws = [BondLaw(species=species) for species in problem.species]
    # in the reading "overlap" a bond that would push if it stood upright is born unstressed, hence tilted
    tilted = [s.reach == "overlap" and s.compression == "linear" for s in problem.species]
    return Species(
        tables=together([law.tables() for law in laws], 3),
        site_kind=np.array([s.site_kind for s in problem.species], np.int64),
        reach=np.array([law.reach() for law in laws]),
        least_length=np.array([s.rest_length * tilt for s, tilt in zip(problem.species, tilted, strict=True)]),
        pairwise=np.array([s.reach == "pairs" for s in problem.species], np.uint8),
        ligand_density=np.array([s.surface.densest() for s in problem.species]),
    )


def _check_crowding(species: BondSpecies) -> None:
    """Refuse a density that is none, and one that cannot be laid out molecule by molecule."""
    with blamed(f"surface {species.surface.name!r}"):
        densest = float(species.surface.densest())
    if not (np.isfinite(densest) and densest >= 0):
        raise PartError(f"surface {species.surface.name!r} of bond {species.name!r}: densest() is {densest}")
    if species.reach == "pairs" and densest * SQUARE**2 > MOST_LIGANDS / 1.5:
        most = MOST_LIGANDS / 1.5 / SQUARE**2
        raise InputError(f'bond {species.name!r}: reach "pairs" lays out at most {most:g} sites/um^2, not {densest:g}')


def _contact(problem: Problem) -> tuple[Tables, float]:
    if problem.contact is None:
        return no_tables(1), -np.inf
    who = f"force law {problem.contact.name!r}"
    with blamed(who):
        low, high = problem.contact.gaps()
        if not (np.isfinite([low, high]).all() and low < high):
            raise PartError(f"{who}: gaps() gives {low} and {high}, not a smaller and a larger gap")
        law = tabulate([problem.contact.force], [low, high], error=_FORCE_ERROR, tangents=[0])
    law.coefficients[-1] = 0.0  # nothing beyond the largest gap
    return law, high


def assemble(problem: Problem) -> Fixed:
    """Make the data of a problem that no burst changes."""
    sites = place_sites(problem)
    law, reach = _contact(problem)
    return Fixed(
        bodies=Bodies(
            radius=problem.radii,
            roughness=problem.roughness,
            external=problem.external,
            wall_offset=0.0 if problem.setting.wall else NOT_FELT * float(problem.radii.max()),
            wall_tips=problem.wall_roughness,
            viscosity=problem.setting.viscosity,
            shear_rate=problem.setting.shear_rate,
        ),
        molecules=Molecules(
            sites.arm, sites.first, sites.kind, np.array([identity_of(n) for n in problem.names]).view(np.int64)
        ),
        species=_species(problem),
        thermal=Thermal(np.full(1 if problem.thermal_energy > 0 else 0, problem.thermal_energy)),
        contact_law=law,
        contact_reach=reach,
        reference_density=np.array([s.at_density for s in problem.species]),
        key=key_of(problem.seed),
    )


def local_density(problem: Problem, fixed: Fixed, centres: Array) -> Array:
    """Give the wall's site density under each cell's centre, (N, species), by the one the tables are made for.

    Where the wall's molecules are told apart the tables hold for one molecule, so it is by the densest place's.
    """
    ratio = np.ones((len(centres), len(problem.species)))
    for k, species in enumerate(problem.species):
        most = species.surface.densest()
        reference = most if species.reach == "pairs" and most > 0 else fixed.reference_density[k]
        with blamed(f"surface {species.surface.name!r}"):
            density = np.asarray(species.surface.density(centres[:, 0], centres[:, 1]), float)
        if density.shape != (len(centres),) or not ((density >= 0) & (density <= most * (1 + 1e-9))).all():
            raise PartError(f"surface {species.surface.name!r}: densities must lie from 0 to its densest(), {most:g}")
        ratio[:, k] = density / reference
    return ratio


def pair_gaps(problem: Problem, pairs: Indices, centres: Array) -> Array:
    """Give the gaps (P,) between the smooth spheres of pairs (P, 2), in µm."""
    i, j = pairs[:, 0], pairs[:, 1]
    gaps: Array = np.linalg.norm(centres[i] - centres[j], axis=1) - problem.radii[i] - problem.radii[j]
    return gaps


def near_pairs(problem: Problem, centres: Array, within: float) -> Indices:
    """List the pairs of cells, not both held, whose smooth gap is below `within` (µm): (P, 2), ascending."""
    i, j = np.triu_indices(len(problem.radii), 1)
    pairs = np.stack([i, j], axis=1).astype(np.int64)
    chosen = (pair_gaps(problem, pairs, centres) < within) & ~(problem.held[i] & problem.held[j])
    return pairs[chosen]


def system(problem: Problem, fixed: Fixed, state: State, coupling: Coupling, reach: float) -> System:
    """Put the frozen coupling and the pairs in contact beside what is fixed; `reach` as in `near_pairs`."""
    cells = len(problem.radii)
    place = np.full(cells, -1, np.int64)
    of_group = np.full(cells, len(coupling.groups), np.int64)
    for g, group in enumerate(coupling.groups):
        place[group] = np.arange(len(group))
        of_group[group] = g
    pairs = near_pairs(problem, state.centres, reach)
    owner = of_group[pairs].min(axis=1) if len(pairs) else np.zeros(0, np.int64)
    pairs = pairs[np.argsort(owner, kind="stable")]
    sizes = [len(group) for group in coupling.groups]
    groups = Groups(
        cells=np.concatenate([np.zeros(0, np.int64), *coupling.groups]).astype(np.int64),
        first=np.cumsum([0, *sizes]),
        place=place,
        coupling=np.concatenate([np.zeros(0), *(matrix.ravel() for matrix in coupling.matrices)]),
        coupling_first=np.cumsum([0, *(36 * n * n for n in sizes)]),
        load=coupling.loads,
    )
    first = np.searchsorted(np.sort(owner), np.arange(len(sizes) + 1))
    contacts = Contacts(fixed.contact_law, fixed.contact_reach, np.ascontiguousarray(pairs), first)
    density = local_density(problem, fixed, state.centres)
    return System(fixed.bodies, fixed.molecules, fixed.species, contacts, groups, fixed.thermal, density)


def bond_room(bonds: BondList, room: int) -> Bonds:
    """Lay the living bonds out with room for `room`."""
    n = len(bonds)
    cell, site, species, ligand = np.zeros((4, room), np.int64)
    laid = Bonds(np.array([n]), cell, site, species, ligand, np.zeros((room, 3)))
    for name in ("cell", "site", "species", "ligand", "anchor"):
        getattr(laid, name)[:n] = getattr(bonds, name)
    return laid


def bond_list(bonds: Bonds) -> BondList:
    """Take the living bonds out of their room."""
    n = int(bonds.living[0])
    return BondList(**{k: getattr(bonds, k)[:n].copy() for k in ("cell", "site", "species", "ligand", "anchor")})


def motion_of(state: State) -> Motion:
    """Copy what a burst changes."""
    cells = len(state.wall_gaps)
    return Motion(
        centre=state.centres.copy(),
        gap=state.wall_gaps.copy(),
        orientation=state.orientations.copy(),
        velocity=state.velocities.copy(),
        turn=np.zeros((cells, 3)),
        impulse=np.zeros((cells, 6)),
    )
