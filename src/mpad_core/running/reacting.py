"""Formation and rupture of bonds over one sub-step: items (i) and (ii) of King & Hammer (PNAS 2001), compiled.

Every free molecule within reach of the wall is tested against P = 1 − exp(−k_on Δt), every bond against
P = 1 − exp(−k_off Δt), at the lengths of the sub-step's start. Each draw is keyed by the molecules and the sub-step, so
the list of candidates may be any list that holds all molecules within reach.
"""

import math

import numpy as np

from mpad_core.arrays import Array, Flags, Indices
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.streams import Stream, mixed, uniform, uniform_pair
from mpad_core.numerics.tables import value
from mpad_core.running.layout import Bonds, Dice, Molecules, Motion, Species, System

_FORMATION = int(Stream.FORMATION)
_RUPTURE = int(Stream.RUPTURE)
_LIGANDS = int(Stream.LIGANDS)
_ANCHORS = int(Stream.ANCHORS)
TENSION, OFF_RATE, ON_RATE = 0, 1, 2  # columns of the bond tables
SQUARE = 0.1  # µm, side of the squares in which the wall's molecules are laid out
MOST_LIGANDS = 255  # in a square; each has a number of 8 bits


@compiled
def list_candidates(
    cell: int, lowest: float, molecules: Molecules, motion: Motion, turn: Array, out: Indices, at: int
) -> int:
    """List the molecules of a cell below height `lowest` from place `at` on; give the place after the last."""
    height = motion.centre[cell, 2]
    for site in range(molecules.first[cell], molecules.first[cell + 1]):
        arm = molecules.arm[site]
        if height + turn[2, 0] * arm[0] + turn[2, 1] * arm[1] + turn[2, 2] * arm[2] < lowest:
            out[at] = site
            at += 1
    return at


@compiled
def place_of(site: int, cell: int, molecules: Molecules, motion: Motion, turn: Array) -> tuple[float, float, float]:
    """Give where a molecule is."""
    arm = molecules.arm[site]
    return (
        motion.centre[cell, 0] + turn[0, 0] * arm[0] + turn[0, 1] * arm[1] + turn[0, 2] * arm[2],
        motion.centre[cell, 1] + turn[1, 0] * arm[0] + turn[1, 1] * arm[1] + turn[1, 2] * arm[2],
        motion.centre[cell, 2] + turn[2, 0] * arm[0] + turn[2, 1] * arm[1] + turn[2, 2] * arm[2],
    )


@compiled
def length_of(bond: int, bonds: Bonds, molecules: Molecules, motion: Motion, turns: Array) -> float:
    """Give the length of a bond."""
    cell = bonds.cell[bond]
    x, y, z = place_of(bonds.site[bond], cell, molecules, motion, turns[cell])
    anchor = bonds.anchor[bond]
    return math.sqrt((x - anchor[0]) ** 2 + (y - anchor[1]) ** 2 + (z - anchor[2]) ** 2)


@compiled
def record(
    events: Array, count: Indices, kind: int, bond: int, bonds: Bonds, molecules: Molecules, species: Species,
    length: float, step: int,
) -> None:  # fmt: skip
    """Append an event; its time is filled in by the caller, who knows the clock."""
    event = events[count[0]]
    event.step = step
    event.kind = kind
    event.species = bonds.species[bond]
    event.state = 0
    event.cell = bonds.cell[bond]
    event.partner = -1
    event.receptor = bonds.site[bond] - molecules.first[bonds.cell[bond]]
    event.ligand = bonds.ligand[bond]
    event.anchor_x = bonds.anchor[bond, 0]
    event.anchor_y = bonds.anchor[bond, 1]
    event.length = length
    event.force = value(species.tables, bonds.species[bond], TENSION, length)
    count[0] += 1


@compiled
def break_bonds(
    bonds: Bonds, bound: Flags, system: System, motion: Motion, turns: Array, dice: Dice, step: int, dt: float,
    events: Array, event_count: Indices,
) -> None:  # fmt: skip
    """Test every living bond for rupture; those that stay keep their order."""
    molecules, species = system.molecules, system.species
    kept = 0
    for bond in range(bonds.living[0]):
        kind = bonds.species[bond]
        length = length_of(bond, bonds, molecules, motion, turns)
        chance = -math.expm1(-value(species.tables, kind, OFF_RATE, length) * dt)
        who = mixed(molecules.owner[bonds.cell[bond]], bonds.site[bond] - molecules.first[bonds.cell[bond]])
        if uniform(dice.key, _RUPTURE, who, step) < chance:
            record(events, event_count, 1, bond, bonds, molecules, species, length, step)
            bound[bonds.site[bond]] = 0
            continue
        bonds.cell[kept] = bonds.cell[bond]
        bonds.site[kept] = bonds.site[bond]
        bonds.species[kept] = kind
        bonds.ligand[kept] = bonds.ligand[bond]
        bonds.anchor[kept] = bonds.anchor[bond]
        kept += 1
    bonds.living[0] = kept


@compiled
def _bind(bonds: Bonds, cell: int, site: int, kind: int, ligand: int, x: float, y: float, z: float) -> int:
    """Append a bond; give its index."""
    bond = int(bonds.living[0])
    bonds.cell[bond] = cell
    bonds.site[bond] = site
    bonds.species[bond] = kind
    bonds.ligand[bond] = ligand
    bonds.anchor[bond, 0] = x
    bonds.anchor[bond, 1] = y
    bonds.anchor[bond, 2] = z
    bonds.living[0] = bond + 1
    return bond


