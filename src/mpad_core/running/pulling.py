"""The loads on a group of cells but the fluid's, and their stiffness: bonds, repulsion, constant ones; compiled.

They are those at places to which the group's cells have been moved and turned, as Newton's method tries them.
"""

import math

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled_inline, compiled_lean, compiled_where_present
from mpad_core.numerics.rotations import turned_vector
from mpad_core.numerics.tables import value_and_slope
from mpad_core.running.layout import Bench, Binding, Bodies, Bonds, Contacts, Groups, Motion, System, Work
from mpad_core.running.places import place_of
from mpad_core.running.reacting import TENSION


@compiled_inline
def _add_bond(
    o: int, bx: float, by: float, bz: float, dx: float, dy: float, dz: float, length: float, tension: float,
    slope: float, load: Array, stiffness: Array,
) -> None:  # fmt: skip
    """Add one bond's load on a cell whose numbers begin at `o`, and minus the load's derivative by its motion.

    A bond of tension T along n, whose end on the cell is at b from the centre and at d = L n from its other end, pulls
    with F = −T n. The end moves by δx − b × δθ, so with K = (T′ − T/L) n nᵀ + (T/L) 1 and c = b × n the four blocks are
    K; (T′ − T/L) n cᵀ − (T/L) [b]×; its transpose; and (T′ − T/L) c cᵀ − (T/L) [b]×² + T [n]× [b]×, the last part
    because the arm turns with the cell.
    """
    nx, ny, nz = dx / length, dy / length, dz / length
    n = (nx, ny, nz)
    b = (bx, by, bz)
    c = (by * nz - bz * ny, bz * nx - bx * nz, bx * ny - by * nx)
    cross = ((0.0, -bz, by), (bz, 0.0, -bx), (-by, bx, 0.0))  # [b]×
    side = tension / length
    along = slope - side
    square = bx * bx + by * by + bz * bz
    level = nx * bx + ny * by + nz * bz
    for i in range(3):
        load[o + i] -= tension * n[i]
        load[o + 3 + i] -= tension * c[i]
        stiffness[o + i, o + i] += side
        stiffness[o + 3 + i, o + 3 + i] += side * square - tension * level
        for j in range(3):
            stiffness[o + i, o + j] += along * n[i] * n[j]
            stiffness[o + i, o + 3 + j] += along * n[i] * c[j] - side * cross[i][j]
            stiffness[o + 3 + i, o + j] += along * c[i] * n[j] + side * cross[i][j]
            stiffness[o + 3 + i, o + 3 + j] += along * c[i] * c[j] - side * b[i] * b[j] + tension * b[i] * n[j]


@compiled_lean
def _lever(bx: float, by: float, bz: float, out: Array) -> None:
    """Write G = (1, −[b]×), by which a cell's motion (6,) moves the end of an arm b: (3, 6)."""
    out[:, :] = 0.0
    out[0, 0] = out[1, 1] = out[2, 2] = 1.0
    out[0, 4], out[0, 5] = bz, -by
    out[1, 3], out[1, 5] = -bz, bx
    out[2, 3], out[2, 4] = by, -bx


@compiled_lean
def _add_crossed(
    o: int, p: int, d: Array, length: float, tension: float, slope: float, one: Array, other: Array, stiffness: Array
) -> None:
    """Add what the motion of one cell does to the load that a bond between two puts on the other.

    With d = L n, K as in `_add_bond` and both levers G (3, 6): −Gᵀ K G′, and its transpose.
    """
    side = tension / length
    along = (slope - side) / (length * length)
    for i in range(6):
        for j in range(6):
            total = 0.0
            for k in range(3):
                for m in range(3):
                    spring = along * d[k] * d[m] + (side if k == m else 0.0)
                    total -= one[k, i] * spring * other[m, j]
            stiffness[o + i, p + j] += total
            stiffness[p + j, o + i] += total


@compiled_where_present()
def _add_wall_contact(
    contacts: Contacts, cell: int, o: int, gap: float, bodies: Bodies, load: Array, stiffness: Array
) -> None:
    """Add the repulsion between the bumps of a cell and those of the wall, at a gap (µm) between smooth surfaces."""
    tip_gap = gap - bodies.roughness[cell] - bodies.wall_tips
    if tip_gap < contacts.reach:
        force, slope = value_and_slope(contacts.law, 0, 0, tip_gap)
        load[o + 2] += force
        stiffness[o + 2, o + 2] -= slope


