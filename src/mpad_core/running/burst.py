"""Many sub-steps between two calls of the solver: react → loads → implicit motion → move, compiled.

The groups of cells do not see each other within a burst, so each goes through a sub-step in parts of its own: as long
as the error of its motion allows, and never beyond its next event. A part is tried; where a clock runs out within it,
the group is moved only up to that moment, and what then happens is drawn from the rates there.
"""

import math

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled, compiled_lean, compiled_within
from mpad_core.running.clocks import EARLY, LATE, choice, drawn, share_until, used_until
from mpad_core.running.densities import holds
from mpad_core.running.layout import Course, System, Work
from mpad_core.running.listing import is_too_far, refresh, wears_out
from mpad_core.running.moving import advance, commit, refresh_turns, step_explicitly
from mpad_core.running.reacting import happen, rates, slip_factors
from mpad_core.running.resisting import is_positive_definite, resistance
from mpad_core.running.shaking import TICKS, draw, longest_part

REACHED, ROOM_NEEDED, NOT_POSITIVE, NO_BALANCE = 0, 1, 2, 3  # why a burst ended
_STEEP = 3.0  # ratio of a sub-step's two rates beyond which two points are too few
_UNCERTAIN = 0.02  # of the hazard used up between two rates so different: by how much it may be wrong
_HELD_STEPS = 5  # explicit steps over which rates are taken as constant
_GROWTH = 4.0  # from one part of a sub-step to the next
_RELAXING = TICKS // 1024  # the part after an event that changes the loads: stiff bonds share them anew at once


@compiled
def _works(course: Course) -> list[Work]:
    """Make room for the sub-steps of every group; what is laid out by cells they share, and held cells stay in it."""
    motion, turn, cells = course.motion, course.turn, course.turn.shape[0]
    gaps, centre, orientation = np.empty(cells), motion.centre.copy(), motion.orientation.copy()
    rotation, turned, middle, middle_turn = motion.turn.copy(), turn.copy(), motion.centre.copy(), turn.copy()
    return [
        _work_for(group, course.system, gaps, centre, orientation, rotation, turned, middle, middle_turn)
        for group in range(course.system.groups.first.shape[0] - 1)
    ]


@compiled
def _work_for(
    group: int, system: System, gaps: Array, centre: Array, orientation: Array, rotation: Array, turned: Array,
    middle: Array, middle_turn: Array,
) -> Work:  # fmt: skip
    members = system.groups.cells[system.groups.first[group] : system.groups.first[group + 1]]
    m = 6 * members.shape[0]
    return Work(
        system.bodies.radius[members], np.empty((m, m)), np.empty((m, m)), np.empty(m), np.empty(m), np.empty(m),
        np.empty(m), np.empty(m), np.empty(m), np.zeros(m), np.empty(8), np.empty(system.species.site_kind.shape[0]),
        np.empty(m), np.empty(m), np.empty((2, 3, 6)), np.empty((3, 3)), gaps, centre, orientation,
        rotation, turned, middle, middle_turn,
    )  # fmt: skip


@compiled_lean
def _between(group: int, share: float, course: Course, work: Work) -> None:
    """Write a group's places and turns at a share of the way that is being tried."""
    groups, centre, turn = course.system.groups, course.motion.centre, course.turn
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        for i in range(3):
            work.middle[cell, i] = centre[cell, i] + share * (work.centre[cell, i] - centre[cell, i])
            for j in range(3):
                work.middle_turn[cell, i, j] = turn[cell, i, j] + share * (work.turn[cell, i, j] - turn[cell, i, j])


