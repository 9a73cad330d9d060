"""Many sub-steps between two calls of the solver: react → loads → implicit motion → move, compiled."""

import math
from typing import NamedTuple

import numpy as np

from mpad_core.arrays import Array, Flags, Indices
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.streams import Word
from mpad_core.running.layout import Attached, Bonds, Dice, Limits, Motion, System
from mpad_core.running.moving import DONE, TOO_LONG, advance, attach, refresh_turns
from mpad_core.running.reacting import break_bonds, form_bonds, list_candidates
from mpad_core.running.resisting import is_positive_definite, resistance
from mpad_core.running.shaking import TICKS, draw, longest_part

REACHED, ROOM_NEEDED, NOT_POSITIVE, NO_BALANCE = 0, 1, 2, 3  # why a burst ended
_LISTING_MARGIN = 0.03  # µm: molecules this far out of reach are listed too, and the list stands until they could reach


@compiled
def _reach_height(system: System) -> float:
    """Give the height below which a molecule can bind."""
    reach = -math.inf
    for kind in range(system.species.reach.shape[0]):
        reach = max(reach, system.species.reach[kind])
    return system.bodies.wall_tips + reach


class _Listing(NamedTuple):
    """The molecules near the wall, and how long the list stands."""

    sites: Indices  # (S,) room for all
    first: Indices  # (N + 1,) each cell's first place in the list
    slack: Array  # (N,) µm, how much nearer a cell's molecules may come before the list is too short
    lever: Array  # (N,) µm, how far from the axis of the cell's turn the first to come would be
    height: Array  # (N,) µm, of the centre when the list was made
    turn: Array  # (N, 3) motion.turn at that time


@compiled
def _list_near(system: System, motion: Motion, turns: Array, listing: _Listing) -> None:
    """List every cell's molecules within reach of the wall or little more."""
    lowest = _reach_height(system) + _LISTING_MARGIN
    cells = listing.slack.shape[0]
    at = 0
    for cell in range(cells):
        listing.first[cell] = at
        shell = system.bodies.radius[cell] + system.bodies.roughness[cell]
        bottom = motion.centre[cell, 2] - shell
        depth = min(max(lowest - bottom, 0.0), shell)
        listing.slack[cell] = max(_LISTING_MARGIN, bottom - lowest + _LISTING_MARGIN)
        listing.lever[cell] = math.sqrt(depth * (2 * shell - depth)) + _LISTING_MARGIN
        listing.height[cell] = motion.centre[cell, 2]
        listing.turn[cell] = motion.turn[cell]
        if bottom < lowest:
            at = list_candidates(cell, lowest, system.molecules, motion, turns[cell], listing.sites, at)
    listing.first[cells] = at


@compiled
def _list_is_short(motion: Motion, listing: _Listing) -> bool:
    """Tell whether a molecule that is not listed may have come within reach."""
    short = False
    for cell in range(listing.slack.shape[0]):
        drop = max(listing.height[cell] - motion.centre[cell, 2], 0.0)
        turn_x = motion.turn[cell, 0] - listing.turn[cell, 0]
        turn_y = motion.turn[cell, 1] - listing.turn[cell, 1]
        nearer = drop + math.sqrt(turn_x * turn_x + turn_y * turn_y) * listing.lever[cell]
        short = short or nearer > listing.slack[cell]
    return short


@compiled
def _move_group(
    group: int, step: int, dt: float, system: System, bonds: Bonds, attached: Attached, motion: Motion, turns: Array,
    key: Word, noise: Array,
) -> int:  # fmt: skip
    """Move a group over sub-step `step`, in as many parts as it takes."""
    left = TICKS
    part = TICKS
    while left > 0:
        part = min(part, left)
        for k in range(system.thermal.energy.shape[0]):
            part = min(part, longest_part(group, dt, system.thermal.energy[k], system, motion.gap))
            draw(group, system, key, step, TICKS - left, TICKS - left + part, dt, noise)
        outcome = advance(group, dt * part / TICKS, system, bonds, attached, motion, noise)
        if outcome == DONE:
            left -= part
            part *= 2
            if left > 0:
                refresh_turns(motion, turns)
                attach(bonds, system.molecules, turns, attached)
        elif outcome == TOO_LONG and part > 1:
            part //= 2
        else:
            return NO_BALANCE
    return REACHED


