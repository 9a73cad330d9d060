"""What the sub-steps of a burst do about bonds: see events ahead, wind clocks, let events happen; compiled.

All that is called from outside does nothing where the scene has no bonds.
"""

import math

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import Absent, compiled_lean, compiled_where_present
from mpad_core.running.clocks import EARLY, LATE, choice, drawn, share_until, used_until
from mpad_core.running.layout import Adhesion, Binding, Bonds, Course, Groups, Work
from mpad_core.running.listing import is_too_far, refresh, wears_out
from mpad_core.running.reacting import happen, rates, slip_factors
from mpad_core.running.shaking import TICKS

_STEEP = 3.0  # ratio of a sub-step's two rates beyond which two points are too few
_UNCERTAIN = 0.02  # of the hazard used up between two rates so different: by how much it may be wrong
_HELD_STEPS = 5  # explicit steps over which rates are taken as constant


@compiled_lean
def _between(group: int, share: float, course: Course, work: Work) -> None:
    """Write a group's places and turns at a share of the way that is being tried."""
    groups, centre, turn, bench = course.system.groups, course.motion.centre, course.turn, course.system.binding.bench
    middle, middle_turn = bench.middle, bench.middle_turn
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        for i in range(3):
            middle[cell, i] = centre[cell, i] + share * (work.centre[cell, i] - centre[cell, i])
            for j in range(3):
                middle_turn[cell, i, j] = turn[cell, i, j] + share * (work.turn[cell, i, j] - turn[cell, i, j])


@compiled_lean
def _factors(cell: int, velocity: Array, course: Course) -> None:
    """Write the factors on a cell's on-rates at a velocity (6,) onto the bench."""
    binding = course.system.binding
    height = course.system.bodies.radius[cell] + course.motion.gap[cell]
    slip_factors(velocity, height, binding.species, binding.bench.factor)


@compiled_lean
def _total(cell: int, centre: Array, turn: Array, binding: Binding, adhesion: Adhesion) -> float:
    """Give the sum of all rates of a cell, with cells at `centre` (N, 3) and turned by `turn` (N, 3, 3)."""
    total, _, _ = rates(
        cell, math.inf, centre, turn, binding, adhesion.bonds, adhesion.bound, adhesion.listed, binding.bench.factor
    )
    return total


@compiled_where_present()
def begin(binding: Binding, course: Course) -> None:
    """Have all lists made anew before they are used, and every cell on the bench; held ones stay there."""
    listed, bench = course.adhesion.listed, binding.bench
    for cell in range(listed.near_number.shape[0]):
        listed.near_number[cell] = -1
        for i in range(3):
            bench.middle[cell, i] = course.motion.centre[cell, i]
            for j in range(3):
                bench.middle_turn[cell, i, j] = course.turn[cell, i, j]
    for slot in range(listed.facing_number.shape[0]):
        listed.facing_number[slot] = -1


@compiled_where_present(otherwise=Absent())
def bonds_of(adhesion: Adhesion) -> Bonds:
    """Give the bonds, or what stands for them."""
    return adhesion.bonds


@compiled_where_present(otherwise=(1.0, -1))
def look_ahead(binding: Binding, group: int, dt: float, course: Course, work: Work) -> tuple[float, int]:
    """Look for the first event on the way of dt that is being tried; note each cell's two rates on it.

    Returns
    -------
    share
        Of the way, up to the event; 1 without one. Below zero where two rates are too few for so long a way.
    cell
        Whose event it is; -1 without one.
    """
    adhesion, groups, bench = course.adhesion, course.system.groups, binding.bench
    ahead = adhesion.ahead
    first, whose = 1.0, -1
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        ahead[cell, 0] = ahead[cell, 1] = 0.0
        if adhesion.bonds.number[cell] + adhesion.listed.number[cell] == 0:
            continue
        place = 6 * (k - groups.first[group])
        _factors(cell, work.velocity[place : place + 6], course)
        for point, share in enumerate((EARLY, LATE)):
            _between(group, share, course, work)
            ahead[cell, point] = _total(cell, bench.middle, bench.middle_turn, binding, adhesion)
        low, high = min(ahead[cell, 0], ahead[cell, 1]), max(ahead[cell, 0], ahead[cell, 1])
        if high > _STEEP * low and _UNCERTAIN * (high - low) * dt > course.limits.rate:
            return -1.0, -1
        share = share_until(adhesion.clocks.left[cell], ahead[cell, 0], ahead[cell, 1], dt)
        if share < first:
            first, whose = share, cell
    return first, whose


@compiled_lean
def _wind(cell: int, course: Course) -> None:
    """Wind a cell's clock for its next event."""
    clocks = course.adhesion.clocks
    clocks.number[cell] += 1
    clocks.left[cell] = drawn(course.dice.key, course.system.binding.molecules.owner[cell], clocks.number[cell])


@compiled_where_present()
def use_up(binding: Binding, group: int, share: float, dt: float, whose: int, course: Course) -> None:
    """Take what the first `share` of a way of dt uses up from a group's clocks; wind the one that has run out."""
    groups, ahead, clocks = course.system.groups, course.adhesion.ahead, course.adhesion.clocks
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        if cell == whose:
            _wind(cell, course)
        else:
            clocks.left[cell] -= used_until(share, ahead[cell, 0], ahead[cell, 1], dt)


