"""Many sub-steps between two calls of the solver: react → loads → implicit motion → move, compiled.

The groups of cells do not see each other within a burst, so each goes through a sub-step in parts of its own: as long
as the error of its motion allows, and never beyond its next event. A part is tried; where a clock runs out within it,
the group is moved only up to that moment, and what then happens is drawn from the rates there.
"""

import math

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import (
    compiled,
    compiled_lean,
    compiled_where_present,
    compiled_within,
    is_present,
)
from mpad_core.numerics.streams import Word
from mpad_core.running.awaiting import (
    all_ready,
    bonds_of,
    happen_explicitly,
    let_happen,
    look_ahead,
    see_ahead,
    strays,
    use_up,
    use_up_explicitly,
    wait,
)
from mpad_core.running.densities import holds
from mpad_core.running.layout import (
    Binding,
    Bodies,
    Bonds,
    Course,
    Groups,
    Limits,
    Motion,
    Places,
    Progress,
    System,
    Trail,
    Work,
)
from mpad_core.running.moving import advance, commit, refresh_turns, step_explicitly
from mpad_core.running.resisting import is_positive_definite, resistance
from mpad_core.running.shaking import TICKS, draw, longest_part

REACHED, ROOM_NEEDED, NOT_POSITIVE, NO_BALANCE = 0, 1, 2, 3  # why a burst ended
_GROWTH = 4.0  # from one part of a sub-step to the next
_RELAXING = TICKS // 1024  # the part after an event that changes the loads: stiff bonds share them anew at once


@compiled
def _works(bodies: Bodies, groups: Groups, motion: Motion, turn: Array) -> list[Work]:
    """Make room for the sub-steps of every group; what is laid out by cells they share, and held cells stay in it."""
    cells = turn.shape[0]
    gaps, centre, orientation = np.empty(cells), motion.centre.copy(), motion.orientation.copy()
    rotation, turned = motion.turn.copy(), turn.copy()
    return [
        _work_for(group, bodies, groups, gaps, centre, orientation, rotation, turned)
        for group in range(groups.first.shape[0] - 1)
    ]


@compiled
def _work_for(
    group: int, bodies: Bodies, groups: Groups, gaps: Array, centre: Array, orientation: Array, rotation: Array,
    turned: Array,
) -> Work:  # fmt: skip
    members = groups.cells[groups.first[group] : groups.first[group + 1]]
    m = 6 * members.shape[0]
    return Work(
        bodies.radius[members], np.empty((m, m)), np.empty((m, m)), np.empty(m), np.empty(m), np.empty(m),
        np.empty(m), np.empty(m), np.empty(m), np.zeros(m), np.empty(8), np.empty(m), np.empty(m), gaps, centre,
        orientation, rotation, turned,
    )  # fmt: skip


@compiled_lean
def _try_part(
    group: int, part: int, tick: int, length: float, step: int, key: Word, system: System, bonds: Bonds, motion: Motion,
    turn: Array, work: Work,
) -> float:  # fmt: skip
    """Try to move a group over a part of the sub-step at `step`, in ticks; give the error of its motion (`advance`)."""
    draw(system.thermal, group, system.groups, key, step, tick, tick + part, length, work.noise)
    return advance(group, length * part / TICKS, system, bonds, motion, turn, work)


@compiled_lean
def _shorter(error: float, most: float, shaken: bool) -> float:
    """Give the share of a part to try instead of it; 1 if its error (µm) will do.

    With thermal motion the error is that of the noise: to shorten what came out large would bias it.
    """
    if error == math.inf:
        return 0.5
    return 1.0 if error <= most or shaken else max(0.9 * math.sqrt(most / error), 0.1)


@compiled_lean
def _longer(error: float, most: float, shaken: bool) -> float:
    """Give by how much the next part may be longer than this one."""
    return _GROWTH if shaken or error * _GROWTH**2 <= 0.8 * most else max(0.9 * math.sqrt(most / error), 0.5)


