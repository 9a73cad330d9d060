"""From a problem to the data of the burst: laws tabulated, molecules placed; made once a run."""

from typing import Any, NamedTuple

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array, Flags, Indices
from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.interfaces.values import BOND_EVENT
from mpad_core.numerics.compiled import absent
from mpad_core.numerics.streams import key_of
from mpad_core.numerics.tables import Tables, no_tables, tabulate, together
from mpad_core.physics.asking import blamed
from mpad_core.physics.coupling import NOT_FELT, Coupling
from mpad_core.physics.molecules import identity_of, place_sites
from mpad_core.physics.problem import BondSpecies, Problem
from mpad_core.physics.state import BondList, State
from mpad_core.physics.wall_density import Densities
from mpad_core.running.layout import (
    Adhesion,
    Bench,
    Binding,
    Bodies,
    Bonds,
    Candidates,
    Clocks,
    Contacts,
    Groups,
    Molecules,
    Motion,
    Neighbours,
    Progress,
    Species,
    System,
    Thermal,
    Trail,
)
from mpad_core.running.moving import refresh_turns
from mpad_core.running.places import MOST_LIGANDS, SQUARE
from mpad_core.running.reacting import list_bridges
from mpad_core.running.shaking import TICKS

_MOST_NOTED = 20_000  # places of cells on the way of one burst
_FORCE_ERROR = 1e-6  # relative, of the tabulated repulsion


@frozen(kw_only=True, eq=False)
class Fixed:
    """What stays the same in all bursts of a run."""

    bodies: Bodies
    molecules: Molecules
    species: Species
    thermal: Thermal  # may be absent
    contact_law: Tables
    contact_reach: float  # µm; minus infinity without a law
    key: np.uint64


def _species(problem: Problem) -> Species:
    """Tabulate every species' law; with none, tables of length zero, and the modules that make them stay unloaded."""
    if not problem.species:
        empty = np.zeros(0)
        none = np.zeros(0, np.int64)
        return Species(
            no_tables(3), np.zeros(1, np.int64), none, none, empty, empty, empty, np.zeros(0, np.uint8), empty,
            no_tables(1), none,
        )  # fmt: skip
    from mpad_core.physics.reactions import BondLaw, encounter_table

    for species in problem.species:
        _check_crowding(species)
    laws = [BondLaw(species=species) for species in problem.species]
    # in the reading "overlap" a bond that would push if it stood upright is born unstressed, hence tilted
    tilted = [s.reach == "overlap" and s.compression == "linear" for s in problem.species]
    order = [k for k, s in enumerate(problem.species) if s.encounter is not None]
    most = max(law.states() for law in laws)
    exchanges = most if most > 1 else 0
    tables = [law.tables(exchanges) for law in laws]
    return Species(
        tables=together([table for own in tables for table in own], 3 + exchanges),
        first=np.cumsum([0, *(len(own) for own in tables)]),
        site_kind=np.array([s.site_kind for s in problem.species], np.int64),
        partner_kind=np.array([s.partner_kind for s in problem.species], np.int64),
        reach=np.array([law.reach() for law in laws]),
        slack_below=np.array([s.rest_length if s.compression == "slack" else -1.0 for s in problem.species]),
        least_length=np.array([s.rest_length * tilt for s, tilt in zip(problem.species, tilted, strict=True)]),
        pairwise=np.array([s.reach == "pairs" or s.partner_kind >= 0 for s in problem.species], np.uint8),
        ligand_density=np.array([s.surface.densest() for s in problem.species]),
        encounters=together([encounter_table(s.encounter) for s in problem.species if s.encounter is not None], 1),
        encounter=np.array([-1 if s.encounter is None else order.index(k) for k, s in enumerate(problem.species)]),
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
    owner = np.array([identity_of(n) for n in problem.names]).view(np.int64)
    kT = problem.thermal_energy
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
        molecules=Molecules(sites.arm, sites.first, sites.kind, owner),
        species=_species(problem),
        thermal=Thermal(kT, owner) if kT > 0 else absent(Thermal),
        contact_law=law,
        contact_reach=reach,
        key=key_of(problem.seed),
    )


def pair_gaps(problem: Problem, pairs: Indices, centres: Array) -> Array:
    """Give the gaps (P,) between the smooth spheres of pairs (P, 2), in µm."""
    i, j = pairs[:, 0], pairs[:, 1]
    gaps: Array = np.linalg.norm(centres[i] - centres[j], axis=1) - problem.radii[i] - problem.radii[j]
    return gaps


