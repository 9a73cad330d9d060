"""How long steps may be: the sub-step of the burst, and how far a frozen coupling is used."""

import math
from typing import NamedTuple

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import absent
from mpad_core.physics.coupling import contact_reach
from mpad_core.physics.problem import Problem
from mpad_core.running.assembly import pair_gaps
from mpad_core.running.layout import Limits
from mpad_core.running.moving import LARGEST_TURN
from mpad_core.running.shaking import RMS_SHARE

_MOST_SUB_STEPS = 1000  # in one burst, so that a run can be told to stop
_GAP_CHANGE = 0.2  # of a cell's gap to the wall over which the frozen coupling may be combined with r(h)
_LARGEST_SUB_STEP = 1e-3  # s, where nothing else bounds it
_SHEARED = 0.05  # of 1/shear rate: the longest sub-step for a position error of 0.1 nm
_USUAL = 1e-4  # µm, that error
_BURST = 200  # longest sub-steps in the longest burst
_FARTHEST = 1.0  # radius of a cell, that it may go in a burst: what listens to a run hears of it as often
_FARTHER = 1.5  # than they may: at which a burst ends before its time
_DIGITS = 3  # of the longest sub-step, in grains
_RANGE_SHARE = 0.2  # of the repulsion's range that thermal motion may cross in a sub-step


@frozen(kw_only=True)
class Pace:
    """The step lengths of a run."""

    sub_step: float  # s, the longest
    longest: float  # s, of a burst
    share: float  # η: of the gap between two cells that they may move relative to each other in a burst
    error: float  # µm, local error of a motion
    rate: float  # relative error of the rates of events
    euler: float = 0.0  # s, step of the explicit scheme; 0: implicit

    @property
    def grain(self) -> float:
        """Give the time (s) that all times of states are multiples of: a power of ten."""
        return float(f"1e{math.floor(math.log10(self.sub_step)) - _DIGITS}")


def choose_pace(problem: Problem) -> Pace:
    """Choose the steps from the accuracies asked for.

    What smooth motions err by in a sub-step grows with its square, and so does the error of a coupling taken in the
    middle of a burst with η. Motions that stiff loads make short of that bound their steps themselves, by their
    estimated error, and events by their clocks.
    """
    position = problem.tolerances.position
    shear = abs(problem.setting.shear_rate)
    bounds = [_LARGEST_SUB_STEP, *_thermal_steps(problem)]
    if shear > 0:
        bounds.append(_SHEARED / shear * np.sqrt(position / _USUAL))
    sub_step = float(f"{min(bounds):.1e}")
    return Pace(
        sub_step=sub_step,
        longest=_BURST * sub_step,
        share=float(np.clip(0.02 * np.sqrt(position / _USUAL), 0.002, 0.1)),
        error=position,
        rate=problem.tolerances.rate,
        euler=problem.tolerances.euler,
    )


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


@frozen(kw_only=True)
class Stride:
    """How a burst is to be cut into sub-steps."""

    grains: int  # in one sub-step
    sub_steps: int


def stride_of(problem: Problem, pace: Pace, moves: PairMoves, drift: Array, left: float) -> Stride:
    """Choose the length of the next burst: until the cells, if they go on as before, have moved as far as they may.

    `left` (s) is the time to the run's end, to be met within a grain.
    """
    speed = np.abs(drift[:, :3]).max(axis=1)
    time = min(pace.longest, float((_FARTHEST * problem.radii / np.maximum(speed, 1e-300)).min()))
    if len(moves.pairs):
        speeds = np.linalg.norm(drift[moves.pairs[:, 0], :3] - drift[moves.pairs[:, 1], :3], axis=1)
        time = min(time, float((moves.allowed / np.maximum(speeds, 1e-300)).min()))
    grains = max(round(min(time, left) / pace.grain), 1)
    sub_steps = int(np.clip(math.ceil(grains * pace.grain / pace.sub_step * (1 - 1e-9)), 1, _MOST_SUB_STEPS))
    return Stride(grains=max(grains // sub_steps, 1), sub_steps=sub_steps)


def limits(
    problem: Problem, pace: Pace, moves: PairMoves, centres: Array, middle_gaps: Array, stride: Stride
) -> Limits:
    """Give the limits of a burst whose coupling was taken at `middle_gaps`."""
    free = problem.setting.wall & problem.coupled
    low = middle_gaps * (1 - _GAP_CHANGE) if free else np.full(len(middle_gaps), -np.inf)
    high = middle_gaps * (1 + _GAP_CHANGE) if free else np.full(len(middle_gaps), np.inf)
    error, euler = (absent(float), pace.euler) if pace.euler > 0 else (pace.error, absent(float))
    return Limits(
        stride.grains * pace.grain, stride.sub_steps, error, pace.rate, euler, centres, moves.pairs,
        _FARTHER * moves.allowed, low, high,
    )  # fmt: skip
