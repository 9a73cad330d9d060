"""How long steps may be: the sub-step of the burst, and how far a frozen coupling is used."""

from typing import NamedTuple

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.tables import value
from mpad_core.physics.coupling import contact_reach
from mpad_core.physics.problem import Problem
from mpad_core.running.assembly import Fixed, pair_gaps
from mpad_core.running.layout import Limits
from mpad_core.running.moving import LARGEST_TURN
from mpad_core.running.reacting import OFF_RATE, ON_RATE
from mpad_core.running.shaking import RMS_SHARE

_MOST_SUB_STEPS = 1000  # in one burst, so that a run can be told to stop
_GAP_CHANGE = 0.2  # of a cell's gap to the wall over which the frozen coupling may be combined with r(h)
_LARGEST_SUB_STEP = 1e-3  # s, where nothing else bounds it
_RANGE_SHARE = 0.2  # of the repulsion's range that thermal motion may cross in a sub-step
_VERTICAL = 0.01  # vertical velocities are this fraction of the flow's past a cell, or less


@frozen(kw_only=True)
class Pace:
    """The step lengths of a run."""

    sub_step: float  # s
    longest: float  # s, of a burst
    share: float  # η: of the gap between two cells that they may move relative to each other in a burst


def choose_pace(problem: Problem, fixed: Fixed) -> Pace:
    """Choose the steps from the accuracies asked for.

    A test of P = 1 − exp(−k Δt) a sub-step delays events by Δt/2, a relative error k Δt/2 of their rate: the largest
    on-rate and the unstressed off-rates bound the sub-step. Backward Euler errs by Δt/2 times the change of the
    velocity; the height must stay within ``position``. The coupling is taken in the middle of a burst, so its error
    grows with η².
    """
    tolerances = problem.tolerances
    bounds = [_LARGEST_SUB_STEP]
    bounds += [2 * tolerances.rate / rate for rate in _fastest(problem, fixed) if rate > 0]
    settling = np.abs(problem.external[:, :3]).max() / (6 * np.pi * problem.setting.viscosity * problem.radii.min())
    bounds += _thermal_steps(problem)
    vertical = _VERTICAL * abs(problem.setting.shear_rate) * float(problem.radii.max()) + float(settling)
    if vertical > 0:
        bounds.append(2 * tolerances.position / vertical)
    sub_step = float(f"{min(bounds):.1e}")
    shear = abs(problem.setting.shear_rate)
    longest = max(0.1 / shear if shear > 0 else 0.01, sub_step)
    share = float(np.clip(0.02 * np.sqrt(tolerances.position / 1e-4), 0.002, 0.1))
    return Pace(sub_step=sub_step, longest=longest, share=share)


def _thermal_steps(problem: Problem) -> list[float]:
    """Give the sub-steps (s) in which thermal motion crosses a small part of what it may not jump over; none without.

    A cell's rms displacement (2 kT M Δt)^½ across a gap g is to be at most `RMS_SHARE` of g (a gap that is narrower
    later splits the sub-step) and `_RANGE_SHARE` of the length ℓ over which repulsion takes up kT. In a repulsion of
    stiffness kT/ℓ², backward Euler makes the variance too small by the share kT M Δt/(2ℓ²), that is `_RANGE_SHARE`²/4
    or 1 %. M is g/(6πηa²) near a wall, four times that between two cells, and at most Stokes' (a solver without
    lubrication lets two touching cells move some twice as easily). And the rms turn is to be a fifth of the largest
    turn of a sub-step.
    """
    kT, radius = problem.thermal_energy, float(problem.radii.min())
    if kT == 0:
        return []
    stokes = 1 / (6 * np.pi * problem.setting.viscosity * radius)
    length, tips = _repelling(problem)
    steps = [(LARGEST_TURN / 5) ** 2 * radius**2 / (1.5 * kT * stokes)]
    if problem.setting.wall:
        lowest = float((problem.start[:, 2] - problem.radii).min())
        gap = float(problem.roughness.min()) + problem.wall_roughness + tips if tips > 0 else lowest
        mobility = stokes * min(gap / radius, 1.0)
        steps.append(min(_RANGE_SHARE * length, RMS_SHARE * gap) ** 2 / (2 * kT * mobility))
    if len(problem.radii) > 1 and tips > 0:
        gap = 2 * float(problem.roughness.min()) + tips
        mobility = stokes * (min(4 * gap / radius, 2.0) if problem.coupled else 2.0)
        steps.append(min(_RANGE_SHARE * length, RMS_SHARE * gap) ** 2 / (2 * kT * mobility))
    return steps