def near_pairs(problem: Problem, centres: Array, within: float) -> Indices:
    """List the pairs of cells, not both held, whose smooth gap is below `within` (µm): (P, 2), ascending."""
    if len(problem.radii) == 1 or within == -np.inf:
        return np.zeros((0, 2), np.int64)
    i, j = np.triu_indices(len(problem.radii), 1)
    pairs = np.stack([i, j], axis=1).astype(np.int64)
    chosen = (pair_gaps(problem, pairs, centres) < within) & ~(problem.held[i] & problem.held[j])
    return pairs[chosen]


def system(problem: Problem, fixed: Fixed, state: State, coupling: Coupling, reach: float, around: Densities) -> System:
    """Put the frozen coupling, the pairs in contact and the wall's density beside what is fixed.

    `reach` is what `near_pairs` is asked with, `around` the density around the cells. What the problem leaves out is
    absent.
    """
    cells = len(problem.radii)
    place = np.full(cells, -1, np.int64)
    of_group = np.full(cells, len(coupling.groups), np.int64)
    for g, group in enumerate(coupling.groups):
        place[group] = np.arange(len(group))
        of_group[group] = g
    pairs = near_pairs(problem, state.centres, reach)
    # cells that will not meet before the burst is over may have been put into different groups
    of = of_group[pairs]
    pairs = pairs[(of[:, 0] == of[:, 1]) | (of == len(coupling.groups)).any(axis=1)]
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
    return System(
        bodies=fixed.bodies,
        groups=groups,
        contacts=contacts if problem.contact is not None else absent(Contacts),
        thermal=fixed.thermal,
        binding=_binding(problem, fixed, pairs, state, around) if problem.species else absent(Binding),
    )


def _binding(problem: Problem, fixed: Fixed, pairs: Indices, state: State, around: Densities) -> Binding:
    """Put what may bind to what together; `pairs` (P, 2) are those of cells that may meet during the burst."""
    molecules, species, turns = fixed.molecules, fixed.species, np.empty((len(problem.radii), 3, 3))
    refresh_turns(motion_of(state), turns)  # held cells stay on the bench as they are at first
    bridging = (species.partner_kind >= 0).any() & (np.diff(molecules.first) > 0)[pairs].all(axis=1)
    neighbours = neighbours_of(problem, pairs[bridging])
    factor, levers, ends = np.empty(len(problem.species)), np.empty((2, 3, 6)), np.empty((3, 3))
    bench = Bench(factor, levers, ends, state.centres.copy(), turns)
    shell = problem.radii + problem.roughness
    return Binding(shell, problem.wall_roughness, molecules, species, neighbours, around, bench)


def neighbours_in(system: System) -> Neighbours | None:
    """Give the pairs of cells that may bind to each other; None without any bonds."""
    return system.binding.neighbours if isinstance(system.binding, Binding) else None


def neighbours_of(problem: Problem, pairs: Indices) -> Neighbours:
    """Sort pairs of cells by their keepers: the first of two, or the one that is not held."""
    keeper = np.where(problem.held[pairs[:, 0]], pairs[:, 1], pairs[:, 0])
    order = np.argsort(keeper, kind="stable")
    partner = pairs.sum(axis=1) - keeper
    first = np.searchsorted(keeper[order], np.arange(len(problem.radii) + 1))
    return Neighbours(first, np.ascontiguousarray(partner[order]))


_BOND_FIELDS = ("site", "species", "state", "partner", "ligand", "anchor")
_FEW = 512  # candidates of a cell, to begin with
_EVENTS = 16_384  # of a burst before they are taken out of its table


class Room(NamedTuple):
    """What a burst fills, beside the motion: with so much room that it seldom has to ask for more."""

    bonds: Bonds
    bound: Flags
    candidates: Candidates
    events: Any


