"""The march: outer steps one after the other, each a solve for the coupling and a burst under it.

The coupling is taken at the configuration predicted for the middle of the burst, which makes the outer step second
order. Everything that decides about a step is in the state, so a march that goes on from a stored state takes the very
same steps.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from attrs import evolve, frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.values import BOND_EVENT, Configuration
from mpad_core.numerics.tables import value
from mpad_core.physics.coupling import Coupler, Coupling, Drift, contact_range, coupler, drift_of, lone_velocity
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import State
from mpad_core.running import assembly, pace
from mpad_core.running.burst import NO_BALANCE, NOT_POSITIVE, ROOM_NEEDED, burst
from mpad_core.running.layout import Dice, Limits, Motion
from mpad_core.running.moving import refresh_turns
from mpad_core.running.reacting import TENSION, length_of

_EVENTS = 4096  # room to begin with; it grows


@frozen(kw_only=True, eq=False)
class Machine:
    """A problem made ready to march."""

    problem: Problem
    fixed: assembly.Fixed
    pace: pace.Pace
    coupler: Coupler
    drift: Drift

    def lengths_and_tensions(self, state: State) -> tuple[Array, Array]:
        """Give the length (µm) and tension (pN) of every living bond."""
        bonds, turns = state.bonds, np.empty((len(state.wall_gaps), 3, 3))
        motion = assembly.motion_of(state)
        refresh_turns(motion, turns)
        laid = assembly.bond_room(bonds, len(bonds))
        lengths = np.array([length_of(b, laid, self.fixed.molecules, motion, turns) for b in range(len(bonds))])
        tables = self.fixed.species.tables
        tensions = [value(tables, k, TENSION, x) for k, x in zip(bonds.species, lengths, strict=True)]
        return lengths, np.array(tensions)


def make_ready(problem: Problem, plan: Any = None) -> Machine:
    """Tabulate laws, place molecules, choose steps and let the solver make its plan.

    `plan` is one that the solver has made already, for this problem or for another in the same fluid.
    """
    fixed = assembly.assemble(problem)
    coupling = coupler(problem, plan)
    return Machine(
        problem=problem, fixed=fixed, pace=pace.choose_pace(problem, fixed), coupler=coupling,
        drift=drift_of(problem, coupling),
    )  # fmt: skip


def configuration_of(problem: Problem, state: State) -> Configuration:
    """Give where the cells are."""
    return Configuration(centres=state.centres, radii=problem.radii, wall_gaps=state.wall_gaps)


def _ahead(problem: Problem, state: State, time: float) -> Configuration:
    """Predict the configuration a time ahead; no gap to the wall closes by more than a tenth."""
    shift = state.drift[:, :3] * time
    if problem.setting.wall:
        shift[:, 2] = np.maximum(shift[:, 2], -0.1 * state.wall_gaps)
    return Configuration(centres=state.centres + shift, radii=problem.radii, wall_gaps=state.wall_gaps + shift[:, 2])


def march(machine: Machine, state: State, until: float) -> Iterator[State]:
    """Yield the state after each outer step, the one given first, up to a time (s).

    Raises
    ------
    RefusedError
        If the solver or the balance of loads refuses, naming the cells.
    """
    yield state
    while state.time < until - 0.5 * machine.pace.sub_step:
        state = step(machine, state, until)
        yield state


def step(machine: Machine, state: State, until: float) -> State:
    """Take one outer step."""
    problem = machine.problem
    moves = pace.pair_moves(problem, _coupled_pairs(machine, state), state.centres, machine.pace.share)
    length = pace.expected_length(machine.pace, moves, state.drift)
    middle = _ahead(problem, state, 0.5 * min(length, until - state.time))
    coupling = machine.drift.added(machine.coupler.at(middle, state.mean_loads, state.guess), middle, state.step)
    left = until - state.time
    bounds = pace.limits(problem, machine.pace, moves, state.centres, middle.wall_gaps, left)
    return _burst(machine, state, coupling, bounds)


def _coupled_pairs(machine: Machine, state: State) -> Any:
    """List the pairs whose relative motion bounds a burst: all that are coupled, or could touch."""
    problem = machine.problem
    bounding = problem.coupled or problem.contact is not None
    return assembly.near_pairs(problem, state.centres, np.inf if bounding else -np.inf)


def _burst(machine: Machine, state: State, coupling: Coupling, bounds: Limits) -> State:
    """Run the burst, with as much room for bonds and events as it needs; make the next state of its outcome."""
    problem, fixed = machine.problem, machine.fixed
    data = assembly.system(problem, fixed, state, coupling, contact_range(problem))
    motion = assembly.motion_of(state)
    bound = np.zeros(len(fixed.molecules.kind), np.uint8)
    bound[state.bonds.site] = 1
    bonds = assembly.bond_room(state.bonds, 2 * len(state.bonds) + _EVENTS)
    events: list[Any] = []
    total = 0
    while True:
        buffer: Any = np.zeros(len(bonds.cell) + _EVENTS, BOND_EVENT)
        filled = np.zeros(1, np.int64)
        left = bounds._replace(most=bounds.most - total)
        outcome, done, group = burst(
            data, bonds, bound, motion, left, Dice(fixed.key, state.step + total), buffer, filled
        )
        total += done
        events.append(buffer[: filled[0]])
        if outcome != ROOM_NEEDED:
            break
        bonds = assembly.bond_room(assembly.bond_list(bonds), 2 * len(bonds.cell) + _EVENTS)
    if outcome == NO_BALANCE or (outcome == NOT_POSITIVE and total == 0):
        _refuse(machine, state, coupling, outcome, group)
    return _next(machine, state, motion, assembly.bond_list(bonds), np.concatenate(events), total, coupling)


def _refuse(machine: Machine, state: State, coupling: Coupling, outcome: int, group: int) -> None:
    problem = machine.problem
    cells = coupling.groups[group]
    where = ", ".join(f"{problem.names[i]} (gap to the wall {state.wall_gaps[i]:.4g} um)" for i in cells)
    what = "no sub-step balances the loads" if outcome == NO_BALANCE else "resistance is not positive definite"
    raise RefusedError(
        f"step {state.step - state.zero}, t = {state.time:.6g} s: {what} for {where}; solver {problem.solver.name!r}"
    )


def _next(
    machine: Machine, state: State, motion: Motion, bonds: Any, events: Any, steps: int, coupling: Coupling
) -> State:
    done = state.step + steps
    now = (done - state.zero) * machine.pace.sub_step
    lasted = steps * machine.pace.sub_step
    events["step"] -= state.zero
    events["time"] = events["step"] * machine.pace.sub_step
    moved = motion.centre - state.centres
    following = evolve(
        state,
        step=done,
        time=now,
        centres=motion.centre,
        wall_gaps=motion.gap,
        orientations=motion.orientation,
        velocities=motion.velocity,
        drift=np.concatenate([moved, motion.turn], axis=1) / lasted,
        mean_loads=motion.impulse / lasted,
        bonds=bonds,
        guess=coupling.guess,
        events=events,
    )
    return _with_captures(machine.problem, following)


def _with_captures(problem: Problem, state: State) -> State:
    """Keep account of who is caught: bound without a break for a while, and slow over that while."""
    bound = state.bond_counts() > 0
    since = np.where(bound, np.minimum(state.bound_since, state.time), np.inf)
    at = np.where(np.isinf(state.bound_since) | ~bound, state.centres[:, 0], state.bound_at)
    caught = np.where(bound, state.caught_since, np.inf)
    for i in np.flatnonzero(bound & (state.time - since >= problem.caught.bound_for)):
        speed = abs(state.centres[i, 0] - at[i]) / max(state.time - since[i], 1e-300)
        place = float(problem.radii[i]), float(state.centres[i, 2]), float(state.wall_gaps[i])
        if speed < problem.caught.slower_than * lone_velocity(problem.setting, *place):
            caught[i] = min(caught[i], state.time)
        since[i], at[i] = state.time, state.centres[i, 0]  # a new while begins
    return evolve(state, bound_since=since, bound_at=at, caught_since=caught)