@compiled_lean
def _look_ahead(group: int, dt: float, course: Course, work: Work) -> tuple[float, int]:
    """Look for the first event on the way of dt that is being tried; note each cell's two rates on it.

    Returns
    -------
    share
        Of the way, up to the event; 1 without one. Below zero where two rates are too few for so long a way.
    cell
        Whose event it is; -1 without one.
    """
    system, bonds, listed, ahead = course.system, course.bonds, course.listed, course.ahead
    groups, factor = system.groups, work.factor
    first, whose = 1.0, -1
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        ahead[cell, 0] = ahead[cell, 1] = 0.0
        if bonds.number[cell] + listed.number[cell] == 0:
            continue
        place = 6 * (k - groups.first[group])
        slip_factors(cell, work.velocity[place : place + 6], course.motion.gap[cell], system, factor)
        for point, share in enumerate((EARLY, LATE)):
            _between(group, share, course, work)
            ahead[cell, point], _, _ = rates(
                cell, math.inf, work.middle, work.middle_turn, system, bonds, course.bound, listed, factor
            )
        low, high = min(ahead[cell, 0], ahead[cell, 1]), max(ahead[cell, 0], ahead[cell, 1])
        if high > _STEEP * low and _UNCERTAIN * (high - low) * dt > course.limits.rate:
            return -1.0, -1
        share = share_until(course.clocks.left[cell], ahead[cell, 0], ahead[cell, 1], dt)
        if share < first:
            first, whose = share, cell
    return first, whose


@compiled_lean
def _wind(cell: int, course: Course) -> None:
    """Wind a cell's clock for its next event."""
    clocks = course.clocks
    clocks.number[cell] += 1
    clocks.left[cell] = drawn(course.dice.key, course.system.molecules.owner[cell], clocks.number[cell])


@compiled_lean
def _use_up(group: int, share: float, dt: float, whose: int, course: Course) -> None:
    """Take what the first `share` of a way of dt uses up from a group's clocks; wind the one that has run out."""
    groups, ahead, clocks = course.system.groups, course.ahead, course.clocks
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        if cell == whose:
            _wind(cell, course)
        else:
            clocks.left[cell] -= used_until(share, ahead[cell, 0], ahead[cell, 1], dt)


@compiled_lean
def _let_happen(cell: int, share: float, velocity: Array, factor: Array, course: Course) -> bool:
    """Draw what a cell's clock has run out for, from the rates of the moment, let it happen, and tell if loads changed.

    `share` is that of the sub-step. The clock has been wound already: the draw belongs to the number before.
    """
    system, bonds, bound, listed = course.system, course.bonds, course.bound, course.listed
    centre, turn, key = course.motion.centre, course.turn, course.dice.key
    slip_factors(cell, velocity, course.motion.gap[cell], system, factor)
    total, _, _ = rates(cell, math.inf, centre, turn, system, bonds, bound, listed, factor)
    drawn_share = choice(key, system.molecules.owner[cell], course.clocks.number[cell] - 1)
    _, which, excess = rates(cell, drawn_share * total, centre, turn, system, bonds, bound, listed, factor)
    recorded = course.progress.events[0]
    if which >= 0:
        step = course.dice.step + course.progress.beats[0] * course.dice.stride
        happen(
            cell, which, excess, step, share, centre, turn, key, system, bonds, bound, listed, course.clocks,
            course.progress, course.events,
        )  # fmt: skip
    return bool(course.progress.events[0] > recorded and course.events[recorded].force != 0.0)


@compiled_lean
def _is_ready(cell: int, course: Course) -> bool:
    """Bring a cell's lists up to date; tell whether there is room for them and for an event."""
    bonds = course.bonds
    if course.system.species.site_kind.shape[0] == 0:
        return True
    if bonds.first[cell] + bonds.number[cell] >= bonds.first[cell + 1]:
        return False
    if course.progress.events[0] >= course.events.shape[0]:
        return False
    return refresh(cell, course.system, course.motion, course.turn, course.dice, course.listed)


@compiled_lean
def _all_ready(group: int, course: Course) -> bool:
    """Do the same for every cell of a group."""
    groups, ready = course.system.groups, True
    for k in range(groups.first[group], groups.first[group + 1]):
        ready = ready and _is_ready(groups.cells[k], course)
    return ready


@compiled_lean
def _strays(group: int, course: Course, work: Work) -> bool:
    """Tell whether the way that is tried is longer than any lists would stand."""
    groups, strays = course.system.groups, False
    for k in range(groups.first[group], groups.first[group + 1]):
        strays = strays or is_too_far(groups.cells[k], course.system, course.motion, work, course.listed)
    return strays