def room_for(fixed: Fixed, bonds: BondList, cells: int, neighbours: Neighbours | None = None, times: int = 1) -> Room:
    """Lay the living bonds out, with room for more; `times` is by how much there is more of it than at first.

    The table of events never grows: a burst goes on with an empty one.
    """
    counts = np.bincount(bonds.cell, minlength=cells)
    first = np.concatenate([[0], np.cumsum(2 * counts + 64 * times)])
    laid = _no_bonds(first, counts)
    places = first[bonds.cell] + np.arange(len(bonds)) - (np.cumsum(counts) - counts)[bonds.cell]
    for name in _BOND_FIELDS:
        getattr(laid, name)[places] = getattr(bonds, name)
    for cell in np.flatnonzero(np.bincount(bonds.cell[bonds.partner >= 0], minlength=cells)):
        list_bridges(int(cell), laid)
    bound = np.zeros(len(fixed.molecules.kind), np.uint8)
    bound[bonds.site] = 1
    bound[bonds.ligand[bonds.partner >= 0]] = 1
    events: Any = np.empty(_EVENTS, BOND_EVENT)  # not written to before it is filled: that would take a while
    return Room(laid, bound, _candidates(fixed, neighbours, times), events)


def adhesion_of(problem: Problem, room: Room, clocks: Clocks, ahead: Array) -> Adhesion:
    """Put what a burst may change about bonds together; absent where there are none. `ahead` as in `Adhesion`."""
    if not problem.species:
        return absent(Adhesion)
    return Adhesion(room.bonds, room.bound, room.candidates, clocks, ahead, room.events)


def _no_bonds(first: Indices, counts: Indices) -> Bonds:
    room = int(first[-1])
    site, species, state, partner, ligand, bridge = np.zeros((6, room), np.int64)
    anchor = np.zeros((room, 3))
    return Bonds(first, counts, site, species, state, partner, ligand, anchor, np.zeros_like(counts), bridge)


def _candidates(fixed: Fixed, neighbours: Neighbours | None, times: int) -> Candidates:
    """Make room for lists, none of which has been made."""
    sites = np.diff(fixed.molecules.first)
    partner = np.zeros(0, np.int64) if neighbours is None else neighbours.partner
    keeper = (
        np.zeros(0, np.int64) if neighbours is None else np.repeat(np.arange(len(sites)), np.diff(neighbours.first))
    )
    facing = np.concatenate([[0], np.cumsum(sites[np.stack([keeper, partner], axis=1).ravel()])])
    pairs = len(partner)
    several = 8 if fixed.species.pairwise.any() else 1
    first = np.concatenate([[0], np.cumsum(several * times * np.minimum(sites, _FEW))])
    cells, room = len(sites), int(first[-1])
    site, species, ligand, other = (np.empty(room, np.int64) for _ in range(4))
    return Candidates(
        first, np.zeros(cells, np.int64), site, species, ligand, other, np.zeros(room), np.zeros(room),
        fixed.molecules.first,
        np.full(cells, -1), np.empty(int(sites.sum()), np.int64), np.zeros((cells, 3)), np.zeros((cells, 3)),
        np.zeros((cells, 3, 3)), np.zeros((cells, 3, 3)), facing, np.full(2 * pairs, -1),
        np.empty(int(facing[-1]), np.int64), np.zeros((pairs, 3)), np.zeros((pairs, 3, 9)),
    )  # fmt: skip


def bond_list(bonds: Bonds) -> BondList:
    """Take the living bonds out of their room."""
    cell = np.repeat(np.arange(len(bonds.number)), bonds.number)
    places = bonds.first[cell] + np.arange(len(cell)) - (np.cumsum(bonds.number) - bonds.number)[cell]
    return BondList(cell=cell, **{name: getattr(bonds, name)[places] for name in _BOND_FIELDS})


def clocks_of(fixed: Fixed, state: State) -> Clocks:
    """Copy the clocks of events."""
    return Clocks(state.clocks.copy(), state.draws.astype(np.int64), fixed.molecules.owner)


def progress_of(groups: int, cells: int) -> Progress:
    """Give the progress of a burst that has not begun."""
    one = [np.zeros(1, np.int64) for _ in range(3)]
    slots = groups + cells
    return Progress(one[0], np.zeros(slots, np.int64), np.full(slots, TICKS, np.int64), one[1], one[2])


def trail_for(cells: int, most: int) -> Trail:
    """Make room for the way of a burst of at most so many sub-steps."""
    every = -(-most * cells // _MOST_NOTED)
    room = most // every + 1
    vectors = [np.empty((room, cells, n)) for n in (3, 4, 3)]
    return Trail(every, np.zeros(room, np.int64), vectors[0], np.empty((room, cells)), vectors[1], vectors[2])


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
