"""Which molecules may take part in events: lists that are longer than need be, and stand until they could be too short.

Two lists a cell: of all its molecules those near the wall, and of those the candidates, which could bind to the wall
within a short way. Each is made anew when molecules may have come nearer by more than it allows for; what is listed in
vain has a rate of zero, so nothing depends on when that is.
"""

import math

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled_lean
from mpad_core.running.densities import density_at
from mpad_core.running.facing import (
    FIRST,
    MARGIN,
    NEAR,
    NEAR_MARGIN,
    NOW,
    add_facing,
    append,
    list_facing,
    nearer,
    note_first,
    shell_of,
)
from mpad_core.running.layout import Candidates, Dice, Motion, System, Work
from mpad_core.running.places import SQUARE, height_of, ligand_at, ligands_of, place_of

_OUTWORN = -1.0  # as a slack: the list must be made anew


@compiled_lean
def reach_height(system: System) -> float:
    """Give the height below which a molecule can bind to the wall."""
    reach = -math.inf
    for kind in range(system.species.reach.shape[0]):
        if system.species.partner_kind[kind] < 0:
            reach = max(reach, system.species.reach[kind])
    return system.bodies.wall_tips + reach


@compiled_lean
def _nearer(cell: int, level: int, centre: Array, rotation: Array, system: System, listed: Candidates) -> float:
    """Give how much nearer to the wall, or to its molecules, any of a cell's may have come since they were listed.

    The cell is at centre[cell], and has turned as much as motion.turn, rotation[cell], says.
    """
    tx = rotation[cell, 0] - listed.turn[cell, level, 0]
    ty = rotation[cell, 1] - listed.turn[cell, level, 1]
    tz = rotation[cell, 2] - listed.turn[cell, level, 2]
    lever = listed.lever[cell, level]
    drop = max(listed.centre[cell, level, 2] - centre[cell, 2], 0.0)
    nearer = drop + math.sqrt(tx * tx + ty * ty) * lever
    if level != NEAR and system.species.pairwise.any():
        shell = shell_of(cell, system)
        slip_x = centre[cell, 0] - listed.centre[cell, level, 0] - shell * ty
        slip_y = centre[cell, 1] - listed.centre[cell, level, 1] + shell * tx
        nearer += math.sqrt(slip_x * slip_x + slip_y * slip_y) + abs(tz) * lever
    return float(nearer)


@compiled_lean
def _mark(
    cell: int, level: int, slack: float, highest: float, system: System, motion: Motion, listed: Candidates
) -> None:
    """Note where a cell was when its molecules below a height were listed, and how much nearer others may come."""
    shell = shell_of(cell, system)
    depth = min(max(highest - motion.centre[cell, 2] + shell, 0.0), shell)
    listed.lever[cell, level] = min(math.sqrt(depth * (2 * shell - depth)) + slack, shell)
    listed.slack[cell, level] = slack
    for a in range(3):
        listed.centre[cell, level, a] = motion.centre[cell, a]
        listed.turn[cell, level, a] = motion.turn[cell, a]


@compiled_lean
def _mark_first(cell: int, level: int, lowest: float, system: System, motion: Motion, listed: Candidates) -> None:
    """Note from where a cell's candidates are listed, or would be, and how long they stand."""
    bottom = motion.centre[cell, 2] - shell_of(cell, system)
    _mark(cell, level, max(MARGIN, bottom - lowest), lowest + MARGIN, system, motion, listed)


@compiled_lean
def _list_near(cell: int, lowest: float, system: System, motion: Motion, turn: Array, listed: Candidates) -> None:
    """List a cell's molecules that are within reach of the wall or `NEAR_MARGIN` more."""
    shell = shell_of(cell, system)
    bottom = motion.centre[cell, 2] - shell
    highest = lowest + NEAR_MARGIN
    _mark(cell, NEAR, max(NEAR_MARGIN, bottom - lowest) - MARGIN, highest, system, motion, listed)
    at = listed.near_first[cell]
    if bottom < highest:
        for site in range(system.molecules.first[cell], system.molecules.first[cell + 1]):
            if height_of(site, motion.centre[cell], turn, system.molecules) < highest:
                listed.near[at] = site
                at += 1
    listed.near_number[cell] = at - listed.near_first[cell]


@compiled_lean
def _add_ligands(
    cell: int, site: int, kind: int, x: float, y: float, gap: float, system: System, dice: Dice, listed: Candidates
) -> bool:
    """Add the molecules of the wall that one of a cell's could bind to; tell whether there was room."""
    reach = system.species.reach[kind] + MARGIN
    lateral = math.sqrt(max(reach * reach - gap * gap, 0.0))
    for i in range(math.floor((x - lateral) / SQUARE), math.floor((x + lateral) / SQUARE) + 1):
        for j in range(math.floor((y - lateral) / SQUARE), math.floor((y + lateral) / SQUARE) + 1):
            for k in range(ligands_of(dice.key, kind, i, j, system.species.ligand_density[kind])):
                ligand, lx, ly, mark = ligand_at(dice.key, kind, i, j, k)
                if (x - lx) ** 2 + (y - ly) ** 2 > lateral * lateral:
                    continue
                if mark >= density_at(system.densities, cell, kind, lx, ly):
                    continue
                if not append(cell, site, kind, ligand, -1, lx, ly, listed):
                    return False
    return True


