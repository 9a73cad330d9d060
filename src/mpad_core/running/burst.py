"""Many sub-steps between two calls of the solver: react → loads → implicit motion → move, compiled.

The groups of cells do not see each other within a burst, so each goes through a sub-step in parts of its own: as long
as the error of its motion allows, and never beyond its next event. A part is tried; where a clock runs out within it,
the group is moved only up to that moment, and what then happens is drawn from the rates there.
"""

import math

import numpy as np

from mpad_core.arrays import Array, Flags
from mpad_core.numerics.compiled import compiled, compiled_lean
from mpad_core.numerics.streams import Word
from mpad_core.running.clocks import EARLY, LATE, choice, drawn, share_until, used_until
from mpad_core.running.densities import holds
from mpad_core.running.layout import (
    Bonds,
    Candidates,
    Clocks,
    Dice,
    Limits,
    Motion,
    Progress,
    System,
    Trail,
    Work,
)
from mpad_core.running.listing import reaches_out, refresh
from mpad_core.running.moving import advance, commit, refresh_turns, step_explicitly
from mpad_core.running.reacting import happen, rates, slip_factors
from mpad_core.running.resisting import is_positive_definite, resistance
from mpad_core.running.shaking import TICKS, draw, longest_part

REACHED, ROOM_NEEDED, NOT_POSITIVE, NO_BALANCE = 0, 1, 2, 3  # why a burst ended
_STEEP = 3.0  # ratio of a sub-step's two rates beyond which two points are too few
_UNCERTAIN = 0.02  # of the hazard used up between two rates so different: by how much it may be wrong
_HELD_STEPS = 5  # explicit steps over which rates are taken as constant
_GROWTH = 4.0  # from one part of a sub-step to the next


@compiled
def _work_for(group: int, system: System) -> Work:
    """Make room for the sub-steps of a group."""
    cells = system.bodies.radius.shape[0]
    members = system.groups.cells[system.groups.first[group] : system.groups.first[group + 1]]
    m = 6 * members.shape[0]
    return Work(
        system.bodies.radius[members], np.empty((m, m)), np.empty((m, m)), np.empty(m), np.empty(m), np.empty(m),
        np.empty(m), np.empty(m), np.empty(m), np.zeros(m), np.empty(8),
        np.empty(system.species.site_kind.shape[0]), np.empty(m), np.empty(m), np.empty((2, 3, 6)), np.empty((3, 3)),
        np.empty(cells), np.empty((cells, 3)),
        np.empty((cells, 4)), np.empty((cells, 3)), np.empty((cells, 3, 3)), np.empty((cells, 3)),
        np.empty((cells, 3, 3)),
    )  # fmt: skip


@compiled_lean
def _between(cell: int, share: float, motion: Motion, turn: Array, work: Work) -> None:
    """Write a cell's place and turn at a share of the way that is being tried."""
    for i in range(3):
        work.middle[cell, i] = motion.centre[cell, i] + share * (work.centre[cell, i] - motion.centre[cell, i])
        for j in range(3):
            work.middle_turn[cell, i, j] = turn[cell, i, j] + share * (work.turn[cell, i, j] - turn[cell, i, j])


@compiled_lean
def _look_ahead(
    group: int, dt: float, system: System, bonds: Bonds, bound: Flags, motion: Motion, turn: Array, work: Work,
    listed: Candidates, clocks: Clocks, rate: float, ahead: Array,
) -> tuple[float, int]:  # fmt: skip
    """Look for the first event on the way that is being tried.

    Returns
    -------
    share
        Of the way, up to the event; 1 without one. Zero where the rates change too much over it for two points.
    cell
        Whose event it is; -1 without one. Each cell's two rates are written into `ahead` (N, 2).
    """
    groups = system.groups
    first, whose = 1.0, -1
    factor = work.factor
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        ahead[cell, 0] = ahead[cell, 1] = 0.0
        if bonds.count[cell] + listed.count[cell] == 0:
            continue
        place = k - groups.first[group]
        slip_factors(cell, work.velocity[6 * place : 6 * place + 6], motion.gap[cell], system, factor)
        for point, share in enumerate((EARLY, LATE)):
            _between(cell, share, motion, turn, work)
            ahead[cell, point], _, _ = rates(
                cell, math.inf, work.middle, work.middle_turn, system, bonds, bound, listed, factor
            )
        low, high = min(ahead[cell, 0], ahead[cell, 1]), max(ahead[cell, 0], ahead[cell, 1])
        if high > _STEEP * low and _UNCERTAIN * (high - low) * dt > rate:
            return -1.0, -1
        share = share_until(clocks.left[cell], ahead[cell, 0], ahead[cell, 1], dt)
        if share < first:
            first, whose = share, cell
    return first, whose


