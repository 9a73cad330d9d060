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

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled_lean, is_present
from mpad_core.numerics.rotations import matrix_of, turned
from mpad_core.running.layout import Bonds, Groups, Motion, System, Work
from mpad_core.running.pulling import add_loads
from mpad_core.running.resisting import resistance, solve_in_place
from mpad_core.running.shaking import GAP_SHARE, SHAKEN_SHARE, shake

_MOST_ITERATIONS = 25
_CLOSE = 1e-6  # µm: Newton has converged when its step moves no surface by more
LARGEST_TURN = 0.1  # rad at once
_LEAD_SHARE = 0.1  # of the gap to the wall, which the prediction for a sub-step's middle may change


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
        add_loads(group, system, bonds, motion, turn, work)
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
    add_loads(group, system, bonds, motion, turn, work)
    for i in range(work.velocity.shape[0]):
        work.velocity[i] = work.right[i] + work.load[i]
    solve_in_place(work.matrix, work.velocity)
    _try_out(group, dt, system.groups, motion, work)


@compiled_lean
def refresh_turns(motion: Motion, turns: Array) -> None:
    """Write the rotation matrices of all cells."""
    for cell in range(turns.shape[0]):
        matrix_of(motion.orientation[cell], turns[cell])