@compiled_lean
def _list_candidates(
    cell: int, lowest: float, system: System, motion: Motion, turn: Array, dice: Dice, listed: Candidates
) -> bool:
    """List what a cell's near molecules can bind to, or could after a short way; tell whether there was room."""
    molecules, species = system.molecules, system.species
    centre = motion.centre[cell]
    _mark_first(cell, FIRST, lowest, system, motion, listed)
    listed.number[cell] = 0
    first = listed.near_first[cell]
    for n in range(first, first + listed.near_number[cell]):
        site = listed.near[n]
        if height_of(site, centre, turn, molecules) >= lowest + MARGIN:
            continue
        x, y, z = place_of(site, centre, turn, molecules)
        gap = z - system.bodies.wall_tips
        for kind in range(species.site_kind.shape[0]):
            if molecules.kind[site] != species.site_kind[kind] or species.partner_kind[kind] >= 0:
                continue
            if gap >= species.reach[kind] + MARGIN:
                continue
            if species.pairwise[kind]:
                room = _add_ligands(cell, site, kind, x, y, gap, system, dice, listed)
            else:
                room = append(cell, site, kind, -1, -1, 0.0, 0.0, listed)
            if not room:
                return False
    return True


@compiled_lean
def _list_pairs(cell: int, system: System, motion: Motion, turn: Array, listed: Candidates) -> bool:
    """List anew what faces a cell's partners where that may be too short; tell whether candidates must be, too."""
    stale = False
    for pair in range(system.neighbours.first[cell], system.neighbours.first[cell + 1]):
        unlisted = listed.facing_number[2 * pair] < 0
        way = 0.0 if unlisted else nearer(pair, NEAR, cell, motion.centre, motion.turn, system, listed)
        if unlisted or way > listed.pair_slack[pair, NEAR]:
            list_facing(pair, cell, motion.centre, motion.turn, turn, system, listed)
            stale = True
        elif nearer(pair, FIRST, cell, motion.centre, motion.turn, system, listed) > listed.pair_slack[pair, FIRST]:
            stale = True
    return stale


@compiled_lean
def refresh(cell: int, system: System, motion: Motion, turn: Array, dice: Dice, listed: Candidates) -> bool:
    """See to it that all molecules of a cell that can bind are listed; tell whether there was room.

    A `near_number` below zero says that nothing has been listed yet. `turn` (N, 3, 3) are the cells' rotations.
    """
    if system.molecules.first[cell] == system.molecules.first[cell + 1]:
        listed.near_number[cell] = 0
        listed.slack[cell, NEAR] = listed.slack[cell, FIRST] = math.inf
        return True
    lowest = reach_height(system)
    stale = _list_pairs(cell, system, motion, turn, listed)
    unlisted = listed.near_number[cell] < 0
    if unlisted or _nearer(cell, NEAR, motion.centre, motion.turn, system, listed) > listed.slack[cell, NEAR]:
        _list_near(cell, lowest, system, motion, turn[cell], listed)
    elif not stale and not (
        _nearer(cell, FIRST, motion.centre, motion.turn, system, listed) > listed.slack[cell, FIRST]
    ):
        return True
    if not _list_candidates(cell, lowest, system, motion, turn[cell], dice, listed):
        return False
    for pair in range(system.neighbours.first[cell], system.neighbours.first[cell + 1]):
        if not add_facing(pair, cell, motion.centre, motion.turn, turn, system, listed):
            return False
    return True


@compiled_lean
def _leads_beyond(cell: int, level: int, system: System, work: Work, listed: Candidates) -> bool:
    """Tell whether a way that is tried leads a cell beyond its candidates of a level."""
    beyond = bool(_nearer(cell, level, work.centre, work.rotation, system, listed) > listed.slack[cell, level])
    for pair in range(system.neighbours.first[cell], system.neighbours.first[cell + 1]):
        way = nearer(pair, level, cell, work.centre, work.rotation, system, listed)
        beyond = beyond or way > listed.pair_slack[pair, level]
    return beyond


@compiled_lean
def is_too_far(cell: int, system: System, motion: Motion, work: Work, listed: Candidates) -> bool:
    """Tell whether a way that is tried is longer than candidates listed at its start would stand.

    Those that are listed may stand longer or shorter; it depends on when that was, and the length of a way must not.
    """
    first = system.molecules.first
    if system.species.site_kind.shape[0] == 0 or first[cell] == first[cell + 1]:
        return False
    _mark_first(cell, NOW, reach_height(system), system, motion, listed)
    for pair in range(system.neighbours.first[cell], system.neighbours.first[cell + 1]):
        note_first(pair, NOW, cell, motion.centre, motion.turn, system, listed)
    return _leads_beyond(cell, NOW, system, work, listed)


@compiled_lean
def wears_out(cell: int, system: System, work: Work, listed: Candidates) -> bool:
    """Tell whether a way that is tried leads a cell beyond its lists, and have them made anew if it does."""
    if system.species.site_kind.shape[0] == 0 or not _leads_beyond(cell, FIRST, system, work, listed):
        return False
    listed.slack[cell, FIRST] = _OUTWORN
    return True