def _repelling(problem: Problem) -> tuple[float, float]:
    """Give the length ℓ over which repulsion takes up kT, kT over the force at the tip gap of that energy; that gap.

    Infinity and 0 without repulsion.
    """
    if problem.contact is None:
        return np.inf, 0.0
    low, high = problem.contact.gaps()
    gaps = np.linspace(low, high, 20_001)
    force = problem.contact.force(gaps)
    energy = np.cumsum(force[::-1])[::-1] * (gaps[1] - gaps[0])
    k = max(int(np.searchsorted(-energy, -problem.thermal_energy)) - 1, 0)
    return problem.thermal_energy / float(force[k]), float(gaps[k])


def _fastest(problem: Problem, fixed: Fixed) -> list[float]:
    """Give the rates (1/s) that events have in an unstressed bond, or in one about to form, for every species."""
    rates = []
    for k, species in enumerate(problem.species):
        lengths = np.linspace(0.0, float(fixed.species.reach[k]), 201)
        crowded = 1.0 if species.reach == "pairs" else species.surface.densest() / species.at_density
        rates.append(crowded * max(value(fixed.species.tables, k, ON_RATE, x) for x in lengths))
        rates.append(value(fixed.species.tables, k, OFF_RATE, species.rest_length))
    return rates


class PairMoves(NamedTuple):
    """How far pairs of cells may move relative to each other in a burst."""

    pairs: Indices  # (P, 2)
    allowed: Array  # (P,) µm


def pair_moves(problem: Problem, pairs: Indices, centres: Array, share: float) -> PairMoves:
    """Give how far each pair may move: a share of its gap.

    Where nothing but contact couples them, it is less than half the way to where they could touch.
    """
    gaps = pair_gaps(problem, pairs, centres)
    allowed: Array = share * np.maximum(gaps, 1e-3 * problem.radii[pairs].min(axis=1))
    if problem.coupled:
        return PairMoves(pairs, allowed)
    apart: Array = np.maximum(allowed, 0.4 * (gaps - contact_reach(problem)))
    return PairMoves(pairs, apart)


def expected_length(pace: Pace, moves: PairMoves, drift: Array) -> float:
    """Give how long (s) the next burst will last if the cells go on as before."""
    if len(moves.pairs) == 0:
        return pace.longest
    speeds = np.linalg.norm(drift[moves.pairs[:, 0], :3] - drift[moves.pairs[:, 1], :3], axis=1)
    times = moves.allowed / np.maximum(speeds, 1e-300)
    # a burst ends with the first whole sub-step that passes a limit
    whole = max(np.ceil(min(pace.longest, times.min()) / pace.sub_step * (1 - 1e-9)), 1.0)
    return float(whole * pace.sub_step)


def limits(problem: Problem, pace: Pace, moves: PairMoves, centres: Array, middle_gaps: Array, left: float) -> Limits:
    """Give the limits of a burst whose coupling was taken at `middle_gaps`; `left` (s) is the time to the run's end."""
    wanted = min(pace.longest, left)
    most = int(np.clip(np.ceil(wanted / pace.sub_step * (1 - 1e-9)), 1, _MOST_SUB_STEPS))
    most = min(most, max(round(left / pace.sub_step), 1))  # the run ends at the sub-step nearest to its end
    free = problem.setting.wall & problem.coupled
    low = middle_gaps * (1 - _GAP_CHANGE) if free else np.full(len(middle_gaps), -np.inf)
    high = middle_gaps * (1 + _GAP_CHANGE) if free else np.full(len(middle_gaps), np.inf)
    return Limits(pace.sub_step, most, centres, moves.pairs, moves.allowed, low, high)
