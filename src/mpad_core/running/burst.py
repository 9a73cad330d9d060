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
from mpad_core.running.awaiting import (
    all_ready,
    begin,
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
from mpad_core.running.layout import Bodies, Course, Groups, Work
from mpad_core.running.moving import advance, commit, refresh_turns, step_explicitly
from mpad_core.running.resisting import is_positive_definite, resistance
from mpad_core.running.shaking import TICKS, draw, longest_part

REACHED, ROOM_NEEDED, NOT_POSITIVE, NO_BALANCE = 0, 1, 2, 3  # why a burst ended
_GROWTH = 4.0  # from one part of a sub-step to the next
_RELAXING = TICKS // 1024  # the part after an event that changes the loads: stiff bonds share them anew at once


@compiled
def _works(course: Course) -> list[Work]:
    """Make room for the sub-steps of every group; what is laid out by cells they share, and held cells stay in it."""
    motion, turn, cells = course.motion, course.turn, course.turn.shape[0]
    gaps, centre, orientation = np.empty(cells), motion.centre.copy(), motion.orientation.copy()
    rotation, turned = motion.turn.copy(), turn.copy()
    return [
        _work_for(group, course.system.bodies, course.system.groups, gaps, centre, orientation, rotation, turned)
        for group in range(course.system.groups.first.shape[0] - 1)
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
def _try_part(group: int, part: int, tick: int, course: Course, work: Work) -> float:
    """Try to move a group over a part of the sub-step, in ticks; give the error of its motion, see `advance`."""
    length, system, dice = course.limits.sub_step, course.system, course.dice
    step = dice.step + course.progress.beats[0] * dice.stride
    draw(system.thermal, group, system.groups, dice.key, step, tick, tick + part, length, work.noise)
    bonds = bonds_of(course.adhesion)
    return advance(group, length * part / TICKS, system, bonds, course.motion, course.turn, work)


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


@compiled_lean
def _move_group(group: int, course: Course, work: Work) -> int:
    """Move a group to the end of the sub-step that is under way, in as many parts as it takes."""
    system, progress, binding = course.system, course.progress, course.system.binding
    length, most, shaken = course.limits.sub_step, course.limits.error, is_present(system.thermal)
    while progress.tick[group] < TICKS:
        if not all_ready(binding, group, system.groups, course):
            return ROOM_NEEDED
        tick = progress.tick[group]
        part = min(progress.part[group], TICKS - tick)
        part = min(part, longest_part(system.thermal, group, length, system, course.motion.gap))
        dt = length * part / TICKS
        error = _try_part(group, part, tick, course, work)
        shorter = _shorter(error, most, shaken)
        if shorter == 1.0 and strays(binding, group, course, work):
            shorter = 0.5
        if shorter == 1.0 and not see_ahead(binding, group, course, work):
            return ROOM_NEEDED
        share, whose = (1.0, -1) if shorter < 1.0 else look_ahead(binding, group, dt, course, work)
        if shorter < 1.0 or share < 0:
            if part == 1:
                return NO_BALANCE
            progress.part[group] = max(int(part * min(shorter, 0.5 if share < 0 else 1.0)), 1)
            continue
        done = part if whose < 0 else min(max(math.ceil(share * part), 1), part)
        if done < part and _try_part(group, done, tick, course, work) == math.inf:
            progress.part[group] = max(done // 2, 1)
            continue
        use_up(binding, group, share, dt, whose, course)
        commit(group, length * done / TICKS, system.groups, course.motion, course.turn, work)
        progress.part[group] = min(int(part * _longer(error, most, shaken)) + 1, TICKS)
        if whose >= 0:
            place = 6 * system.groups.place[whose]
            pulled = let_happen(binding, whose, (tick + share * part) / TICKS, work.velocity[place : place + 6], course)
            progress.part[group] = _RELAXING if pulled else progress.part[group]
        progress.tick[group] = tick + done
    return REACHED


@compiled_where_present(otherwise=REACHED)
def _move_explicitly(euler: float, group: int, course: Course, work: Work) -> int:
    """Move a group to the end of the sub-step that is under way by explicit steps of `euler` (s), for comparison.

    Rates are those of the start of every few steps, and an event happens at the end of the step in which it is due.
    """
    system, progress, binding = course.system, course.progress, course.system.binding
    steps = max(round(course.limits.sub_step / euler), 1)
    dt = course.limits.sub_step / steps
    while progress.tick[group] < TICKS:
        if not all_ready(binding, group, system.groups, course):
            return ROOM_NEEDED
        done = progress.part[group] % TICKS  # steps of this sub-step
        use_up_explicitly(binding, group, done, dt, course)
        step_explicitly(group, dt, system, bonds_of(course.adhesion), course.motion, course.turn, work)
        commit(group, dt, system.groups, course.motion, course.turn, work)
        happen_explicitly(binding, group, (done + 1) / steps, course)
        progress.part[group] = done + 1 if done + 1 < steps else TICKS
        progress.tick[group] = (done + 1) * (TICKS // steps) if done + 1 < steps else TICKS
    return REACHED


@compiled_lean
def _must_end(course: Course) -> bool:
    """Tell whether the frozen coupling has been used far enough, or a cell leaves the lattice of the wall."""
    motion, limits = course.motion, course.limits
    start = limits.start
    for cell in range(start.shape[0]):
        if not holds(course.system.binding, cell, motion.centre[cell, 0], motion.centre[cell, 1]):
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
def _fits(group: int, course: Course, work: Work) -> bool:
    """Tell whether a group's frozen coupling fits its heights."""
    resistance(
        group, course.system.bodies, course.system.groups, course.motion.gap, work.functions, work.matrix, work.right
    )
    return is_positive_definite(work.matrix)


@compiled
def _note(course: Course) -> None:
    """Note where the cells are."""
    motion, trail, progress = course.motion, course.trail, course.progress
    at = progress.trail[0]
    trail.step[at] = progress.beats[0] * course.dice.stride
    trail.centre[at] = motion.centre
    trail.gap[at] = motion.gap
    trail.orientation[at] = motion.orientation
    trail.turn[at] = motion.turn
    progress.trail[0] = at + 1


@compiled_within
def _sub_step(course: Course, works: list[Work], at_rest: Array) -> tuple[int, int]:
    """Go through what is left of the sub-step that is under way; see `burst`."""
    groups, progress, euler = course.system.groups, course.progress, course.limits.euler
    number = groups.first.shape[0] - 1
    for group in range(number):
        work = works[group]
        if progress.tick[group] == 0 and not _fits(group, course, work):
            return NOT_POSITIVE, group
        if is_present(euler):
            outcome = _move_explicitly(euler, group, course, work)
        else:
            outcome = _move_group(group, course, work)
        if outcome != REACHED:
            return outcome, group
    for cell in range(groups.place.shape[0]):
        if groups.place[cell] < 0 and not wait(course.system.binding, cell, number + cell, at_rest, course):
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
    begin(course.system.binding, course)
    works = _works(course)
    at_rest = np.zeros(6)
    while progress.beats[0] < limits.most:
        outcome, group = _sub_step(course, works, at_rest)
        if outcome != REACHED:
            return outcome, group
        progress.beats[0] += 1
        progress.tick[:] = 0
        ends = _must_end(course) or progress.beats[0] == limits.most
        if ends or progress.beats[0] % course.trail.every == 0:
            _note(course)
        if ends:
            break
    return REACHED, -1
