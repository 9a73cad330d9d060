"""The implicit motion of one group of cells over a sub-step: items (iii) to (v) of King & Hammer (PNAS 2001), compiled.

Backward Euler for  r_i(h_i) U_i + Σ_j C_ij U_j = F_i + f_i(h_i) + k_i + g_i : bonds and repulsion are taken at the end
of the sub-step by Newton's method with their full stiffness (taut or slack, geometric), the exact wall resistance r and
the ambient load f at its start. Semi-implicit short cuts give rolling speeds several times too high.

With thermal motion the random load of the sub-step stands on the right, and r and f are taken at the heights that the
random load alone would reach in half the sub-step; see `shaking`.
"""

import math

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.rotations import matrix_of, turned, turned_vector
from mpad_core.numerics.tables import Tables, value_and_slope
from mpad_core.running.layout import Attached, Bonds, Molecules, Motion, Species, System
from mpad_core.running.reacting import TENSION
from mpad_core.running.resisting import resistance, solve_in_place
from mpad_core.running.shaking import GAP_SHARE, SHAKEN_SHARE, shake

DONE, TOO_LONG = 0, 1
_MOST_ITERATIONS = 25
_CLOSE = 1e-8  # µm: Newton has converged when its step moves no surface by more
LARGEST_TURN = 0.1  # rad in one sub-step