@compiled
def _bind_anywhere(
    cell: int, site: int, kind: int, x: float, y: float, gap: float, density_ratio: float, wall_tips: float,
    species: Species, bonds: Bonds, who: int, dice: Dice, step: int, dt: float,
) -> int:  # fmt: skip
    """Test a molecule against a wall whose molecules are a density; give the new bond or -1.

    The bond is born as long as the tip gap, its anchor straight below the molecule, or, where bonds are never slack
    and the gap is smaller than the unstressed length, unstressed and tilted in a random direction.
    """
    length = max(abs(gap), species.least_length[kind])
    rate = density_ratio * value(species.tables, kind, ON_RATE, length)
    if uniform(dice.key, _FORMATION, mixed(who, kind), step) >= -math.expm1(-rate * dt):
        return -1
    lateral = math.sqrt(max(length * length - gap * gap, 0.0))
    angle = 2 * math.pi * uniform(dice.key, _ANCHORS, mixed(who, kind), step)
    return _bind(bonds, cell, site, kind, -1, x + lateral * math.cos(angle), y + lateral * math.sin(angle), wall_tips)


@compiled
def _square_of(i: int, j: int) -> int:
    """Give the identity of a square of the wall; its last eight bits are free for the molecule's number."""
    return int((np.int64(i) & 0xFFFFFF) << 32 | (np.int64(j) & 0xFFFFFF) << 8)


@compiled
def ligands_of(key: int, kind: int, i: int, j: int, density: float) -> int:
    """Give the number of the wall's molecules in a square: Poisson, by inversion."""
    u = uniform(key, _LIGANDS, mixed(_square_of(i, j), kind), 0)
    chance = math.exp(-density * SQUARE * SQUARE)
    total = chance
    number = 0
    while u > total and number < MOST_LIGANDS:
        number += 1
        chance *= density * SQUARE * SQUARE / number
        total += chance
    return number


@compiled
def _is_taken(bonds: Bonds, kind: int, ligand: int) -> bool:
    taken = False
    for bond in range(bonds.living[0]):
        taken = taken or (bonds.ligand[bond] == ligand and bonds.species[bond] == kind)
    return taken


@compiled
def _bind_pairs(
    cell: int, site: int, kind: int, x: float, y: float, gap: float, density_ratio: float, wall_tips: float,
    species: Species, bonds: Bonds, who: int, dice: Dice, step: int, dt: float,
) -> int:  # fmt: skip
    """Test a molecule against each single molecule of the wall within reach; give the new bond or -1."""
    reach = species.reach[kind]
    lateral = math.sqrt(max(reach * reach - gap * gap, 0.0))
    for i in range(math.floor((x - lateral) / SQUARE), math.floor((x + lateral) / SQUARE) + 1):
        for j in range(math.floor((y - lateral) / SQUARE), math.floor((y + lateral) / SQUARE) + 1):
            number = ligands_of(dice.key, kind, i, j, species.ligand_density[kind])
            square = _square_of(i, j)
            for k in range(number):
                u, v = uniform_pair(dice.key, _LIGANDS, mixed(square, kind), 1 + k)
                lx, ly = (i + u) * SQUARE, (j + v) * SQUARE
                length = math.sqrt((x - lx) ** 2 + (y - ly) ** 2 + gap * gap)
                ligand = square | k
                mark = uniform(dice.key, _LIGANDS, mixed(ligand, kind), 1000)  # thins the densest to the local density
                if length > reach or mark >= density_ratio:
                    continue
                rate = value(species.tables, kind, ON_RATE, length)
                draw = uniform(dice.key, _FORMATION, mixed(mixed(who, kind), ligand), step)
                if draw < -math.expm1(-rate * dt) and not _is_taken(bonds, kind, ligand):
                    return _bind(bonds, cell, site, kind, ligand, lx, ly, wall_tips)
    return -1


@compiled
def form_bonds(
    candidates: Indices, first: Indices, bonds: Bonds, bound: Flags, system: System, motion: Motion, turns: Array,
    dice: Dice, step: int, dt: float, events: Array, event_count: Indices,
) -> None:  # fmt: skip
    """Test every free candidate for formation, in the order of the molecules; a new bond is not tested for rupture."""
    molecules, species, tips = system.molecules, system.species, system.bodies.wall_tips
    for cell in range(first.shape[0] - 1):
        for c in range(first[cell], first[cell + 1]):
            site = candidates[c]
            if bound[site]:
                continue
            x, y, z = place_of(site, cell, molecules, motion, turns[cell])
            gap = z - tips
            who = mixed(molecules.owner[cell], site - molecules.first[cell])
            for kind in range(species.site_kind.shape[0]):
                if molecules.kind[site] != species.site_kind[kind] or gap > species.reach[kind]:
                    continue
                ratio = system.density_ratio[cell, kind]
                if species.pairwise[kind]:
                    bond = _bind_pairs(cell, site, kind, x, y, gap, ratio, tips, species, bonds, who, dice, step, dt)
                else:
                    bond = _bind_anywhere(cell, site, kind, x, y, gap, ratio, tips, species, bonds, who, dice, step, dt)
                if bond >= 0:
                    bound[site] = 1
                    length = length_of(bond, bonds, molecules, motion, turns)
                    record(events, event_count, 0, bond, bonds, molecules, species, length, step)
                    break