@compiled
def _must_end(motion: Motion, limits: Limits) -> bool:
    """Tell whether the frozen coupling has been used far enough."""
    start = limits.start
    for cell in range(start.shape[0]):
        if motion.gap[cell] < limits.gap_low[cell] or motion.gap[cell] > limits.gap_high[cell]:
            return True
    for p in range(limits.pairs.shape[0]):
        i, j = limits.pairs[p, 0], limits.pairs[p, 1]
        square = 0.0
        for a in range(3):
            square += (motion.centre[i, a] - start[i, a] - motion.centre[j, a] + start[j, a]) ** 2
        if square > limits.pair_move[p] ** 2:
            return True
    return False


@compiled
def _refused_group(system: System, motion: Motion) -> int:
    """Give the first group whose frozen coupling no longer fits its heights; -1 if all do."""
    for group in range(system.groups.first.shape[0] - 1):
        m = 6 * (system.groups.first[group + 1] - system.groups.first[group])
        matrix, right = np.empty((m, m)), np.empty(m)
        resistance(group, system, motion.gap, matrix, right)
        if not is_positive_definite(matrix):
            return group
    return -1


@compiled
def burst(
    system: System, bonds: Bonds, bound: Flags, motion: Motion, limits: Limits, dice: Dice, events: Array,
    event_count: Indices,
) -> tuple[int, int, int]:  # fmt: skip
    """Run sub-steps until a limit is met; change `bonds`, `bound`, `motion` and fill `events`.

    Returns
    -------
    outcome
        REACHED; ROOM_NEEDED when bonds or events may not fit another sub-step, NOT_POSITIVE when the frozen coupling
        no longer fits: both before anything of that sub-step was done; NO_BALANCE when no sub-step however short
        balances the loads, which leaves the state unusable.
    sub_steps
        How many were done.
    group
        The group that was refused.
    """
    cells = motion.gap.shape[0]
    turns = np.empty((cells, 3, 3))
    listing = _Listing(
        np.empty(system.molecules.kind.shape[0], np.int64), np.zeros(cells + 1, np.int64), np.zeros(cells),
        np.zeros(cells), np.zeros(cells), np.zeros((cells, 3)),
    )  # fmt: skip
    room = bonds.cell.shape[0]
    attached = Attached(np.zeros(cells + 1, np.int64), np.zeros(room, np.int64), np.empty((room, 3)))
    noise = np.empty(system.thermal.energy.shape[0] * 6 * system.groups.cells.shape[0])
    groups = system.groups.first.shape[0] - 1
    dt = limits.sub_step
    for done in range(limits.most):
        step = dice.step + done
        refresh_turns(motion, turns)
        if done == 0 or _list_is_short(motion, listing):
            _list_near(system, motion, turns, listing)
        listed = listing.first[cells]
        if bonds.living[0] + listed > room or event_count[0] + bonds.living[0] + listed > events.shape[0]:
            return ROOM_NEEDED, done, -1
        unfit = _refused_group(system, motion)
        if unfit >= 0:
            return NOT_POSITIVE, done, unfit
        if listed > 0 or bonds.living[0] > 0:  # calls with nothing to do would cost a quarter of the sub-step
            break_bonds(bonds, bound, system, motion, turns, dice, step, dt, events, event_count)
            form_bonds(
                listing.sites, listing.first, bonds, bound, system, motion, turns, dice, step, dt, events, event_count
            )
            attach(bonds, system.molecules, turns, attached)
        for group in range(groups):
            outcome = _move_group(group, step, dt, system, bonds, attached, motion, turns, dice.key, noise)
            if outcome != REACHED:
                return outcome, done, group
        if _must_end(motion, limits):
            return REACHED, done + 1, -1
    return REACHED, limits.most, -1
