"""What the sub-steps of a burst do about bonds: see events ahead, use up clocks, let events happen; compiled.

All that is called from outside does nothing where the scene has no bonds.
"""

import math

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import Absent, compiled_lean, compiled_where_present
from mpad_core.numerics.streams import Word
from mpad_core.running.clocks import EARLY, LATE, choice, drawn, share_until, used_until
from mpad_core.running.layout import Adhesion, Binding, Bonds, Clocks, Dice, Groups, Places
from mpad_core.running.listing import is_too_far, refresh, wears_out
from mpad_core.running.reacting import happen, rates, slip_factors

_STEEP = 3.0  # ratio of a sub-step's two rates beyond which two points are too few
_UNCERTAIN = 0.02  # of the hazard used up between two rates so different: by how much it may be wrong
_HELD_STEPS = 5  # explicit steps over which rates are taken as constant


@compiled_where_present(otherwise=Absent())
def bonds_of(adhesion: Adhesion) -> Bonds:
    """Give the bonds, or what stands for them."""
    return adhesion.bonds


@compiled_lean
def _between(group: int, share: float, groups: Groups, now: Places, to: Places, middle: Array, turned: Array) -> None:
    """Write a group's places and turns at a share of the way that is being tried."""
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        for i in range(3):
            middle[cell, i] = now.centre[cell, i] + share * (to.centre[cell, i] - now.centre[cell, i])
            for j in range(3):
                start = now.turn[cell, i, j]
                turned[cell, i, j] = start + share * (to.turn[cell, i, j] - start)


@compiled_lean
def _total(cell: int, centre: Array, turn: Array, binding: Binding, adhesion: Adhesion) -> float:
    """Give the sum of all rates of a cell, with cells at `centre` (N, 3) and turned by `turn` (N, 3, 3)."""
    bonds, bound, listed = adhesion.bonds, adhesion.bound, adhesion.listed
    total, _, _ = rates(cell, math.inf, centre, turn, binding, bonds, bound, listed, binding.bench.factor)
    return total


@compiled_where_present(otherwise=(1.0, -1))
def look_ahead(
    binding: Binding, adhesion: Adhesion, group: int, dt: float, tolerance: float, groups: Groups, radius: Array,
    gap: Array, velocity: Array, now: Places, to: Places,
) -> tuple[float, int]:  # fmt: skip
    """Look for the first event on the way of dt that is being tried; note each cell's two rates on it.

    Parameters
    ----------
    tolerance
        Relative, of the rates.
    radius, gap : (N,), (N,)
        µm, of all cells, and of those to the wall.
    velocity : (6n,)
        Of the group's cells.
    now, to
        Where the cells are, and where the way leads.

    Returns
    -------
    share
        Of the way, up to the event; 1 without one. Below zero where two rates are too few for so long a way.
    cell
        Whose event it is; -1 without one.
    """
    bench, ahead = binding.bench, adhesion.ahead
    first, whose = 1.0, -1
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        ahead[cell, 0] = ahead[cell, 1] = 0.0
        if adhesion.bonds.number[cell] + adhesion.listed.number[cell] == 0:
            continue
        place = 6 * (k - groups.first[group])
        slip_factors(velocity[place : place + 6], radius[cell] + gap[cell], binding.species, bench.factor)
        for point, share in enumerate((EARLY, LATE)):
            _between(group, share, groups, now, to, bench.middle, bench.middle_turn)
            ahead[cell, point] = _total(cell, bench.middle, bench.middle_turn, binding, adhesion)
        low, high = min(ahead[cell, 0], ahead[cell, 1]), max(ahead[cell, 0], ahead[cell, 1])
        if high > _STEEP * low and _UNCERTAIN * (high - low) * dt > tolerance:
            return -1.0, -1
        share = share_until(adhesion.clocks.left[cell], ahead[cell, 0], ahead[cell, 1], dt)
        if share < first:
            first, whose = share, cell
    return first, whose


@compiled_lean
def _wind(cell: int, clocks: Clocks, key: Word) -> None:
    """Wind a cell's clock for its next event."""
    clocks.number[cell] += 1
    clocks.left[cell] = drawn(key, clocks.owner[cell], clocks.number[cell])


@compiled_where_present()
def use_up(adhesion: Adhesion, group: int, share: float, dt: float, whose: int, groups: Groups, key: Word) -> None:
    """Take what the first `share` of a way of dt uses up from a group's clocks; wind the one that has run out."""
    clocks, ahead = adhesion.clocks, adhesion.ahead
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        if cell == whose:
            _wind(cell, clocks, key)
        else:
            clocks.left[cell] -= used_until(share, ahead[cell, 0], ahead[cell, 1], dt)


@compiled_where_present(otherwise=False)
def let_happen(
    binding: Binding, adhesion: Adhesion, cell: int, share: float, velocity: Array, height: float, step: int,
    key: Word, recorded: Indices, now: Places,
) -> bool:  # fmt: skip
    """Draw what a cell's clock has run out for, from the rates of the moment, let it happen, and tell if loads changed.

    The clock has been wound already: the draw belongs to the number before.

    Parameters
    ----------
    share, step
        When it is: the share of the sub-step, and when that began.
    velocity : (6,)
        Of the cell.
    height
        µm, of its centre above the wall.
    recorded : (1,)
        How many events stand in the table.
    """
    bonds, bound, listed, clocks = adhesion.bonds, adhesion.bound, adhesion.listed, adhesion.clocks
    factor, before = binding.bench.factor, recorded[0]
    slip_factors(velocity, height, binding.species, factor)
    total = _total(cell, now.centre, now.turn, binding, adhesion)
    stop = choice(key, clocks.owner[cell], clocks.number[cell] - 1) * total
    _, which, excess = rates(cell, stop, now.centre, now.turn, binding, bonds, bound, listed, factor)
    if which >= 0:
        happen(
            cell, which, excess, step, share, now.centre, now.turn, key, binding, bonds, bound, listed, clocks,
            recorded, adhesion.events,
        )  # fmt: skip
    return bool(recorded[0] > before and adhesion.events[before].force != 0.0)