@compiled_where_present()
def _add_pair_contacts(
    contacts: Contacts, group: int, bodies: Bodies, groups: Groups, centre: Array, moved: Array, load: Array,
    stiffness: Array,
) -> None:  # fmt: skip
    """Add the repulsion between the cells of a group, and between them and held ones."""
    for p in range(contacts.pair_first[group], contacts.pair_first[group + 1]):
        i, j = contacts.pairs[p, 0], contacts.pairs[p, 1]
        _add_pair_contact(i, j, contacts, bodies, groups.place, centre, moved, load, stiffness)


@compiled_lean
def _add_pair_contact(
    i: int, j: int, contacts: Contacts, bodies: Bodies, places: Indices, centre: Array, moved: Array, load: Array,
    stiffness: Array,
) -> None:  # fmt: skip
    """Add the repulsion between the bumps of two cells; a place of -1 is a held cell, which takes no load."""
    at_i, at_j = places[i], places[j]
    dx = centre[i, 0] - centre[j, 0]
    dy = centre[i, 1] - centre[j, 1]
    dz = centre[i, 2] - centre[j, 2]
    for place, sign in ((at_i, 1.0), (at_j, -1.0)):
        if place >= 0:
            dx += sign * moved[6 * place]
            dy += sign * moved[6 * place + 1]
            dz += sign * moved[6 * place + 2]
    distance = math.sqrt(dx * dx + dy * dy + dz * dz)
    tip_gap = distance - bodies.radius[i] - bodies.radius[j] - bodies.roughness[i] - bodies.roughness[j]
    if tip_gap >= contacts.reach:
        return
    force, slope = value_and_slope(contacts.law, 0, 0, tip_gap)
    n = (dx / distance, dy / distance, dz / distance)
    for place, sign in ((at_i, 1.0), (at_j, -1.0)):
        if place < 0:
            continue
        for a in range(3):
            load[6 * place + a] += sign * force * n[a]
            for b in range(3):
                k_ab = -(slope - force / distance) * n[a] * n[b] - (force / distance if a == b else 0.0)
                stiffness[6 * place + a, 6 * place + b] += k_ab
                other = at_j if place == at_i else at_i
                if other >= 0:
                    stiffness[6 * place + a, 6 * other + b] -= k_ab


@compiled_lean
def _pose(cell: int, place: int, moved: Array, centre: Array, turn: Array, bench: Bench) -> None:
    """Write a cell's place and rotation matrix, once it has moved, onto the bench; a place of -1 is a held cell."""
    middle, turned = bench.middle[cell], bench.middle_turn[cell]
    for i in range(3):
        middle[i] = centre[cell, i] + (moved[6 * place + i] if place >= 0 else 0.0)
        for j in range(3):
            turned[i, j] = turn[cell, i, j]
    if place >= 0:
        rx, ry, rz = moved[6 * place + 3], moved[6 * place + 4], moved[6 * place + 5]
        for j in range(3):
            turned[0, j], turned[1, j], turned[2, j] = turned_vector(
                turned[0, j], turned[1, j], turned[2, j], rx, ry, rz
            )


@compiled_lean
def _add_wall_bonds(cell: int, o: int, binding: Binding, bonds: Bonds, load: Array, stiffness: Array) -> None:
    """Add the loads of a cell's bonds to the wall."""
    # taken out of their tuples here, since doing so costs a hundred sums
    arms, first, slack_below, tables = (
        binding.molecules.arm, binding.species.first, binding.species.slack_below, binding.species.tables,
    )  # fmt: skip
    site, species, state, partner, anchor = bonds.site, bonds.species, bonds.state, bonds.partner, bonds.anchor
    centre, turn = binding.bench.middle[cell], binding.bench.middle_turn[cell]
    for bond in range(bonds.first[cell], bonds.first[cell] + bonds.number[cell]):
        ax, ay, az = arms[site[bond], 0], arms[site[bond], 1], arms[site[bond], 2]
        bx = turn[0, 0] * ax + turn[0, 1] * ay + turn[0, 2] * az
        by = turn[1, 0] * ax + turn[1, 1] * ay + turn[1, 2] * az
        bz = turn[2, 0] * ax + turn[2, 1] * ay + turn[2, 2] * az
        dx = centre[0] + bx - anchor[bond, 0]
        dy = centre[1] + by - anchor[bond, 1]
        dz = centre[2] + bz - anchor[bond, 2]
        slack = slack_below[species[bond]]
        square = dx * dx + dy * dy + dz * dz
        if partner[bond] < 0 and square > slack * abs(slack):
            length = math.sqrt(square)
            table = first[species[bond]] + state[bond]
            tension, slope = value_and_slope(tables, table, TENSION, length)
            _add_bond(o, bx, by, bz, dx, dy, dz, length, tension, slope, load, stiffness)