@compiled
def _add_bond(
    arm: Array, px: float, py: float, pz: float, anchor: Array, kind: int, species: Species,
    load: Array, stiffness: Array,
) -> None:  # fmt: skip
    """Add one bond's load on its cell (6,), and minus the load's derivative by displacement and turn (6, 6).

    A bond of tension T along n, whose end is at b from the centre, pulls with F = −T n. The end moves by δx − b × δθ,
    so with K = (T′ − T/L) n nᵀ + (T/L) 1 and c = b × n the four blocks are K; (T′ − T/L) n cᵀ − (T/L) [b]×; its
    transpose; and (T′ − T/L) c cᵀ − (T/L) [b]×² + T [n]× [b]×, the last part because the arm turns with the cell.
    """
    dx, dy, dz = px - anchor[0], py - anchor[1], pz - anchor[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    tension, slope = value_and_slope(species.tables, kind, TENSION, length)
    if (tension == 0.0 and slope == 0.0) or length == 0.0:
        return
    bx, by, bz = arm[0], arm[1], arm[2]
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
        load[i] -= tension * n[i]
        load[3 + i] -= tension * c[i]
        stiffness[i, i] += side
        stiffness[3 + i, 3 + i] += side * square - tension * level
        for j in range(3):
            stiffness[i, j] += along * n[i] * n[j]
            stiffness[i, 3 + j] += along * n[i] * c[j] - side * cross[i][j]
            stiffness[3 + i, j] += along * c[i] * n[j] + side * cross[i][j]
            stiffness[3 + i, 3 + j] += along * c[i] * c[j] - side * b[i] * b[j] + tension * b[i] * n[j]


@compiled
def _add_wall_contact(tip_gap: float, law: Tables, load: Array, stiffness: Array) -> None:
    """Add the repulsion between a cell's bumps and the wall's."""
    force, slope = value_and_slope(law, 0, 0, tip_gap)
    load[2] += force
    stiffness[2, 2] -= slope


@compiled
def _add_pair_contact(
    i: int, j: int, moved: Array, system: System, motion: Motion, load: Array, stiffness: Array
) -> None:
    """Add the repulsion between the bumps of two cells; a place of -1 is a held cell, which takes no load."""
    bodies, contacts = system.bodies, system.contacts
    at_i, at_j = system.groups.place[i], system.groups.place[j]
    dx = motion.centre[i, 0] - motion.centre[j, 0]
    dy = motion.centre[i, 1] - motion.centre[j, 1]
    dz = motion.centre[i, 2] - motion.centre[j, 2]
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


@compiled
def _add_loads(
    group: int, moved: Array, system: System, bonds: Bonds, attached: Attached, motion: Motion,
    load: Array, stiffness: Array,
) -> None:  # fmt: skip
    """Add all loads but the fluid's, and their stiffness, for the group displaced and turned by `moved` (6n,)."""
    bodies, groups, contacts = system.bodies, system.groups, system.contacts
    start = groups.first[group]
    arm = np.empty(3)
    for place in range(groups.first[group + 1] - start):
        cell = groups.cells[start + place]
        o = 6 * place
        own, own_stiffness = load[o : o + 6], stiffness[o : o + 6, o : o + 6]
        own += bodies.external[cell]
        tip_gap = motion.gap[cell] + moved[o + 2] - bodies.roughness[cell] - bodies.wall_tips
        if tip_gap < contacts.reach:
            _add_wall_contact(tip_gap, contacts.law, own, own_stiffness)
        for b in range(attached.first[cell], attached.first[cell + 1]):
            a = attached.arm[b]
            arm[0], arm[1], arm[2] = turned_vector(a[0], a[1], a[2], moved[o + 3], moved[o + 4], moved[o + 5])
            x = motion.centre[cell, 0] + moved[o] + arm[0]
            y = motion.centre[cell, 1] + moved[o + 1] + arm[1]
            z = motion.centre[cell, 2] + moved[o + 2] + arm[2]
            bond = attached.order[b]
            _add_bond(arm, x, y, z, bonds.anchor[bond], bonds.species[bond], system.species, own, own_stiffness)
    for p in range(contacts.pair_first[group], contacts.pair_first[group + 1]):
        _add_pair_contact(contacts.pairs[p, 0], contacts.pairs[p, 1], moved, system, motion, load, stiffness)


@compiled
def attach(bonds: Bonds, molecules: Molecules, turns: Array, out: Attached) -> None:
    """Sort the living bonds by cell, oldest first, and turn their arms into space."""
    cells = out.first.shape[0] - 1
    out.first[:] = 0
    for bond in range(bonds.living[0]):
        out.first[bonds.cell[bond] + 1] += 1
    for cell in range(cells):
        out.first[cell + 1] += out.first[cell]
    at = out.first[:cells].copy()
    for bond in range(bonds.living[0]):
        cell = bonds.cell[bond]
        b = at[cell]
        at[cell] += 1
        out.order[b] = bond
        turn = turns[cell]
        arm = molecules.arm[bonds.site[bond]]
        for i in range(3):
            out.arm[b, i] = turn[i, 0] * arm[0] + turn[i, 1] * arm[1] + turn[i, 2] * arm[2]


@compiled
def _largest_move(change: Array, dt: float, radii: Array) -> float:
    """Give the largest displacement of a surface that a change of the velocities makes in dt."""
    largest = 0.0
    for i in range(change.shape[0]):
        lever = 1.0 if i % 6 < 3 else radii[i // 6]
        move = abs(change[i]) * dt * lever
        if not math.isfinite(move):
            return math.inf
        largest = max(largest, move)
    return largest


@compiled
def _newton(
    group: int, dt: float, matrix: Array, right: Array, system: System, bonds: Bonds, attached: Attached,
    motion: Motion, velocity: Array, load: Array,
) -> bool:  # fmt: skip
    """Solve for the velocities (6n,) at which fluid and loads balance at the sub-step's end; tell whether it did."""
    m = velocity.shape[0]
    groups = system.groups
    radii = system.bodies.radius[groups.cells[groups.first[group] : groups.first[group + 1]]]
    stiffness = np.empty((m, m))
    residual = np.empty(m)
    step = np.zeros(m)
    best = np.inf
    share = 1.0
    for _ in range(_MOST_ITERATIONS):
        load[:] = 0.0
        stiffness[:, :] = 0.0
        _add_loads(group, dt * velocity, system, bonds, attached, motion, load, stiffness)
        norm = 0.0
        for i in range(m):
            residual[i] = right[i] + load[i]
            for j in range(m):
                residual[i] -= matrix[i, j] * velocity[j]
            norm += (residual[i] / (1.0 if i % 6 < 3 else radii[i // 6])) ** 2
        if not norm < 1e60:
            return False
        if norm > best and share > 0.01:  # went too far: take half of that step back
            share *= 0.5
            velocity -= share * step
            continue
        best = norm
        share = 1.0
        for i in range(m):
            for j in range(m):
                stiffness[i, j] = matrix[i, j] + dt * stiffness[i, j]
        step[:] = residual
        solve_in_place(stiffness, step)
        velocity += step
        if _largest_move(step, dt, radii) < _CLOSE:
            return True
    return False


@compiled
def advance(
    group: int, dt: float, system: System, bonds: Bonds, attached: Attached, motion: Motion, noise: Array
) -> int:
    """Move a group over dt; give DONE, or what stopped it, in which case nothing has changed.

    `noise` (6n,) are the increments (s^½) of the Brownian paths over dt; not read where there is no thermal motion.
    """
    groups = system.groups
    start, n = groups.first[group], groups.first[group + 1] - groups.first[group]
    matrix = np.empty((6 * n, 6 * n))
    right, load, velocity = np.empty(6 * n), np.empty(6 * n), np.empty(6 * n)
    resistance(group, system, motion.gap, matrix, right)
    share = GAP_SHARE
    for k in range(system.thermal.energy.shape[0]):
        share = SHAKEN_SHARE
        if not shake(group, dt, system.thermal.energy[k], noise, system, motion.gap, matrix, right):
            return TOO_LONG
    for place in range(n):
        velocity[6 * place : 6 * place + 6] = motion.velocity[groups.cells[start + place]]
    if not _newton(group, dt, matrix, right, system, bonds, attached, motion, velocity, load):
        return TOO_LONG
    for place in range(n):
        gap = motion.gap[groups.cells[start + place]]
        if -velocity[6 * place + 2] * dt > share * (gap + system.bodies.wall_offset):
            return TOO_LONG
        if math.sqrt(np.sum(velocity[6 * place + 3 : 6 * place + 6] ** 2)) * dt > LARGEST_TURN:
            return TOO_LONG
    for place in range(n):
        cell = groups.cells[start + place]
        own = velocity[6 * place : 6 * place + 6]
        motion.velocity[cell] = own
        motion.centre[cell] += dt * own[:3]
        motion.gap[cell] += dt * own[2]
        turned(motion.orientation[cell], dt * own[3], dt * own[4], dt * own[5], motion.orientation[cell])
        motion.turn[cell] += dt * own[3:]
        motion.impulse[cell] += dt * load[6 * place : 6 * place + 6]
    return DONE


@compiled
def refresh_turns(motion: Motion, turns: Array) -> None:
    """Write the rotation matrices of all cells."""
    for cell in range(turns.shape[0]):
        matrix_of(motion.orientation[cell], turns[cell])
