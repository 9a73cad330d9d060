"""The motion of one group of cells over a sub-step: items (iii) to (v) of King & Hammer (PNAS 2001), compiled.

Backward Euler for  r_i(h_i) U_i + Σ_j C_ij U_j = F_i + f_i(h_i) + k_i + g_i : bonds and repulsion are taken at the end
of the sub-step by Newton's method with their full stiffness (taut or slack, geometric), the exact wall resistance r and
the ambient load f at the height that the last velocity gives for its middle, so that what no stiff load rules is moved
to second order. Semi-implicit short cuts give rolling speeds several times too high. Explicit Euler is there for
comparison; it needs steps below the fastest relaxation, 0.2 µs for bonds of 100 pN/nm.

With thermal motion the random load of the sub-step stands on the right, and r and f are taken at the heights that the
random load alone would reach in half the sub-step; see `shaking`.
"""

import math

import numpy as np

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled_inline, compiled_lean, compiled_where_present, is_present
from mpad_core.numerics.rotations import matrix_of, turned, turned_vector
from mpad_core.numerics.tables import value_and_slope
from mpad_core.running.layout import Bench, Binding, Bodies, Bonds, Contacts, Groups, Motion, System, Work
from mpad_core.running.places import place_of
from mpad_core.running.reacting import TENSION
from mpad_core.running.resisting import resistance, solve_in_place
from mpad_core.running.shaking import GAP_SHARE, SHAKEN_SHARE, shake

_MOST_ITERATIONS = 25
_CLOSE = 1e-6  # µm: Newton has converged when its step moves no surface by more
LARGEST_TURN = 0.1  # rad at once
_LEAD_SHARE = 0.1  # of the gap to the wall, which the prediction for a sub-step's middle may change


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
def _add_loads(group: int, system: System, bonds: Bonds, motion: Motion, turn: Array, work: Work) -> None:
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