@compiled_lean
def _see_ahead(group: int, course: Course, work: Work) -> bool:
    """Have those lists made anew that do not stand over the way that is tried; tell whether there was room."""
    groups, ready = course.system.groups, True
    for k in range(groups.first[group], groups.first[group + 1]):
        if wears_out(groups.cells[k], course.system, work, course.listed):
            ready = ready and _is_ready(groups.cells[k], course)
    return ready


@compiled_lean
def _try_part(group: int, part: int, tick: int, course: Course, work: Work) -> float:
    """Try to move a group over a part of the sub-step, in ticks; give the error of its motion, see `advance`."""
    limits, system, thermal = course.limits, course.system, course.system.thermal
    step = course.dice.step + course.progress.beats[0] * course.dice.stride
    for _ in range(thermal.energy.shape[0]):
        draw(group, system, course.dice.key, step, tick, tick + part, limits.sub_step, work.noise)
    return advance(group, limits.sub_step * part / TICKS, system, course.bonds, course.motion, course.turn, work)


@compiled_lean
def _shorter(error: float, course: Course) -> float:
    """Give the share of a part to try instead of it; 1 if its error will do.

    With thermal motion the error is that of the noise: to shorten what came out large would bias it.
    """
    shaken = course.system.thermal.energy.shape[0] > 0
    if error == math.inf:
        return 0.5
    return 1.0 if error <= course.limits.error or shaken else max(0.9 * math.sqrt(course.limits.error / error), 0.1)


@compiled_lean
def _longer(error: float, course: Course) -> float:
    """Give by how much the next part may be longer than this one."""
    shaken = course.system.thermal.energy.shape[0] > 0
    most = course.limits.error
    return _GROWTH if shaken or error * _GROWTH**2 <= 0.8 * most else max(0.9 * math.sqrt(most / error), 0.5)