@compiled_lean
def _wind(
    group: int, share: float, dt: float, whose: int, system: System, key: Word, clocks: Clocks, ahead: Array
) -> None:
    """Take what the first `share` of a way of dt uses up from a group's clocks; wind that of the cell whose event it is."""
    for k in range(system.groups.first[group], system.groups.first[group + 1]):
        cell = system.groups.cells[k]
        if cell == whose:
            clocks.count[cell] += 1
            clocks.left[cell] = drawn(key, system.molecules.owner[cell], clocks.count[cell])
        else:
            clocks.left[cell] -= used_until(share, ahead[cell, 0], ahead[cell, 1], dt)


@compiled_lean
def _let_happen(
    cell: int, velocity: Array, factor: Array, step: int, time: float, key: Word, system: System, bonds: Bonds, bound: Flags,
    motion: Motion, turn: Array, listed: Candidates, clocks: Clocks, progress: Progress, events: Array,
) -> None:  # fmt: skip
    """Draw which event a cell's clock stands for, from the rates of the moment, and let it happen.

    The clock has been wound already, so the draw is the one that belongs to the number before.
    """
    slip_factors(cell, velocity, motion.gap[cell], system, factor)
    total, _, _ = rates(cell, math.inf, motion.centre, turn, system, bonds, bound, listed, factor)
    share = choice(key, system.molecules.owner[cell], clocks.count[cell] - 1)
    _, which, excess = rates(cell, share * total, motion.centre, turn, system, bonds, bound, listed, factor)
    if which >= 0:
        happen(
            cell, which, excess, step, time, motion.centre, turn, key, system, bonds, bound, listed, clocks, progress,
            events,
        )  # fmt: skip


@compiled_lean
def _is_ready(
    cell: int, system: System, bonds: Bonds, motion: Motion, turn: Array, dice: Dice, listed: Candidates,
    progress: Progress, events: Array,
) -> bool:  # fmt: skip
    """Bring a cell's lists up to date; tell whether there is room for them and for an event."""
    if system.species.site_kind.shape[0] == 0:
        return True
    if bonds.first[cell] + bonds.count[cell] >= bonds.first[cell + 1] or progress.events[0] >= events.shape[0]:
        return False
    return refresh(cell, system, motion, turn[cell], dice, listed)


@compiled_lean
def _strays(group: int, system: System, motion: Motion, work: Work, listed: Candidates) -> int:
    """Tell whether the way that is tried leads beyond what is listed: 1 if new lists would do, 2 if it is too long."""
    stray = 0
    if system.species.site_kind.shape[0] > 0:
        for k in range(system.groups.first[group], system.groups.first[group + 1]):
            stray = max(stray, reaches_out(system.groups.cells[k], system, motion, work, listed))
    return stray