@compiled_lean
def _is_ready(cell: int, binding: Binding, adhesion: Adhesion, recorded: Indices, now: Places, dice: Dice) -> bool:
    """Bring a cell's lists up to date; tell whether there is room for them and for an event."""
    bonds = adhesion.bonds
    if bonds.first[cell] + bonds.number[cell] >= bonds.first[cell + 1]:
        return False
    if recorded[0] >= adhesion.events.shape[0]:
        return False
    return refresh(cell, binding, now.centre, now.rotation, now.turn, dice, adhesion.listed)


@compiled_where_present(otherwise=True)
def all_ready(
    binding: Binding, adhesion: Adhesion, group: int, recorded: Indices, groups: Groups, now: Places, dice: Dice
) -> bool:
    """Bring the lists of every cell of a group up to date; tell whether there is room for them and for an event."""
    ready = True
    for k in range(groups.first[group], groups.first[group + 1]):
        ready = ready and _is_ready(groups.cells[k], binding, adhesion, recorded, now, dice)
    return ready


@compiled_where_present(otherwise=False)
def strays(binding: Binding, adhesion: Adhesion, group: int, groups: Groups, now: Places, to: Places) -> bool:
    """Tell whether the way that is tried is longer than any lists would stand."""
    far, listed = False, adhesion.listed
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        far = far or is_too_far(cell, binding, now.centre, now.rotation, to.centre, to.rotation, listed)
    return far


@compiled_where_present(otherwise=True)
def see_ahead(
    binding: Binding, adhesion: Adhesion, group: int, recorded: Indices, groups: Groups, now: Places, to: Places,
    dice: Dice,
) -> bool:  # fmt: skip
    """Have those lists made anew that do not stand over the way that is tried; tell whether there was room."""
    ready = True
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        if wears_out(cell, binding, to.centre, to.rotation, adhesion.listed):
            ready = ready and _is_ready(cell, binding, adhesion, recorded, now, dice)
    return ready


@compiled_where_present(otherwise=(True, math.inf))
def wait(
    binding: Binding, adhesion: Adhesion, cell: int, start: float, length: float, at_rest: Array, height: float,
    step: int, recorded: Indices, now: Places, dice: Dice,
) -> tuple[bool, float]:  # fmt: skip
    """Let the next event happen of a cell that does not move.

    Parameters
    ----------
    start
        From which share of the sub-step on.
    length
        s, of the sub-step.
    at_rest : (6,)
        Zeros.

    Returns
    -------
    ready
        Whether there was room for it.
    share
        Of what was left of the sub-step, up to the event; infinity without one.
    """
    clocks, left = adhesion.clocks, 1.0 - start
    if not _is_ready(cell, binding, adhesion, recorded, now, dice):
        return False, 0.0
    slip_factors(at_rest, height, binding.species, binding.bench.factor)
    total = _total(cell, now.centre, now.turn, binding, adhesion)
    share = share_until(clocks.left[cell], total, total, left * length)
    if share > 1:
        clocks.left[cell] -= total * left * length
        return True, math.inf
    _wind(cell, clocks, dice.key)
    let_happen(binding, adhesion, cell, start + share * left, at_rest, height, step, dice.key, recorded, now)
    return True, share


@compiled_where_present()
def use_up_explicitly(
    binding: Binding, adhesion: Adhesion, group: int, done: int, dt: float, groups: Groups, radius: Array,
    gap: Array, velocity: Array, now: Places,
) -> None:  # fmt: skip
    """Take what an explicit step of dt uses up from a group's clocks; `done` steps of the sub-step have been taken."""
    ahead = adhesion.ahead
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        if done % _HELD_STEPS == 0 or ahead[cell, 1] < 0:
            slip_factors(velocity[cell], radius[cell] + gap[cell], binding.species, binding.bench.factor)
            ahead[cell, 0] = _total(cell, now.centre, now.turn, binding, adhesion)
            ahead[cell, 1] = 0.0
        adhesion.clocks.left[cell] -= ahead[cell, 0] * dt


@compiled_where_present()
def happen_explicitly(
    binding: Binding, adhesion: Adhesion, group: int, share: float, groups: Groups, radius: Array, gap: Array,
    velocity: Array, step: int, recorded: Indices, now: Places, dice: Dice,
) -> None:  # fmt: skip
    """Let happen what a group's clocks have run out for by the end of an explicit step, at a share of the sub-step."""
    for k in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[k]
        if not adhesion.clocks.left[cell] > 0:
            _wind(cell, adhesion.clocks, dice.key)
            height = radius[cell] + gap[cell]
            let_happen(binding, adhesion, cell, share, velocity[cell], height, step, dice.key, recorded, now)
            adhesion.ahead[cell, 1] = -1.0