@compiled_where_present(otherwise=REACHED)
def _move_group(most: float, group: int, course: Course, work: Work) -> int:
    """Move a group to the end of the sub-step that is under way, in as many parts as it takes for an error of `most`.

    The error is that of the motion of a cell's surface over a part, in µm.
    """
    system, motion, turn, progress, dice = course.system, course.motion, course.turn, course.progress, course.dice
    binding, adhesion, groups, radius = system.binding, course.adhesion, system.groups, system.bodies.radius
    length, shaken = course.limits.sub_step, is_present(system.thermal)
    step = dice.step + progress.beats[0] * dice.stride
    now, to = Places(motion.centre, motion.turn, turn), Places(work.centre, work.rotation, work.turn)
    bonds, recorded = bonds_of(adhesion), progress.events
    while progress.tick[group] < TICKS:
        if not all_ready(binding, adhesion, group, recorded, groups, now, dice):
            return ROOM_NEEDED
        tick = progress.tick[group]
        part = min(progress.part[group], TICKS - tick)
        part = min(part, longest_part(system.thermal, group, length, system.bodies, groups, motion.gap))
        dt = length * part / TICKS
        error = _try_part(group, part, tick, length, step, dice.key, system, bonds, motion, turn, work)
        shorter = _shorter(error, most, shaken)
        if shorter == 1.0 and strays(binding, adhesion, group, groups, now, to):
            shorter = 0.5
        if shorter == 1.0 and not see_ahead(binding, adhesion, group, recorded, groups, now, to, dice):
            return ROOM_NEEDED
        share, whose = 1.0, -1
        if shorter == 1.0:
            share, whose = look_ahead(
                binding, adhesion, group, dt, course.limits.rate, groups, radius, motion.gap, work.velocity, now, to
            )
        if shorter < 1.0 or share < 0:
            if part == 1:
                return NO_BALANCE
            progress.part[group] = max(int(part * min(shorter, 0.5 if share < 0 else 1.0)), 1)
            continue
        done = part if whose < 0 else min(max(math.ceil(share * part), 1), part)
        if done < part:
            again = _try_part(group, done, tick, length, step, dice.key, system, bonds, motion, turn, work)
            if again == math.inf:
                progress.part[group] = max(done // 2, 1)
                continue
        use_up(adhesion, group, share, dt, whose, groups, dice.key)
        commit(group, length * done / TICKS, groups, motion, turn, work)
        progress.part[group] = min(int(part * _longer(error, most, shaken)) + 1, TICKS)
        if whose >= 0:
            place, when = 6 * groups.place[whose], (tick + share * part) / TICKS
            own, height = work.velocity[place : place + 6], radius[whose] + motion.gap[whose]
            if let_happen(binding, adhesion, whose, when, own, height, step, dice.key, recorded, now):
                progress.part[group] = _RELAXING
        progress.tick[group] = tick + done
    return REACHED


@compiled_where_present(otherwise=REACHED)
def _move_explicitly(euler: float, group: int, course: Course, work: Work) -> int:
    """Move a group to the end of the sub-step that is under way by explicit steps of `euler` (s), for comparison.

    Rates are those of the start of every few steps, and an event happens at the end of the step in which it is due.
    """
    system, motion, turn, progress, dice = course.system, course.motion, course.turn, course.progress, course.dice
    binding, adhesion, groups, radius = system.binding, course.adhesion, system.groups, system.bodies.radius
    steps = max(round(course.limits.sub_step / euler), 1)
    dt, step = course.limits.sub_step / steps, dice.step + progress.beats[0] * dice.stride
    now, bonds, recorded = Places(motion.centre, motion.turn, turn), bonds_of(adhesion), progress.events
    gap, velocity = motion.gap, motion.velocity
    while progress.tick[group] < TICKS:
        if not all_ready(binding, adhesion, group, recorded, groups, now, dice):
            return ROOM_NEEDED
        done = progress.part[group] % TICKS  # steps of this sub-step
        use_up_explicitly(binding, adhesion, group, done, dt, groups, radius, gap, velocity, now)
        step_explicitly(group, dt, system, bonds, motion, turn, work)
        commit(group, dt, groups, motion, turn, work)
        happen_explicitly(
            binding, adhesion, group, (done + 1) / steps, groups, radius, gap, velocity, step, recorded, now, dice
        )
        progress.part[group] = done + 1 if done + 1 < steps else TICKS
        progress.tick[group] = (done + 1) * (TICKS // steps) if done + 1 < steps else TICKS
    return REACHED


@compiled_within
def _wait(cell: int, slot: int, at_rest: Array, course: Course) -> bool:
    """Let happen what happens to a cell that does not move, up to the end of the sub-step; tell if there was room."""
    motion, progress, dice = course.motion, course.progress, course.dice
    step, now = dice.step + progress.beats[0] * dice.stride, Places(motion.centre, motion.turn, course.turn)
    height, ready = course.system.bodies.radius[cell] + motion.gap[cell], True
    while ready and progress.tick[slot] < TICKS:
        left = TICKS - progress.tick[slot]
        ready, share = wait(
            course.system.binding, course.adhesion, cell, progress.tick[slot] / TICKS, course.limits.sub_step, at_rest,
            height, step, progress.events, now, dice,
        )  # fmt: skip
        if ready:
            progress.tick[slot] += min(max(math.ceil(share * left), 1), left) if share <= 1 else left
    return ready


@compiled_lean
def _must_end(binding: Binding, motion: Motion, limits: Limits) -> bool:
    """Tell whether the frozen coupling has been used far enough, or a cell leaves the lattice of the wall."""
    start = limits.start
    for cell in range(start.shape[0]):
        if not holds(binding, cell, motion.centre[cell, 0], motion.centre[cell, 1]):
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
def _fits(group: int, bodies: Bodies, groups: Groups, gaps: Array, work: Work) -> bool:
    """Tell whether a group's frozen coupling fits its heights."""
    resistance(group, bodies, groups, gaps, work.functions, work.matrix, work.right)
    return is_positive_definite(work.matrix)


@compiled_lean
def _note(step: int, motion: Motion, progress: Progress, trail: Trail) -> None:
    """Note where the cells are."""
    at = progress.trail[0]
    trail.step[at] = step
    for cell in range(motion.gap.shape[0]):
        trail.gap[at, cell] = motion.gap[cell]
        for i in range(3):
            trail.centre[at, cell, i] = motion.centre[cell, i]
            trail.turn[at, cell, i] = motion.turn[cell, i]
        for i in range(4):
            trail.orientation[at, cell, i] = motion.orientation[cell, i]
    progress.trail[0] = at + 1


@compiled_within
def _sub_step(course: Course, works: list[Work], at_rest: Array) -> tuple[int, int]:
    """Go through what is left of the sub-step that is under way; see `burst`."""
    groups, progress, limits = course.system.groups, course.progress, course.limits
    number = groups.first.shape[0] - 1
    for group in range(number):
        work = works[group]
        if progress.tick[group] == 0 and not _fits(group, course.system.bodies, groups, course.motion.gap, work):
            return NOT_POSITIVE, group
        outcome = _move_group(limits.error, group, course, work)  # one of both does nothing
        if outcome == REACHED:
            outcome = _move_explicitly(limits.euler, group, course, work)
        if outcome != REACHED:
            return outcome, group
    for cell in range(groups.place.shape[0]):
        if groups.place[cell] < 0 and not _wait(cell, number + cell, at_rest, course):
            return ROOM_NEEDED, -1
    return REACHED, -1


@compiled
def burst(course: Course) -> tuple[int, int]:
    """Run sub-steps until a limit is met; change all that is not frozen, and fill the trail and the table of events.

    Returns
    -------
    outcome
        REACHED; ROOM_NEEDED where bonds, candidates or events may not fit, after which the burst may be called again,
        with more room, and goes on; NOT_POSITIVE when the frozen coupling no longer fits, before a sub-step in which
        nothing has happened yet; NO_BALANCE when no part of a sub-step however short balances the loads, which leaves
        the state unusable.
    group
        The group that was refused.
    """
    progress, limits = course.progress, course.limits
    refresh_turns(course.motion, course.turn)
    works = _works(course.system.bodies, course.system.groups, course.motion, course.turn)
    at_rest = np.zeros(6)
    while progress.beats[0] < limits.most:
        outcome, group = _sub_step(course, works, at_rest)
        if outcome != REACHED:
            return outcome, group
        progress.beats[0] += 1
        progress.tick[:] = 0
        ends = _must_end(course.system.binding, course.motion, limits) or progress.beats[0] == limits.most
        if ends or progress.beats[0] % course.trail.every == 0:
            _note(progress.beats[0] * course.dice.stride, course.motion, progress, course.trail)
        if ends:
            break
    return REACHED, -1
