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
from mpad_core.running.layout import Binding, Candidates, Dice
from mpad_core.running.places import SQUARE, height_of, ligand_at, ligands_of, place_of

_OUTWORN = -1.0  # as a slack: the list must be made anew


@compiled_lean
def reach_height(binding: Binding) -> float:
    """Give the height below which a molecule can bind to the wall."""
    reach = -math.inf
    for kind in range(binding.species.reach.shape[0]):
        if binding.species.partner_kind[kind] < 0:
            reach = max(reach, binding.species.reach[kind])
    return binding.wall_tips + reach


@compiled_lean
def _nearer(cell: int, level: int, centre: Array, rotation: Array, binding: Binding, listed: Candidates) -> float:
    """Give how much nearer to the wall, or to its molecules, any of a cell's may have come since they were listed.

    The cell is at centre[cell], and has turned as much as rotation[cell] says; see `Motion.turn`.
    """
    tx = rotation[cell, 0] - listed.turn[cell, level, 0]
    ty = rotation[cell, 1] - listed.turn[cell, level, 1]
    tz = rotation[cell, 2] - listed.turn[cell, level, 2]
    lever = listed.lever[cell, level]
    drop = max(listed.centre[cell, level, 2] - centre[cell, 2], 0.0)
    nearer = drop + math.sqrt(tx * tx + ty * ty) * lever
    if level != NEAR and binding.species.pairwise.any():
        shell = shell_of(cell, binding)
        slip_x = centre[cell, 0] - listed.centre[cell, level, 0] - shell * ty
        slip_y = centre[cell, 1] - listed.centre[cell, level, 1] + shell * tx
        nearer += math.sqrt(slip_x * slip_x + slip_y * slip_y) + abs(tz) * lever
    return float(nearer)


@compiled_lean
def _mark(
    cell: int,
    level: int,
    slack: float,
    highest: float,
    binding: Binding,
    centre: Array,
    rotation: Array,
    listed: Candidates,
) -> None:
    """Note where a cell was when its molecules below a height were listed, and how much nearer others may come."""
    shell = shell_of(cell, binding)
    depth = min(max(highest - centre[cell, 2] + shell, 0.0), shell)
    listed.lever[cell, level] = min(math.sqrt(depth * (2 * shell - depth)) + slack, shell)
    listed.slack[cell, level] = slack
    for a in range(3):
        listed.centre[cell, level, a] = centre[cell, a]
        listed.turn[cell, level, a] = rotation[cell, a]


@compiled_lean
def _mark_first(
    cell: int, level: int, lowest: float, binding: Binding, centre: Array, rotation: Array, listed: Candidates
) -> None:
    """Note from where a cell's candidates are listed, or would be, and how long they stand."""
    bottom = centre[cell, 2] - shell_of(cell, binding)
    _mark(cell, level, max(MARGIN, bottom - lowest), lowest + MARGIN, binding, centre, rotation, listed)


@compiled_lean
def _list_near(
    cell: int, lowest: float, binding: Binding, centre: Array, rotation: Array, turn: Array, listed: Candidates
) -> None:
    """List a cell's molecules that are within reach of the wall or `NEAR_MARGIN` more."""
    shell = shell_of(cell, binding)
    bottom = centre[cell, 2] - shell
    highest = lowest + NEAR_MARGIN
    _mark(cell, NEAR, max(NEAR_MARGIN, bottom - lowest) - MARGIN, highest, binding, centre, rotation, listed)
    at = listed.near_first[cell]
    if bottom < highest:
        for site in range(binding.molecules.first[cell], binding.molecules.first[cell + 1]):
            if height_of(site, centre[cell], turn, binding.molecules) < highest:
                listed.near[at] = site
                at += 1
    listed.near_number[cell] = at - listed.near_first[cell]


@compiled_lean
def _add_ligands(
    cell: int, site: int, kind: int, x: float, y: float, gap: float, binding: Binding, dice: Dice, listed: Candidates
) -> bool:
    """Add the molecules of the wall that one of a cell's could bind to; tell whether there was room."""
    reach = binding.species.reach[kind] + MARGIN
    lateral = math.sqrt(max(reach * reach - gap * gap, 0.0))
    for i in range(math.floor((x - lateral) / SQUARE), math.floor((x + lateral) / SQUARE) + 1):
        for j in range(math.floor((y - lateral) / SQUARE), math.floor((y + lateral) / SQUARE) + 1):
            for k in range(ligands_of(dice.key, kind, i, j, binding.species.ligand_density[kind])):
                ligand, lx, ly, mark = ligand_at(dice.key, kind, i, j, k)
                if (x - lx) ** 2 + (y - ly) ** 2 > lateral * lateral:
                    continue
                if mark >= density_at(binding.densities, cell, kind, lx, ly):
                    continue
                if not append(cell, site, kind, ligand, -1, lx, ly, listed):
                    return False
    return True