@compiled_lean
def _move_group(
    group: int, system: System, bonds: Bonds, bound: Flags, motion: Motion, turn: Array, limits: Limits, dice: Dice,
    listed: Candidates, clocks: Clocks, progress: Progress, events: Array, work: Work, ahead: Array,
) -> int:  # fmt: skip
    """Move a group to the end of the sub-step that is under way, in as many parts as it takes."""
    step = dice.step + progress.beats[0] * dice.stride
    first, last = system.groups.first[group], system.groups.first[group + 1]
    shaken = system.thermal.energy.shape[0] > 0
    while progress.tick[group] < TICKS:
        for k in range(first, last):
            cell = system.groups.cells[k]
            if not _is_ready(cell, system, bonds, motion, turn, dice, listed, progress, events):
                return ROOM_NEEDED
        tick = progress.tick[group]
        part = min(progress.part[group], TICKS - tick)
        for k in range(system.thermal.energy.shape[0]):
            part = min(part, longest_part(group, limits.sub_step, system.thermal.energy[k], system, motion.gap))
            draw(group, system, dice.key, step, tick, tick + part, limits.sub_step, work.noise)
        dt = limits.sub_step * part / TICKS
        error = advance(group, dt, system, bonds, motion, turn, work)
        stray = 0 if error == math.inf else _strays(group, system, motion, work, listed)
        if stray == 1:
            for k in range(first, last):
                listed.near_count[system.groups.cells[k]] = -1
            continue
        if error == math.inf or stray == 2 or (error > limits.error and not shaken):
            if part == 1:
                return NO_BALANCE
            shorter = 0.5 if error == math.inf or stray == 2 else max(0.9 * math.sqrt(limits.error / error), 0.1)
            progress.part[group] = max(int(part * shorter), 1)
            continue
        share, whose = _look_ahead(
            group, dt, system, bonds, bound, motion, turn, work, listed, clocks, limits.rate, ahead
        )
        if share < 0 and part > 1:
            progress.part[group] = part // 2
            continue
        done = part
        if whose >= 0:
            done = min(max(math.ceil(share * part), 1), part)
            if done < part:
                for k in range(system.thermal.energy.shape[0]):
                    draw(group, system, dice.key, step, tick, tick + done, limits.sub_step, work.noise)
                if advance(group, limits.sub_step * done / TICKS, system, bonds, motion, turn, work) == math.inf:
                    progress.part[group] = max(done // 2, 1)
                    continue
        _wind(group, abs(share), dt, whose, system, dice.key, clocks, ahead)
        commit(group, limits.sub_step * done / TICKS, system, motion, turn, work)
        if whose >= 0:
            place = 6 * system.groups.place[whose]
            time = (tick + share * part) / TICKS
            _let_happen(
                whose, work.velocity[place : place + 6], work.factor, step, time, dice.key, system, bonds, bound, motion, turn,
                listed, clocks, progress, events,
            )  # fmt: skip
        longer = _GROWTH if error <= 0.05 * limits.error or shaken else max(0.9 * math.sqrt(limits.error / error), 0.5)
        progress.tick[group] = tick + done
        progress.part[group] = min(int(part * longer) + 1, TICKS)
    return REACHED


@compiled_lean
def _move_explicitly(
    group: int, system: System, bonds: Bonds, bound: Flags, motion: Motion, turn: Array, limits: Limits, dice: Dice,
    listed: Candidates, clocks: Clocks, progress: Progress, events: Array, work: Work, ahead: Array,
) -> int:  # fmt: skip
    """Move a group to the end of the sub-step that is under way by explicit steps, for comparison.

    Rates are those of the start of every few steps, and an event happens at the end of the step in which it is due.
    """
    step = dice.step + progress.beats[0] * dice.stride
    first, last = system.groups.first[group], system.groups.first[group + 1]
    factor = work.factor
    steps = max(round(limits.sub_step / limits.euler[0]), 1)
    dt = limits.sub_step / steps
    while progress.tick[group] < TICKS:
        done = progress.part[group] % TICKS  # steps of this sub-step
        for k in range(first, last):
            cell = system.groups.cells[k]
            if done % _HELD_STEPS == 0 or ahead[cell, 1] < 0:
                if not _is_ready(cell, system, bonds, motion, turn, dice, listed, progress, events):
                    return ROOM_NEEDED
                slip_factors(cell, motion.velocity[cell], motion.gap[cell], system, factor)
                ahead[cell, 0], _, _ = rates(cell, math.inf, motion.centre, turn, system, bonds, bound, listed, factor)
                ahead[cell, 1] = 0.0
            clocks.left[cell] -= ahead[cell, 0] * dt
        step_explicitly(group, dt, system, bonds, motion, turn, work)
        commit(group, dt, system, motion, turn, work)
        for k in range(first, last):
            cell = system.groups.cells[k]
            if not clocks.left[cell] > 0:
                clocks.count[cell] += 1
                clocks.left[cell] = drawn(dice.key, system.molecules.owner[cell], clocks.count[cell])
                _let_happen(
                    cell, motion.velocity[cell], factor, step, (done + 1) / steps, dice.key, system, bonds, bound, motion,
                    turn, listed, clocks, progress, events,
                )  # fmt: skip
                ahead[cell, 1] = -1.0
        progress.part[group] = done + 1 if done + 1 < steps else TICKS
        progress.tick[group] = (done + 1) * (TICKS // steps) if done + 1 < steps else TICKS
    return REACHED


@compiled_lean
def _wait(
    cell: int, slot: int, velocity: Array, factor: Array, system: System, bonds: Bonds, bound: Flags, motion: Motion, turn: Array, limits: Limits,
    dice: Dice, listed: Candidates, clocks: Clocks, progress: Progress, events: Array,
) -> int:  # fmt: skip
    """Let happen what happens to a cell that does not move, up to the end of the sub-step that is under way."""
    step = dice.step + progress.beats[0] * dice.stride
    while progress.tick[slot] < TICKS:
        if not _is_ready(cell, system, bonds, motion, turn, dice, listed, progress, events):
            return ROOM_NEEDED
        slip_factors(cell, velocity, motion.gap[cell], system, factor)
        total, _, _ = rates(cell, math.inf, motion.centre, turn, system, bonds, bound, listed, factor)
        part = TICKS - progress.tick[slot]
        dt = limits.sub_step * part / TICKS
        share = share_until(clocks.left[cell], total, total, dt)
        if share > 1:
            clocks.left[cell] -= total * dt
            progress.tick[slot] = TICKS
            continue
        clocks.count[cell] += 1
        clocks.left[cell] = drawn(dice.key, system.molecules.owner[cell], clocks.count[cell])
        time = (progress.tick[slot] + share * part) / TICKS
        _let_happen(
            cell,
            velocity,
            factor,
            step,
            time,
            dice.key,
            system,
            bonds,
            bound,
            motion,
            turn,
            listed,
            clocks,
            progress,
            events,
        )
        progress.tick[slot] += min(max(math.ceil(share * part), 1), part)
    return REACHED


@compiled_lean
def _must_end(system: System, motion: Motion, limits: Limits) -> bool:
    """Tell whether the frozen coupling has been used far enough, or a cell is about to leave what is known of the wall."""
    start = limits.start
    for cell in range(start.shape[0]):
        if not holds(system.densities, cell, motion.centre[cell, 0], motion.centre[cell, 1]):
            return True
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


@compiled_lean
def _fits(group: int, system: System, motion: Motion, work: Work) -> bool:
    """Tell whether a group's frozen coupling fits its heights."""
    resistance(group, system, motion.gap, work.functions, work.matrix, work.right)
    return is_positive_definite(work.matrix)


@compiled
def _note(motion: Motion, stride: int, trail: Trail, progress: Progress) -> None:
    """Note where the cells are."""
    at = progress.trail[0]
    trail.step[at] = progress.beats[0] * stride
    trail.centre[at] = motion.centre
    trail.gap[at] = motion.gap
    trail.orientation[at] = motion.orientation
    trail.turn[at] = motion.turn
    progress.trail[0] = at + 1


@compiled
def burst(
    system: System, bonds: Bonds, bound: Flags, motion: Motion, limits: Limits, dice: Dice, listed: Candidates,
    clocks: Clocks, progress: Progress, trail: Trail, events: Array,
) -> tuple[int, int]:  # fmt: skip
    """Run sub-steps until a limit is met; change all that is not frozen, and fill `trail` and `events`.

    Returns
    -------
    outcome
        REACHED; ROOM_NEEDED where bonds, candidates or events may not fit, after which the burst may be called again,
        with more room, and goes on; NOT_POSITIVE when the frozen coupling no longer fits, at the end of a sub-step;
        NO_BALANCE when no part of a sub-step however short balances the loads, which leaves the state unusable.
    group
        The group that was refused.
    """
    cells, groups = motion.gap.shape[0], system.groups.first.shape[0] - 1
    turn = np.empty((cells, 3, 3))
    refresh_turns(motion, turn)
    ahead = np.zeros((cells, 2))
    at_rest, factor = np.zeros(6), np.empty(system.species.site_kind.shape[0])
    listed.near_count[:] = -1
    works = [_work_for(group, system) for group in range(groups)]
    while progress.beats[0] < limits.most:
        for group in range(groups):
            if progress.tick[group] == 0 and not _fits(group, system, motion, works[group]):
                return NOT_POSITIVE, group
            if limits.euler.shape[0] == 0:
                outcome = _move_group(
                    group, system, bonds, bound, motion, turn, limits, dice, listed, clocks, progress, events,
                    works[group], ahead,
                )  # fmt: skip
            else:
                outcome = _move_explicitly(
                    group, system, bonds, bound, motion, turn, limits, dice, listed, clocks, progress, events,
                    works[group], ahead,
                )  # fmt: skip
            if outcome != REACHED:
                return outcome, group
        for cell in range(cells):
            if system.groups.place[cell] < 0:
                outcome = _wait(
                    cell, groups + cell, at_rest, factor, system, bonds, bound, motion, turn, limits, dice, listed, clocks, progress,
                    events,
                )  # fmt: skip
                if outcome != REACHED:
                    return outcome, -1
        progress.beats[0] += 1
        progress.tick[:] = 0
        ends = _must_end(system, motion, limits) or progress.beats[0] == limits.most
        if ends or progress.beats[0] % trail.every == 0:
            _note(motion, dice.stride, trail, progress)
        if ends:
            break
    return REACHED, -1
