"""Does a solver fake a vertical drift? A free cell passes a held one and must end at the height that it came from.

Stokes flow is linear, so a path run backwards is a path of the reversed flow; and what reverses the flow is the mirror
x → −x. Without weight, bonds and contact a path past a held cell is therefore its own mirror image, and the free cell
ends where it started. A discretisation that is not symmetric fore and aft breaks this, and what looks like settling or
lift is its error. One that is symmetric ends at the right height however coarse it is: hence the highest point, too.
"""

import time

import numpy as np
from attrs import field, frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration
from mpad_core.physics import asking
from mpad_core.physics.problem import Problem
from mpad_core.physics.questions import constrained_motion, unit_load

SPAN = 60.0  # µm, from so far upstream of the held cell to as far downstream
HELD, FREE = 0, 1
_LOOKS = 481  # places on the way where the height is looked at
_TRIES = 3  # solves at a place whose time is taken


@frozen(kw_only=True)
class Level:
    """A solver at one level of accuracy."""

    name: str
    solver: MobilitySolver
    error: float = 1e-9  # of the integrator in a step: relative, and in µm


@frozen(kw_only=True)
class Return:
    """How a cell came back to its height."""

    name: str
    drift: float  # nm, height at the end less that at the start
    side: float  # nm, the same across the flow
    lowest: float  # nm on the way, from the start
    highest: float  # nm
    solve: float  # ms of prepare and solve: median over places on the way
    solves: int


@frozen(kw_only=True, eq=False)
class Meeting:
    """A held cell, and a free one that the flow carries past it."""

    problem: Problem = field(repr=False)  # the held cell first; its contact, bonds and loads are left out
    span: float = SPAN  # µm

    @classmethod
    def of(cls, problem: Problem, held: str, free: str, span: float = SPAN) -> "Meeting":
        """Take two cells of a problem, at their heights and their distance across the flow."""
        return cls(problem=problem.only([problem.names.index(held), problem.names.index(free)]), span=span)

    def at(self, x: float, place: Array) -> Configuration:
        """Give the configuration with the free cell at x (µm) from the held one, y and z as in `place`."""
        held = self.problem.start[HELD]
        free = [held[0] + x, *place]
        return Configuration(centres=np.array([held, free]), radii=self.problem.radii)


@frozen(kw_only=True, eq=False)
class _Slope:
    """How y and z of the free cell change along x, by a solver's velocities with the other cell held."""

    meeting: Meeting
    level: Level
    plan: object
    unit: Array
    places: list[float] = field(factory=list)  # µm, where it was asked for

    def __call__(self, x: float, place: Array) -> Array:
        self.places.append(x)
        prepared = asking.prepare(self.level.solver, self.plan, self.meeting.at(x, place))
        motion = constrained_motion(self.level.solver, prepared, np.zeros((2, 6)), np.array([HELD]), self.unit)
        speed = motion.velocity[FREE]
        if not speed[0] > 0:
            raise RefusedError(f"{self.level.name}: the flow does not carry the free cell on at x = {x:.4g} um")
        return np.asarray(speed[1:3] / speed[0])

    def time(self, x: float, place: Array) -> float:
        """Give the time (s) of a solve: the least of some, since others may be at work on the machine."""
        times = [time.perf_counter()]
        for _ in range(_TRIES):
            self(x, place)
            times.append(time.perf_counter())
        return float(np.diff(times).min())


def returned(meeting: Meeting, level: Level) -> Return:
    """Carry the free cell past the held one, from `span` before it to `span` behind it.

    Its place along the flow is the independent variable, so the end is met exactly; Dormand and Prince's method of
    order 8 keeps its estimated error in a step below the level's.

    Raises
    ------
    RefusedError
        If the solver refuses on the way, or stops the cell.
    """
    from scipy.integrate import solve_ivp

    problem = meeting.problem
    radius, setting = float(problem.radii.max()), problem.setting
    unit = unit_load(setting.viscosity, radius, abs(setting.shear_rate) * radius)
    slope = _Slope(meeting=meeting, level=level, plan=level.solver.plan(setting), unit=unit)
    start = problem.start[FREE, 1:]
    way = solve_ivp(
        slope, (-meeting.span, meeting.span), start, method="DOP853", rtol=level.error, atol=level.error,
        t_eval=np.linspace(-meeting.span, meeting.span, _LOOKS),
    )  # fmt: skip
    if not way.success:
        raise RefusedError(f"{level.name}: {way.message}")
    solves = len(slope.places)
    times = [slope.time(x, place) for x, place in zip(way.t[:: _LOOKS // 8], way.y.T[:: _LOOKS // 8], strict=True)]
    moved = 1e3 * (way.y - start[:, None])
    return Return(
        name=level.name, drift=float(moved[1, -1]), side=float(moved[0, -1]), lowest=float(moved[1].min()),
        highest=float(moved[1].max()), solve=1e3 * float(np.median(times)), solves=solves,
    )  # fmt: skip
