"""Formation, rupture and change of bonds: their rates, the choice of an event, and the event itself; compiled."""

import math

from mpad_core.arrays import Array, Flags, Indices
from mpad_core.numerics.compiled import compiled_inline, compiled_lean
from mpad_core.numerics.streams import Stream, Word, mixed, uniform
from mpad_core.numerics.tables import value
from mpad_core.running.densities import density_at
from mpad_core.running.layout import Binding, Bonds, Candidates, Clocks, Molecules, Species
from mpad_core.running.places import distance, place_of

_ANCHORS = int(Stream.ANCHORS)
TENSION, OFF_RATE, ON_RATE, EXCHANGE = 0, 1, 2, 3  # columns of the bond tables; the last is the first of several
FORMED, BROKEN, CHANGED = 0, 1, 2  # kinds of event


@compiled_inline
def bond_length(bond: int, cell: int, centre: Array, turn: Array, bonds: Bonds, molecules: Molecules) -> float:
    """Give the length of a cell's bond."""
    x, y, z = place_of(bonds.site[bond], centre[cell], turn[cell], molecules)
    partner = bonds.partner[bond]
    ex, ey, ez = bonds.anchor[bond, 0], bonds.anchor[bond, 1], bonds.anchor[bond, 2]
    if partner >= 0:
        ex, ey, ez = place_of(bonds.ligand[bond], centre[partner], turn[partner], molecules)
    return distance(x, y, z, ex, ey, ez)


@compiled_inline
def _leaving_rate(kind: int, state: int, length: float, species: Species) -> float:
    """Give the rate at which a bond breaks or changes its state."""
    table = species.first[kind] + state
    rate = value(species.tables, table, OFF_RATE, length)
    for to in range(species.first[kind + 1] - species.first[kind]):
        if to != state:
            rate += value(species.tables, table, EXCHANGE + to, length)
    return rate


@compiled_lean
def _is_taken(kind: int, ligand: int, bonds: Bonds) -> bool:
    """Tell whether one of the wall's molecules is bound already, to whichever cell."""
    for cell in range(bonds.number.shape[0]):
        first = bonds.first[cell]
        for bond in range(first, first + bonds.number[cell]):
            if bonds.ligand[bond] == ligand and bonds.species[bond] == kind and bonds.partner[bond] < 0:
                return True
    return False


@compiled_inline
def _birth_length(pairwise: bool, lateral: float, gap: float, reach: float, least: float) -> float:
    """Give how long the bond of a candidate would be at first; infinity where it is out of reach.

    `lateral` (µm) is the distance along the wall from the molecule that it would bind to.
    """
    length = math.sqrt(lateral * lateral + gap * gap) if pairwise else abs(gap)
    within = (length if pairwise else gap) <= reach
    return max(length, least) if within else math.inf


@compiled_inline
def _forming_rate(kind: int, length: float, species: Species) -> float:
    """Give the rate at which a bond forms, in whichever inner state."""
    rate = 0.0
    for table in range(species.first[kind], species.first[kind + 1]):
        rate += value(species.tables, table, ON_RATE, length)
    return rate


@compiled_lean
def rates(
    cell: int, stop: float, centre: Array, turn: Array, binding: Binding, bonds: Bonds, bound: Flags,
    listed: Candidates, factor: Array,
) -> tuple[float, int, float]:  # fmt: skip
    """Sum the rates of all that can happen to a cell, its bonds first, until the sum exceeds `stop`.

    One of the wall's molecules that is bound already is not left out: `happen` lets nothing happen to it, which is the
    same in law (thinning), and does not look through all bonds each time.

    Parameters
    ----------
    centre, turn : (N, 3), (N, 3, 3)
        Where the cells are.
    factor : (K,)
        On each kind's on-rate, from the slip.

    Returns
    -------
    total
        The sum, of all where `stop` is infinite.
    which
        At which bond (counted from 0), or candidate (counted on after the bonds), the sum exceeded `stop`.
    within
        By how much it then exceeds.
    """
    # taken out of their tuples here, since doing so costs a hundred sums
    molecules, species, densities, tips = binding.molecules, binding.species, binding.densities, binding.wall_tips
    total = 0.0
    first, count = bonds.first[cell], bonds.number[cell]
    for bond in range(first, first + count):
        kind = bonds.species[bond]
        length = bond_length(bond, cell, centre, turn, bonds, molecules)
        total += _leaving_rate(kind, bonds.state[bond], length, species)
        if total > stop:
            return total, bond - first, total - stop
    first = listed.first[cell]
    site_of, kind_of, to_x, to_y = listed.site, listed.species, listed.x, listed.y
    ligand_of, partner_of = listed.ligand, listed.partner
    pairwise, reach, least = species.pairwise, species.reach, species.least_length
    place, turned = centre[cell], turn[cell]
    for candidate in range(first, first + listed.number[cell]):
        site = site_of[candidate]
        if bound[site]:
            continue
        kind = kind_of[candidate]
        x, y, z = place_of(site, place, turned, molecules)
        pair = pairwise[kind] != 0
        ex, ey, ez, partner = to_x[candidate], to_y[candidate], tips, partner_of[candidate]
        if partner >= 0:
            if bound[ligand_of[candidate]]:
                continue
            ex, ey, ez = place_of(ligand_of[candidate], centre[partner], turn[partner], molecules)
        lateral = math.sqrt((x - ex) ** 2 + (y - ey) ** 2)
        length = _birth_length(pair, lateral, z - ez, reach[kind], least[kind])
        if length == math.inf:
            continue
        crowd = 1.0 if pair else density_at(densities, cell, kind, x, y)
        total += crowd * factor[kind] * _forming_rate(kind, length, species)
        if total > stop:
            return total, count + candidate - first, total - stop
    return total, -1, 0.0