@compiled_lean
def _surface_move(change: Array, dt: float, radii: Array) -> float:
    """Give the largest displacement of a surface that velocities (6n,) make in dt; infinity where one is no number."""
    largest = 0.0
    for i in range(change.shape[0]):
        lever = 1.0 if i % 6 < 3 else radii[i // 6]
        move = abs(change[i]) * dt * lever
        if not math.isfinite(move):
            return math.inf
        largest = max(largest, move)
    return largest


@compiled_lean
def _newton(group: int, dt: float, system: System, bonds: Bonds, motion: Motion, turn: Array, work: Work) -> bool:
    """Solve for the velocities (6n,) at which fluid and loads balance at the sub-step's end; tell whether it did."""
    velocity, load, matrix, stiffness = work.velocity, work.load, work.matrix, work.stiffness
    residual, change = work.residual, work.change
    m = velocity.shape[0]
    best = np.inf
    share = 1.0
    for _ in range(_MOST_ITERATIONS):
        for i in range(m):
            work.moved[i] = dt * velocity[i]
        _add_loads(group, system, bonds, motion, turn, work)
        norm = 0.0
        for i in range(m):
            residual[i] = work.right[i] + load[i]
            for j in range(m):
                residual[i] -= matrix[i, j] * velocity[j]
            norm += (residual[i] / (1.0 if i % 6 < 3 else work.radius[i // 6])) ** 2
        if not norm < 1e60:
            return False
        if norm > best and share > 0.01:  # went too far: take half of that step back
            share *= 0.5
            for i in range(m):
                velocity[i] -= share * change[i]
            continue
        best = norm
        share = 1.0
        for i in range(m):
            change[i] = residual[i]
            for j in range(m):
                stiffness[i, j] = matrix[i, j] + dt * stiffness[i, j]
        solve_in_place(stiffness, change)
        for i in range(m):
            velocity[i] += change[i]
        if _surface_move(change, dt, work.radius) < _CLOSE:
            return True
    return False


@compiled_lean
def _lead(group: int, dt: float, system: System, motion: Motion, gaps: Array) -> None:
    """Write the gaps that a group's last velocities give for the middle of a sub-step, into those of all cells."""
    for place in range(system.groups.first[group], system.groups.first[group + 1]):
        cell = system.groups.cells[place]
        most = _LEAD_SHARE * (motion.gap[cell] + system.bodies.wall_offset)
        gaps[cell] = motion.gap[cell] + min(max(0.5 * dt * motion.velocity[cell, 2], -most), most)


@compiled_lean
def advance(group: int, dt: float, system: System, bonds: Bonds, motion: Motion, turn: Array, work: Work) -> float:
    """Try to move a group over dt; write where it ends into `work`.

    With thermal motion `work.noise` (6n,) are the increments (s^½) of the Brownian paths over dt.

    Returns
    -------
    error
        What its velocity changes by over the sub-step, times dt/2 (µm, of the surface): the local error of Euler's
        methods. Infinity where no balance was found, or the cell would move too far at once.
    """
    groups = system.groups
    start, n = groups.first[group], groups.first[group + 1] - groups.first[group]
    velocity = work.velocity
    share = SHAKEN_SHARE if is_present(system.thermal) else GAP_SHARE
    if not is_present(system.thermal):
        _lead(group, dt, system, motion, work.gaps)
        resistance(group, system.bodies, system.groups, work.gaps, work.functions, work.matrix, work.right)
    if not shake(system.thermal, group, dt, system.bodies, system.groups, motion.gap, work):
        return math.inf
    for place in range(n):
        for i in range(6):
            velocity[6 * place + i] = motion.velocity[groups.cells[start + place], i]
    if not _newton(group, dt, system, bonds, motion, turn, work):
        return math.inf
    for place in range(n):
        cell, o = groups.cells[start + place], 6 * place
        if -velocity[o + 2] * dt > share * (motion.gap[cell] + system.bodies.wall_offset):
            return math.inf
        if math.sqrt(velocity[o + 3] ** 2 + velocity[o + 4] ** 2 + velocity[o + 5] ** 2) * dt > LARGEST_TURN:
            return math.inf
        for i in range(6):
            work.change[o + i] = velocity[o + i] - motion.velocity[cell, i]
    _try_out(group, dt, system.groups, motion, work)
    return 0.5 * _surface_move(work.change, dt, work.radius)


@compiled_lean
def _try_out(group: int, dt: float, groups: Groups, motion: Motion, work: Work) -> None:
    """Write where the group's cells are after dt."""
    for place in range(work.radius.shape[0]):
        cell, o = groups.cells[groups.first[group] + place], 6 * place
        velocity = work.velocity
        for i in range(3):
            work.centre[cell, i] = motion.centre[cell, i] + dt * velocity[o + i]
            work.rotation[cell, i] = motion.turn[cell, i] + dt * velocity[o + 3 + i]
        turned(
            motion.orientation[cell], dt * velocity[o + 3], dt * velocity[o + 4], dt * velocity[o + 5],
            work.orientation[cell],
        )  # fmt: skip
        matrix_of(work.orientation[cell], work.turn[cell])


@compiled_lean
def commit(group: int, dt: float, groups: Groups, motion: Motion, turn: Array, work: Work) -> None:
    """Let the group be where `advance` over dt has taken it."""
    for place in range(work.radius.shape[0]):
        cell, o = groups.cells[groups.first[group] + place], 6 * place
        motion.gap[cell] += dt * work.velocity[o + 2]
        for i in range(6):
            motion.velocity[cell, i] = work.velocity[o + i]
            motion.impulse[cell, i] += dt * work.load[o + i]
        for i in range(3):
            motion.centre[cell, i] = work.centre[cell, i]
            motion.turn[cell, i] = work.rotation[cell, i]
            for j in range(3):
                turn[cell, i, j] = work.turn[cell, i, j]
        for i in range(4):
            motion.orientation[cell, i] = work.orientation[cell, i]


@compiled_lean
def step_explicitly(
    group: int, dt: float, system: System, bonds: Bonds, motion: Motion, turn: Array, work: Work
) -> None:
    """Write into `work` the velocities that balance the loads of the start, and where they take a group in dt."""
    resistance(group, system.bodies, system.groups, motion.gap, work.functions, work.matrix, work.right)
    work.moved[:] = 0.0
    _add_loads(group, system, bonds, motion, turn, work)
    for i in range(work.velocity.shape[0]):
        work.velocity[i] = work.right[i] + work.load[i]
    solve_in_place(work.matrix, work.velocity)
    _try_out(group, dt, system.groups, motion, work)


@compiled_lean
def refresh_turns(motion: Motion, turns: Array) -> None:
    """Write the rotation matrices of all cells."""
    for cell in range(turns.shape[0]):
        matrix_of(motion.orientation[cell], turns[cell])