@compiled_lean
def _list_candidates(
    cell: int,
    lowest: float,
    binding: Binding,
    centre: Array,
    rotation: Array,
    turn: Array,
    dice: Dice,
    listed: Candidates,
) -> bool:
    """List what a cell's near molecules can bind to, or could after a short way; tell whether there was room."""
    molecules, species = binding.molecules, binding.species
    place = centre[cell]
    _mark_first(cell, FIRST, lowest, binding, centre, rotation, listed)
    listed.number[cell] = 0
    first = listed.near_first[cell]
    for n in range(first, first + listed.near_number[cell]):
        site = listed.near[n]
        if height_of(site, place, turn, molecules) >= lowest + MARGIN:
            continue
        x, y, z = place_of(site, place, turn, molecules)
        gap = z - binding.wall_tips
        for kind in range(species.site_kind.shape[0]):
            if molecules.kind[site] != species.site_kind[kind] or species.partner_kind[kind] >= 0:
                continue
            if gap >= species.reach[kind] + MARGIN:
                continue
            if species.pairwise[kind]:
                room = _add_ligands(cell, site, kind, x, y, gap, binding, dice, listed)
            else:
                room = append(cell, site, kind, -1, -1, 0.0, 0.0, listed)
            if not room:
                return False
    return True


@compiled_lean
def _list_pairs(cell: int, binding: Binding, centre: Array, rotation: Array, turn: Array, listed: Candidates) -> bool:
    """List anew what faces a cell's partners where that may be too short; tell whether candidates must be, too."""
    stale = False
    for pair in range(binding.neighbours.first[cell], binding.neighbours.first[cell + 1]):
        unlisted = listed.facing_number[2 * pair] < 0
        way = 0.0 if unlisted else nearer(pair, NEAR, cell, centre, rotation, binding, listed)
        if unlisted or way > listed.pair_slack[pair, NEAR]:
            list_facing(pair, cell, centre, rotation, turn, binding, listed)
            stale = True
        elif nearer(pair, FIRST, cell, centre, rotation, binding, listed) > listed.pair_slack[pair, FIRST]:
            stale = True
    return stale


@compiled_lean
def refresh(
    cell: int, binding: Binding, centre: Array, rotation: Array, turn: Array, dice: Dice, listed: Candidates
) -> bool:
    """See to it that all molecules of a cell that can bind are listed; tell whether there was room.

    A `near_number` below zero says that nothing has been listed yet. `turn` (N, 3, 3) are the cells' rotations.
    """
    if binding.molecules.first[cell] == binding.molecules.first[cell + 1]:
        listed.near_number[cell] = 0
        listed.slack[cell, NEAR] = listed.slack[cell, FIRST] = math.inf
        return True
    lowest = reach_height(binding)
    stale = _list_pairs(cell, binding, centre, rotation, turn, listed)
    unlisted = listed.near_number[cell] < 0
    if unlisted or _nearer(cell, NEAR, centre, rotation, binding, listed) > listed.slack[cell, NEAR]:
        _list_near(cell, lowest, binding, centre, rotation, turn[cell], listed)
    elif not stale and not (_nearer(cell, FIRST, centre, rotation, binding, listed) > listed.slack[cell, FIRST]):
        return True
    if not _list_candidates(cell, lowest, binding, centre, rotation, turn[cell], dice, listed):
        return False
    for pair in range(binding.neighbours.first[cell], binding.neighbours.first[cell + 1]):
        if not add_facing(pair, cell, centre, rotation, turn, binding, listed):
            return False
    return True


@compiled_lean
def _leads_beyond(cell: int, level: int, binding: Binding, to: Array, to_rotation: Array, listed: Candidates) -> bool:
    """Tell whether a way that is tried leads a cell beyond its candidates of a level."""
    beyond = bool(_nearer(cell, level, to, to_rotation, binding, listed) > listed.slack[cell, level])
    for pair in range(binding.neighbours.first[cell], binding.neighbours.first[cell + 1]):
        way = nearer(pair, level, cell, to, to_rotation, binding, listed)
        beyond = beyond or way > listed.pair_slack[pair, level]
    return beyond


@compiled_lean
def is_too_far(
    cell: int, binding: Binding, centre: Array, rotation: Array, to: Array, to_rotation: Array, listed: Candidates
) -> bool:
    """Tell whether a way that is tried is longer than candidates listed at its start would stand.

    Those that are listed may stand longer or shorter; it depends on when that was, and the length of a way must not.
    """
    first = binding.molecules.first
    if first[cell] == first[cell + 1]:
        return False
    _mark_first(cell, NOW, reach_height(binding), binding, centre, rotation, listed)
    for pair in range(binding.neighbours.first[cell], binding.neighbours.first[cell + 1]):
        note_first(pair, NOW, cell, centre, rotation, binding, listed)
    return _leads_beyond(cell, NOW, binding, to, to_rotation, listed)


@compiled_lean
def wears_out(cell: int, binding: Binding, to: Array, to_rotation: Array, listed: Candidates) -> bool:
    """Tell whether a way that is tried leads a cell beyond its lists, and have them made anew if it does."""
    if not _leads_beyond(cell, FIRST, binding, to, to_rotation, listed):
        return False
    listed.slack[cell, FIRST] = _OUTWORN
    return True