@compiled_lean
def _record(
    kind: int, bond: int, cell: int, length: float, step: int, time: float, binding: Binding, bonds: Bonds,
    recorded: Indices, events: Array,
) -> None:  # fmt: skip
    """Append an event at a time since the burst began."""
    event = events[recorded[0]]
    partner = bonds.partner[bond]
    ligand = bonds.ligand[bond]
    table = binding.species.first[bonds.species[bond]] + bonds.state[bond]
    event.step = step
    event.time = time
    event.kind = kind
    event.species = bonds.species[bond]
    event.state = bonds.state[bond]
    event.cell = cell
    event.receptor = bonds.site[bond] - binding.molecules.first[cell]
    event.partner = partner
    event.ligand = ligand if partner < 0 else ligand - binding.molecules.first[partner]
    event.anchor_x = bonds.anchor[bond, 0]  # of a bond between cells: where it was when the bond formed
    event.anchor_y = bonds.anchor[bond, 1]
    event.length = length
    event.force = value(binding.species.tables, table, TENSION, length)
    recorded[0] += 1


@compiled_lean
def list_bridges(cell: int, bonds: Bonds) -> None:
    """List which of a cell's bonds are to other cells."""
    first, found = bonds.first[cell], 0
    for bond in range(first, first + bonds.number[cell]):
        if bonds.partner[bond] >= 0:
            bonds.bridge[first + found] = bond
            found += 1
    bonds.bridges[cell] = found


@compiled_lean
def _drop(bond: int, cell: int, bonds: Bonds, bound: Flags) -> None:
    """Take a bond out of its cell's; the others keep their order."""
    bound[bonds.site[bond]] = 0
    if bonds.partner[bond] >= 0:
        bound[bonds.ligand[bond]] = 0
    last = bonds.first[cell] + bonds.number[cell] - 1
    for b in range(bond, last):
        bonds.site[b] = bonds.site[b + 1]
        bonds.species[b] = bonds.species[b + 1]
        bonds.state[b] = bonds.state[b + 1]
        bonds.partner[b] = bonds.partner[b + 1]
        bonds.ligand[b] = bonds.ligand[b + 1]
        for a in range(3):
            bonds.anchor[b, a] = bonds.anchor[b + 1, a]
    bonds.number[cell] -= 1
    if bonds.bridges[cell] > 0:
        list_bridges(cell, bonds)