@compiled_where_present(otherwise=False)
def let_happen(binding: Binding, cell: int, share: float, velocity: Array, course: Course) -> bool:
    """Draw what a cell's clock has run out for, from the rates of the moment, let it happen, and tell if loads changed.

    `share` is that of the sub-step. The clock has been wound already: the draw belongs to the number before.
    """
    adhesion, dice, progress, factor = course.adhesion, course.dice, course.progress, binding.bench.factor
    bonds, bound, listed, clocks = adhesion.bonds, adhesion.bound, adhesion.listed, adhesion.clocks
    centre, turn, key = course.motion.centre, course.turn, dice.key
    _factors(cell, velocity, course)
    total = _total(cell, centre, turn, binding, adhesion)
    drawn_share = choice(key, binding.molecules.owner[cell], clocks.number[cell] - 1)
    _, which, excess = rates(cell, drawn_share * total, centre, turn, binding, bonds, bound, listed, factor)
    recorded = progress.events[0]
    if which >= 0:
        step = dice.step + progress.beats[0] * dice.stride
        happen(
            cell, which, excess, step, share, centre, turn, key, binding, bonds, bound, listed, clocks, progress,
            adhesion.events,
        )  # fmt: skip
    return bool(progress.events[0] > recorded and adhesion.events[recorded].force != 0.0)


@compiled_lean
def _is_ready(cell: int, course: Course) -> bool:
    """Bring a cell's lists up to date; tell whether there is room for them and for an event."""
    bonds, events, motion = course.adhesion.bonds, course.adhesion.events, course.motion
    if bonds.first[cell] + bonds.number[cell] >= bonds.first[cell + 1]:
        return False
    if course.progress.events[0] >= events.shape[0]:
        return False
    return refresh(
        cell, course.system.binding, motion.centre, motion.turn, course.turn, course.dice, course.adhesion.listed
    )


@compiled_where_present(otherwise=True)
def all_ready(binding: Binding, group: int, groups: Groups, course: Course) -> bool:
    """Bring the lists of every cell of a group up to date; tell whether there is room for them and for an event."""
    ready = True
    for k in range(groups.first[group], groups.first[group + 1]):
        ready = ready and _is_ready(groups.cells[k], course)
    return ready


@compiled_where_present(otherwise=False)
def strays(binding: Binding, group: int, course: Course, work: Work) -> bool:
    """Tell whether the way that is tried is longer than any lists would stand."""
    groups, motion, listed, far = course.system.groups, course.motion, course.adhesion.listed, False
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        far = far or is_too_far(cell, binding, motion.centre, motion.turn, work.centre, work.rotation, listed)
    return far


@compiled_where_present(otherwise=True)
def see_ahead(binding: Binding, group: int, course: Course, work: Work) -> bool:
    """Have those lists made anew that do not stand over the way that is tried; tell whether there was room."""
    groups, ready = course.system.groups, True
    for k in range(groups.first[group], groups.first[group + 1]):
        if wears_out(groups.cells[k], binding, work.centre, work.rotation, course.adhesion.listed):
            ready = ready and _is_ready(groups.cells[k], course)
    return ready


@compiled_where_present(otherwise=True)
def wait(binding: Binding, cell: int, slot: int, at_rest: Array, course: Course) -> bool:
    """Let happen what happens to a cell that does not move, up to the end of a sub-step; tell whether there was room.

    `at_rest` (6,) are zeros, and the cell's progress stands at `slot`.
    """
    progress, clocks = course.progress, course.adhesion.clocks
    while progress.tick[slot] < TICKS:
        if not _is_ready(cell, course):
            return False
        _factors(cell, at_rest, course)
        total = _total(cell, course.motion.centre, course.turn, binding, course.adhesion)
        part = TICKS - progress.tick[slot]
        dt = course.limits.sub_step * part / TICKS
        share = share_until(clocks.left[cell], total, total, dt)
        if share > 1:
            clocks.left[cell] -= total * dt
            progress.tick[slot] = TICKS
            continue
        _wind(cell, course)
        let_happen(binding, cell, (progress.tick[slot] + share * part) / TICKS, at_rest, course)
        progress.tick[slot] += min(max(math.ceil(share * part), 1), part)
    return True


@compiled_where_present()
def use_up_explicitly(binding: Binding, group: int, done: int, dt: float, course: Course) -> None:
    """Take what an explicit step of dt uses up from a group's clocks, `done` of the sub-step's having been taken."""
    groups, adhesion, motion = course.system.groups, course.adhesion, course.motion
    ahead = adhesion.ahead
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        if done % _HELD_STEPS == 0 or ahead[cell, 1] < 0:
            _factors(cell, motion.velocity[cell], course)
            ahead[cell, 0] = _total(cell, motion.centre, course.turn, binding, adhesion)
            ahead[cell, 1] = 0.0
        adhesion.clocks.left[cell] -= ahead[cell, 0] * dt


@compiled_where_present()
def happen_explicitly(binding: Binding, group: int, share: float, course: Course) -> None:
    """Let happen what a group's clocks have run out for by an explicit step's end, at a share of the sub-step."""
    groups, adhesion = course.system.groups, course.adhesion
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        if not adhesion.clocks.left[cell] > 0:
            _wind(cell, course)
            let_happen(binding, cell, share, course.motion.velocity[cell], course)
            adhesion.ahead[cell, 1] = -1.0