@compiled_lean
def _add_bridge(
    bond: int, cell: int, o: int, binding: Binding, bonds: Bonds, places: Indices, centre: Array, turn: Array,
    moved: Array, load: Array, stiffness: Array,
) -> None:  # fmt: skip
    """Add the loads of a bond between two cells on both; a partner that is held takes none."""
    molecules, species, bench = binding.molecules, binding.species, binding.bench
    middle, middle_turn, levers = bench.middle, bench.middle_turn, bench.levers
    partner = bonds.partner[bond]
    place = places[partner]
    _pose(partner, place, moved, centre, turn, bench)
    mine, theirs = (
        place_of(bonds.site[bond], middle[cell], middle_turn[cell], molecules),
        place_of(bonds.ligand[bond], middle[partner], middle_turn[partner], molecules),
    )
    d, b, e = bench.ends[0], bench.ends[1], bench.ends[2]
    for i in range(3):
        d[i] = mine[i] - theirs[i]
        b[i] = mine[i] - middle[cell, i]
        e[i] = theirs[i] - middle[partner, i]
    length = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    table = species.first[bonds.species[bond]] + bonds.state[bond]
    tension, slope = value_and_slope(species.tables, table, TENSION, length)
    if length == 0.0 or (tension == 0.0 and slope == 0.0):
        return
    _add_bond(o, b[0], b[1], b[2], d[0], d[1], d[2], length, tension, slope, load, stiffness)
    if place >= 0:
        p = 6 * place
        _add_bond(p, e[0], e[1], e[2], -d[0], -d[1], -d[2], length, tension, slope, load, stiffness)
        _lever(b[0], b[1], b[2], levers[0])
        _lever(e[0], e[1], e[2], levers[1])
        _add_crossed(o, p, d, length, tension, slope, levers[0], levers[1], stiffness)


@compiled_where_present()
def _add_bonds(
    binding: Binding, bonds: Bonds, cell: int, place: int, places: Indices, centre: Array, turn: Array, moved: Array,
    load: Array, stiffness: Array,
) -> None:  # fmt: skip
    """Add the loads of a cell's bonds, to the wall and to other cells."""
    if bonds.number[cell] > 0:
        _pose(cell, place, moved, centre, turn, binding.bench)
        _add_wall_bonds(cell, 6 * place, binding, bonds, load, stiffness)
        for k in range(bonds.bridges[cell]):
            bond = bonds.bridge[bonds.first[cell] + k]
            _add_bridge(bond, cell, 6 * place, binding, bonds, places, centre, turn, moved, load, stiffness)


@compiled_lean
def add_loads(group: int, system: System, bonds: Bonds, motion: Motion, turn: Array, work: Work) -> None:
    """Write all loads but the fluid's, and their stiffness, for the group moved and turned by `work.moved` (6n,)."""
    bodies, groups, contacts, places = system.bodies, system.groups, system.contacts, system.groups.place
    load, stiffness, moved = work.load, work.stiffness, work.moved
    start = groups.first[group]
    load[:] = 0.0
    stiffness[:, :] = 0.0
    for place in range(groups.first[group + 1] - start):
        cell = groups.cells[start + place]
        o = 6 * place
        for i in range(6):
            load[o + i] += bodies.external[cell, i]
        _add_wall_contact(contacts, cell, o, motion.gap[cell] + moved[o + 2], bodies, load, stiffness)
        _add_bonds(system.binding, bonds, cell, place, places, motion.centre, turn, moved, load, stiffness)
    _add_pair_contacts(contacts, group, bodies, groups, motion.centre, moved, load, stiffness)