@compiled_lean
def _move_group(group: int, course: Course, work: Work) -> int:
    """Move a group to the end of the sub-step that is under way, in as many parts as it takes."""
    system, limits, progress = course.system, course.limits, course.progress
    while progress.tick[group] < TICKS:
        if not _all_ready(group, course):
            return ROOM_NEEDED
        tick = progress.tick[group]
        part = min(progress.part[group], TICKS - tick)
        for k in range(system.thermal.energy.shape[0]):
            part = min(part, longest_part(group, limits.sub_step, system.thermal.energy[k], system, course.motion.gap))
        dt = limits.sub_step * part / TICKS
        error = _try_part(group, part, tick, course, work)
        shorter = _shorter(error, course)
        if shorter == 1.0 and _strays(group, course, work):
            shorter = 0.5
        if shorter == 1.0 and not _see_ahead(group, course, work):
            return ROOM_NEEDED
        share, whose = (1.0, -1) if shorter < 1.0 else _look_ahead(group, dt, course, work)
        if shorter < 1.0 or share < 0:
            if part == 1:
                return NO_BALANCE
            progress.part[group] = max(int(part * min(shorter, 0.5 if share < 0 else 1.0)), 1)
            continue
        done = part if whose < 0 else min(max(math.ceil(share * part), 1), part)
        if done < part and _try_part(group, done, tick, course, work) == math.inf:
            progress.part[group] = max(done // 2, 1)
            continue
        _use_up(group, share, dt, whose, course)
        commit(group, limits.sub_step * done / TICKS, system, course.motion, course.turn, work)
        progress.part[group] = min(int(part * _longer(error, course)) + 1, TICKS)
        if whose >= 0:
            place = 6 * system.groups.place[whose]
            own = work.velocity[place : place + 6]
            pulled = _let_happen(whose, (tick + share * part) / TICKS, own, work.factor, course)
            progress.part[group] = _RELAXING if pulled else progress.part[group]
        progress.tick[group] = tick + done
    return REACHED


@compiled_lean
def _move_explicitly(group: int, course: Course, work: Work) -> int:
    """Move a group to the end of the sub-step that is under way by explicit steps, for comparison.

    Rates are those of the start of every few steps, and an event happens at the end of the step in which it is due.
    """
    system, motion, progress, clocks, ahead = course.system, course.motion, course.progress, course.clocks, course.ahead
    groups = system.groups
    first, last = groups.first[group], groups.first[group + 1]
    steps = max(round(course.limits.sub_step / course.limits.euler[0]), 1)
    dt = course.limits.sub_step / steps
    while progress.tick[group] < TICKS:
        if not _all_ready(group, course):
            return ROOM_NEEDED
        done = progress.part[group] % TICKS  # steps of this sub-step
        for k in range(first, last):
            cell = groups.cells[k]
            if done % _HELD_STEPS == 0 or ahead[cell, 1] < 0:
                slip_factors(cell, motion.velocity[cell], motion.gap[cell], system, work.factor)
                ahead[cell, 0], _, _ = rates(
                    cell, math.inf, motion.centre, course.turn, system, course.bonds, course.bound, course.listed,
                    work.factor,
                )  # fmt: skip
                ahead[cell, 1] = 0.0
            clocks.left[cell] -= ahead[cell, 0] * dt
        step_explicitly(group, dt, system, course.bonds, motion, course.turn, work)
        commit(group, dt, system, motion, course.turn, work)
        for k in range(first, last):
            cell = groups.cells[k]
            if not clocks.left[cell] > 0:
                _wind(cell, course)
                _let_happen(cell, (done + 1) / steps, motion.velocity[cell], work.factor, course)
                ahead[cell, 1] = -1.0
        progress.part[group] = done + 1 if done + 1 < steps else TICKS
        progress.tick[group] = (done + 1) * (TICKS // steps) if done + 1 < steps else TICKS
    return REACHED


@compiled_lean
def _wait(cell: int, slot: int, at_rest: Array, factor: Array, course: Course) -> int:
    """Let happen what happens to a cell that does not move, up to the end of the sub-step that is under way."""
    system, motion, progress, clocks = course.system, course.motion, course.progress, course.clocks
    while progress.tick[slot] < TICKS:
        if not _is_ready(cell, course):
            return ROOM_NEEDED
        slip_factors(cell, at_rest, motion.gap[cell], system, factor)
        total, _, _ = rates(
            cell, math.inf, motion.centre, course.turn, system, course.bonds, course.bound, course.listed, factor
        )
        part = TICKS - progress.tick[slot]
        dt = course.limits.sub_step * part / TICKS
        share = share_until(clocks.left[cell], total, total, dt)
        if share > 1:
            clocks.left[cell] -= total * dt
            progress.tick[slot] = TICKS
            continue
        _wind(cell, course)
        _let_happen(cell, (progress.tick[slot] + share * part) / TICKS, at_rest, factor, course)
        progress.tick[slot] += min(max(math.ceil(share * part), 1), part)
    return REACHED


@compiled_lean
def _must_end(course: Course) -> bool:
    """Tell whether the frozen coupling has been used far enough, or a cell leaves the lattice of the wall."""
    motion, limits = course.motion, course.limits
    start = limits.start
    for cell in range(start.shape[0]):
        if not holds(course.system.densities, cell, motion.centre[cell, 0], motion.centre[cell, 1]):
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
    resistance(group, course.system, course.motion.gap, work.functions, work.matrix, work.right)
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
def _sub_step(course: Course, works: list[Work], at_rest: Array, factor: Array) -> tuple[int, int]:
    """Go through what is left of the sub-step that is under way; see `burst`."""
    groups, progress = course.system.groups, course.progress
    number = groups.first.shape[0] - 1
    for group in range(number):
        if progress.tick[group] == 0 and not _fits(group, course, works[group]):
            return NOT_POSITIVE, group
        if course.limits.euler.shape[0] == 0:
            outcome = _move_group(group, course, works[group])
        else:
            outcome = _move_explicitly(group, course, works[group])
        if outcome != REACHED:
            return outcome, group
    for cell in range(groups.place.shape[0]):
        if groups.place[cell] < 0 and _wait(cell, number + cell, at_rest, factor, course) != REACHED:
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
    course.listed.near_number[:] = -1
    course.listed.facing_number[:] = -1
    works = _works(course)
    at_rest, factor = np.zeros(6), np.empty(course.system.species.site_kind.shape[0])
    while progress.beats[0] < limits.most:
        outcome, group = _sub_step(course, works, at_rest, factor)
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
