"""Which molecules of two cells may bind to each other: lists like those for the wall, see `listing`; compiled.

Two lists a pair: of each cell's molecules those that face the other cell, and of those the candidates. Each stands
until the cells may have brought molecules nearer to each other by more than it allows for: by their relative
displacement, and by both turns times the radii on which their molecules lie.
"""

import math

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled_inline, compiled_lean
from mpad_core.running.layout import Binding, Candidates
from mpad_core.running.places import distance, place_of

NEAR_MARGIN = 0.3  # µm: molecules this far out of reach face each other
MARGIN = 0.02  # µm: and these are candidates
NEAR, FIRST, NOW = 1, 0, 2  # levels of the two lists; the last: the first, were it made now


@compiled_inline
def shell_of(cell: int, binding: Binding) -> float:
    """Give the radius on which a cell's molecules lie."""
    return float(binding.shell[cell])


@compiled_inline
def append(cell: int, site: int, kind: int, ligand: int, partner: int, x: float, y: float, listed: Candidates) -> bool:
    """Add a candidate; tell whether there was room."""
    at = listed.first[cell] + listed.number[cell]
    room = bool(at < listed.first[cell + 1])
    if room:
        listed.site[at] = site
        listed.species[at] = kind
        listed.ligand[at] = ligand
        listed.partner[at] = partner
        listed.x[at] = x
        listed.y[at] = y
        listed.number[cell] += 1
    return room


@compiled_lean
def _reach(binding: Binding) -> float:
    """Give the distance below which molecules of two cells can bind."""
    reach = 0.0
    for kind in range(binding.species.reach.shape[0]):
        if binding.species.partner_kind[kind] >= 0:
            reach = max(reach, binding.species.reach[kind])
    return reach


@compiled_lean
def nearer(
    pair: int, level: int, cell: int, centre: Array, rotation: Array, binding: Binding, listed: Candidates
) -> float:
    """Give how much nearer to each other molecules of a pair may have come since they were listed."""
    partner = binding.neighbours.partner[pair]
    noted = listed.pair_from
    way = turn = partner_turn = 0.0
    for a in range(3):
        way += (centre[cell, a] - centre[partner, a] - noted[pair, level, a]) ** 2
        turn += (rotation[cell, a] - noted[pair, level, 3 + a]) ** 2
        partner_turn += (rotation[partner, a] - noted[pair, level, 6 + a]) ** 2
    turns = shell_of(cell, binding) * math.sqrt(turn) + shell_of(partner, binding) * math.sqrt(partner_turn)
    return math.sqrt(way) + turns


@compiled_lean
def _note(
    pair: int, level: int, slack: float, cell: int, centre: Array, rotation: Array, binding: Binding, listed: Candidates
) -> None:
    partner = binding.neighbours.partner[pair]
    listed.pair_slack[pair, level] = slack
    for a in range(3):
        listed.pair_from[pair, level, a] = centre[cell, a] - centre[partner, a]
        listed.pair_from[pair, level, 3 + a] = rotation[cell, a]
        listed.pair_from[pair, level, 6 + a] = rotation[partner, a]


@compiled_lean
def _apart(cell: int, partner: int, centre: Array, binding: Binding) -> float:
    """Give the gap between the shells on which two cells' molecules lie."""
    a, b = centre[cell], centre[partner]
    return distance(a[0], a[1], a[2], b[0], b[1], b[2]) - shell_of(cell, binding) - shell_of(partner, binding)


@compiled_lean
def note_first(
    pair: int, level: int, cell: int, centre: Array, rotation: Array, binding: Binding, listed: Candidates
) -> None:
    """Note from where candidates of a pair are listed, or would be, and how long they stand."""
    apart = _apart(cell, binding.neighbours.partner[pair], centre, binding)
    _note(pair, level, max(MARGIN, apart - _reach(binding)), cell, centre, rotation, binding, listed)


@compiled_lean
def list_facing(
    pair: int, cell: int, centre: Array, rotation: Array, turn: Array, binding: Binding, listed: Candidates
) -> None:
    """List the molecules of a pair that are within reach of the other's shell, or `NEAR_MARGIN` more."""
    partner = binding.neighbours.partner[pair]
    reach = _reach(binding)
    apart = _apart(cell, partner, centre, binding)
    _note(pair, NEAR, max(NEAR_MARGIN, apart - reach) - MARGIN, cell, centre, rotation, binding, listed)
    for side in range(2):
        own, other = (cell, partner) if side == 0 else (partner, cell)
        slot = 2 * pair + side
        at = listed.facing_first[slot]
        farthest = shell_of(other, binding) + reach + NEAR_MARGIN
        cx, cy, cz = centre[other, 0], centre[other, 1], centre[other, 2]
        if apart < reach + NEAR_MARGIN:
            for site in range(binding.molecules.first[own], binding.molecules.first[own + 1]):
                x, y, z = place_of(site, centre[own], turn[own], binding.molecules)
                if (x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2 < farthest * farthest:
                    listed.facing[at] = site
                    at += 1
        listed.facing_number[slot] = at - listed.facing_first[slot]


@compiled_lean
def _add_partners(
    pair: int, cell: int, site: int, kind: int, wanted: int, centre: Array, turn: Array, binding: Binding,
    listed: Candidates,
) -> bool:  # fmt: skip
    """Add the partner's molecules of a kind that one of a cell's could bind to; tell whether there was room."""
    partner = binding.neighbours.partner[pair]
    molecules, reach = binding.molecules, binding.species.reach[kind] + MARGIN
    x, y, z = place_of(site, centre[cell], turn[cell], molecules)
    first = listed.facing_first[2 * pair + 1]
    for k in range(first, first + listed.facing_number[2 * pair + 1]):
        other = listed.facing[k]
        px, py, pz = place_of(other, centre[partner], turn[partner], molecules)
        near = (x - px) ** 2 + (y - py) ** 2 + (z - pz) ** 2 < reach * reach
        if near and molecules.kind[other] == wanted and not append(cell, site, kind, other, partner, 0.0, 0.0, listed):
            return False
    return True


@compiled_lean
def add_facing(
    pair: int, cell: int, centre: Array, rotation: Array, turn: Array, binding: Binding, listed: Candidates
) -> bool:
    """Add to a cell's candidates what its molecules can bind to on a partner; tell whether there was room."""
    partner, species, molecules = binding.neighbours.partner[pair], binding.species, binding.molecules
    note_first(pair, FIRST, cell, centre, rotation, binding, listed)
    farthest = shell_of(partner, binding) + _reach(binding) + MARGIN
    cx, cy, cz = centre[partner, 0], centre[partner, 1], centre[partner, 2]
    first = listed.facing_first[2 * pair]
    for k in range(first, first + listed.facing_number[2 * pair]):
        site = listed.facing[k]
        x, y, z = place_of(site, centre[cell], turn[cell], molecules)
        if (x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2 >= farthest * farthest:
            continue
        for kind in range(species.site_kind.shape[0]):
            mine, theirs, own = species.site_kind[kind], species.partner_kind[kind], molecules.kind[site]
            if theirs < 0:
                continue
            room = True
            if own == mine:
                room = _add_partners(pair, cell, site, kind, theirs, centre, turn, binding, listed)
            if room and own == theirs and mine != theirs:
                room = _add_partners(pair, cell, site, kind, mine, centre, turn, binding, listed)
            if not room:
                return False
    return True