@compiled_lean
def _bind(
    candidate: int, cell: int, angle: float, centre: Array, turn: Array, binding: Binding, bonds: Bonds, bound: Flags,
    listed: Candidates,
) -> int:  # fmt: skip
    """Make a candidate a bond of inner state 0; give it.

    Where the wall's molecules are a density the anchor lies straight below the molecule, or, where bonds are never
    slack and the gap is smaller than the unstressed length, so far away at `angle` that the bond is unstressed.
    """
    bond = bonds.first[cell] + bonds.number[cell]
    site, kind = listed.site[candidate], listed.species[candidate]
    tips = binding.wall_tips
    bonds.site[bond], bonds.species[bond], bonds.state[bond] = site, kind, 0
    bonds.partner[bond], bonds.ligand[bond] = listed.partner[candidate], listed.ligand[candidate]
    x, y, z = place_of(site, centre[cell], turn[cell], binding.molecules)
    partner, height = listed.partner[candidate], tips
    if partner >= 0:
        x, y, height = place_of(listed.ligand[candidate], centre[partner], turn[partner], binding.molecules)
    elif binding.species.pairwise[kind]:
        x, y = listed.x[candidate], listed.y[candidate]
    else:
        lateral = math.sqrt(max(binding.species.least_length[kind] ** 2 - (z - tips) ** 2, 0.0))
        x, y = x + lateral * math.cos(angle), y + lateral * math.sin(angle)
    bonds.anchor[bond, 0], bonds.anchor[bond, 1], bonds.anchor[bond, 2] = x, y, height
    bonds.number[cell] += 1
    bound[site] = 1
    if bonds.partner[bond] >= 0:
        bound[bonds.ligand[bond]] = 1
        list_bridges(cell, bonds)
    return int(bond)


@compiled_lean
def _changed(bond: int, length: float, excess: float, binding: Binding, bonds: Bonds) -> int:
    """Give the inner state that a bond changes to, or -1 if it breaks.

    `excess` lies in what the sum of its rates is, counted back from the last.
    """
    kind, state = bonds.species[bond], bonds.state[bond]
    table = binding.species.first[kind] + state
    for to in range(binding.species.first[kind + 1] - binding.species.first[kind] - 1, -1, -1):
        if to != state:
            excess -= value(binding.species.tables, table, EXCHANGE + to, length)
            if excess <= 0:
                return to
    return -1


@compiled_lean
def _born_state(kind: int, length: float, share: float, binding: Binding) -> int:
    """Give the inner state that a new bond has, for a share of the sum of the rates into all of them."""
    first, last = binding.species.first[kind], binding.species.first[kind + 1] - 1
    total = 0.0
    for table in range(first, last + 1):
        total += value(binding.species.tables, table, ON_RATE, length)
    short = share * total
    for table in range(first, last):
        short -= value(binding.species.tables, table, ON_RATE, length)
        if short < 0:
            return int(table - first)
    return int(last - first)


@compiled_lean
def happen(
    cell: int, which: int, excess: float, step: int, time: float, centre: Array, turn: Array, key: Word,
    binding: Binding, bonds: Bonds, bound: Flags, listed: Candidates, clocks: Clocks, recorded: Indices, events: Array,
) -> None:  # fmt: skip
    """Let the event happen that `rates` stopped at, and record it; nothing if the wall's molecule is bound already."""
    count = bonds.number[cell]
    if which >= count:
        candidate = listed.first[cell] + which - count
        kind = listed.species[candidate]
        if (
            listed.partner[candidate] < 0
            and listed.ligand[candidate] >= 0
            and _is_taken(kind, listed.ligand[candidate], bonds)
        ):
            return
        who = mixed(clocks.owner[cell], clocks.number[cell])
        bond = _bind(
            candidate, cell, 2 * math.pi * uniform(key, _ANCHORS, who, 0), centre, turn, binding, bonds, bound, listed
        )
        length = bond_length(bond, cell, centre, turn, bonds, binding.molecules)
        bonds.state[bond] = _born_state(kind, length, uniform(key, _ANCHORS, who, 1), binding)
        _record(FORMED, bond, cell, length, step, time, binding, bonds, recorded, events)
        return
    bond = bonds.first[cell] + which
    length = bond_length(bond, cell, centre, turn, bonds, binding.molecules)
    to = _changed(bond, length, excess, binding, bonds)
    if to >= 0:
        bonds.state[bond] = to
        _record(CHANGED, bond, cell, length, step, time, binding, bonds, recorded, events)
    else:
        _record(BROKEN, bond, cell, length, step, time, binding, bonds, recorded, events)
        _drop(bond, cell, bonds, bound)


@compiled_lean
def slip_factors(velocity: Array, height: float, species: Species, out: Array) -> None:
    """Write the factors (K,) that the slip of a cell at a height puts on its on-rates; `velocity` (6,)."""
    slip_x = velocity[0] - height * velocity[4]
    slip_y = velocity[1] + height * velocity[3]
    for kind in range(out.shape[0]):
        out[kind] = 1.0
        if species.encounter[kind] >= 0 and species.partner_kind[kind] < 0:
            out[kind] = value(species.encounters, species.encounter[kind], 0, math.sqrt(slip_x**2 + slip_y**2))
