"""The march: outer steps one after the other, each a solve for the coupling and a burst under it.

The coupling is taken at the configuration predicted for the middle of the burst, which makes the outer step second
order. Everything that decides about a step is in the state, so a march that goes on from a stored state takes the very
same steps.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from attrs import evolve, frozen

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.values import Configuration
from mpad_core.numerics.tables import value
from mpad_core.physics.couplers import Drift, coupler, drift_of
from mpad_core.physics.coupling import Coupler, Coupling, Watch, contact_range, contact_reach, joined
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import BondList, State, Way
from mpad_core.physics.wall_density import Rasters, rasters
from mpad_core.running import assembly, pace
from mpad_core.running.burst import NO_BALANCE, NOT_POSITIVE, ROOM_NEEDED, burst
from mpad_core.running.capturing import with_captures
from mpad_core.running.crossing import apart, crossing, refusal
from mpad_core.running.layout import Clocks, Course, Dice, Limits, Motion, Progress, Trail
from mpad_core.running.moving import refresh_turns
from mpad_core.running.reacting import TENSION, bond_length

_MORE_ROOM = 4  # times as much whenever a burst asks for it


@frozen(kw_only=True, eq=False)
class Machine:
    """A problem made ready to march."""

    problem: Problem
    fixed: assembly.Fixed
    pace: pace.Pace
    coupler: Coupler
    drift: Drift
    rasters: Rasters

    def lengths_and_tensions(self, state: State) -> tuple[Array, Array]:
        """Give the length (µm) and tension (pN) of every living bond."""
        bonds, turns = state.bonds, np.empty((len(state.wall_gaps), 3, 3))
        motion = assembly.motion_of(state)
        refresh_turns(motion, turns)
        laid = assembly.room_for(self.fixed, bonds, len(turns)).bonds
        places = [b for c in range(len(turns)) for b in range(laid.first[c], laid.first[c] + laid.number[c])]
        molecules, species = self.fixed.molecules, self.fixed.species
        lengths = [
            bond_length(b, c, motion.centre, turns, laid, molecules) for b, c in zip(places, bonds.cell, strict=True)
        ]
        rows = species.first[bonds.species] + bonds.state
        tensions = [value(species.tables, k, TENSION, x) for k, x in zip(rows, lengths, strict=True)]
        return np.array(lengths), np.array(tensions)


def make_ready(problem: Problem, plan: Any = None) -> Machine:
    """Tabulate laws, place molecules, choose steps and let the solver make its plan.

    `plan` is one that the solver has made already, for this problem or for another in the same fluid.
    """
    fixed = assembly.assemble(problem)
    coupling = coupler(problem, plan)
    return Machine(
        problem=problem, fixed=fixed, pace=pace.choose_pace(problem), coupler=coupling,
        drift=drift_of(problem, coupling), rasters=rasters(problem, fixed.species.reach),
    )  # fmt: skip


def configuration_of(problem: Problem, state: State) -> Configuration:
    """Give where the cells are."""
    return Configuration(centres=state.centres, radii=problem.radii, wall_gaps=state.wall_gaps)


def _ahead(problem: Problem, state: State, pairs: Indices, time: float) -> Configuration:
    """Predict the configuration a time ahead; no gap to the wall closes by more than a tenth, none of pairs by half."""
    shift = apart(problem, pairs, state.centres, state.drift[:, :3] * time)
    if problem.setting.wall:
        shift[:, 2] = np.maximum(shift[:, 2], -0.1 * state.wall_gaps)
    return Configuration(centres=state.centres + shift, radii=problem.radii, wall_gaps=state.wall_gaps + shift[:, 2])


def march(machine: Machine, state: State, until: float) -> Iterator[State]:
    """Yield the state after each outer step, the one given first, up to a time (s).

    Raises
    ------
    RefusedError
        If the solver or the balance of loads refuses, or if cells are driven through each other; naming the cells.
    """
    yield state
    while state.time < until - 0.5 * machine.pace.grain:
        state = step(machine, state, until)
        yield state


def step(machine: Machine, state: State, until: float) -> State:
    """Take one outer step: a shorter one where smooth spheres would pass through each other or the wall.

    Raises
    ------
    RefusedError
        If they would in the shortest there is.
    """
    left = until - state.time
    while True:
        following = _outer_step(machine, state, left)
        found = crossing(machine.problem, state, following)
        if found is None:
            return following
        grains = following.step - state.step
        if grains == 1:
            raise refusal(machine.problem, found, state)
        left = 0.5 * grains * machine.pace.grain


def _outer_step(machine: Machine, state: State, left: float) -> State:
    """Take one outer step of at most the time left (s), to within a grain."""
    problem = machine.problem
    moves = pace.pair_moves(problem, _coupled_pairs(machine, state), state.centres, machine.pace.share)
    stride = pace.stride_of(problem, machine.pace, moves, state.drift, left)
    middle = _ahead(problem, state, moves.pairs, 0.5 * stride.sub_steps * stride.grains * machine.pace.grain)
    coupling = machine.coupler.at(middle, state.mean_loads, state.guess, Watch(state.level, state.trust))
    coupling = machine.drift.added(coupling, middle, state.step)
    bounds = pace.limits(problem, machine.pace, moves, state.centres, middle.wall_gaps, stride)
    return _burst(machine, state, joined(coupling, state.bonds.pairs()), bounds, stride.grains)


def _coupled_pairs(machine: Machine, state: State) -> Any:
    """List the pairs whose relative motion bounds a burst: all that are coupled, or could touch."""
    problem = machine.problem
    bounding = problem.coupled or contact_reach(problem) > 0
    return assembly.near_pairs(problem, state.centres, np.inf if bounding else -np.inf)


class _Done(NamedTuple):
    """What a burst has made."""

    motion: Motion
    clocks: Clocks
    bonds: BondList
    events: Any
    progress: Progress
    trail: Trail


def _burst(machine: Machine, state: State, coupling: Coupling, bounds: Limits, stride: int) -> State:
    """Run the burst, with as much room for bonds and events as it needs; make the next state of its outcome."""
    problem, fixed = machine.problem, machine.fixed
    around = machine.rasters.at(state.centres)
    data = assembly.system(problem, fixed, state, coupling, contact_range(problem), around)
    motion, clocks = assembly.motion_of(state), assembly.clocks_of(fixed, state)
    cells = len(state.wall_gaps)
    progress, trail = assembly.progress_of(len(coupling.groups), cells), assembly.trail_for(cells, bounds.most)
    dice = Dice(fixed.key, state.step, stride)
    outcome, times, bonds, events, ahead = ROOM_NEEDED, 1, state.bonds, [], np.zeros((cells, 2))
    while outcome == ROOM_NEEDED:
        room = assembly.room_for(fixed, bonds, cells, assembly.neighbours_in(data), times)
        adhesion = assembly.adhesion_of(problem, room, clocks, ahead)
        outcome, group = burst(Course(data, bounds, dice, motion, np.empty((cells, 3, 3)), progress, trail, adhesion))
        bonds = assembly.bond_list(room.bonds)
        events.append(room.events[: progress.events[0]])
        if progress.events[0] < len(room.events):  # not of these was there too little room
            times *= _MORE_ROOM
        progress.events[0] = 0
    if outcome == NO_BALANCE or (outcome == NOT_POSITIVE and progress.beats[0] == 0):
        _refuse(machine, state, coupling, outcome, group)
    made = _Done(motion, clocks, bonds, np.concatenate(events), progress, trail)
    return _next(machine, state, made, coupling, stride)


def _refuse(machine: Machine, state: State, coupling: Coupling, outcome: int, group: int) -> None:
    problem = machine.problem
    cells = coupling.groups[group]
    where = ", ".join(f"{problem.names[i]} (gap to the wall {state.wall_gaps[i]:.4g} um)" for i in cells)
    what = "no sub-step balances the loads" if outcome == NO_BALANCE else "resistance is not positive definite"
    raise RefusedError(
        f"step {state.step - state.zero}, t = {state.time:.6g} s: {what} for {where}; solver {problem.solver.name!r}"
    )


def _next(machine: Machine, state: State, made: _Done, coupling: Coupling, stride: int) -> State:
    steps = int(made.progress.beats[0]) * stride
    done = state.step + steps
    lasted = steps * machine.pace.grain
    motion = made.motion
    moved = motion.centre - state.centres
    following = evolve(
        state,
        step=done,
        time=(done - state.zero) * machine.pace.grain,
        centres=motion.centre,
        wall_gaps=motion.gap,
        orientations=motion.orientation,
        velocities=motion.velocity,
        drift=np.concatenate([moved, motion.turn], axis=1) / lasted,
        mean_loads=motion.impulse / lasted,
        bonds=made.bonds,
        clocks=made.clocks.left,
        draws=made.clocks.number.astype(float),
        guess=coupling.guess,
        level=coupling.watch.level,
        trust=coupling.watch.trust,
        events=_in_order(made.events, state.zero, stride, machine.pace.grain),
        way=_way(state, made, machine.pace.grain),
    )
    return with_captures(machine.problem, following)


def _in_order(events: Any, zero: int, stride: int, grain: float) -> Any:
    """Put events in the order of time; they hold when their sub-step began, and the share of it until then."""
    events["step"] -= zero
    events["time"] = (events["step"] + events["time"] * stride) * grain
    return events[np.argsort(events["time"], kind="stable")]


def _way(state: State, made: _Done, grain: float) -> Way:
    """Give the places that the burst has noted, its end last."""
    noted, trail = int(made.progress.trail[0]), made.trail
    steps = state.step + trail.step[:noted]
    return Way(
        steps=steps,
        times=np.asarray((steps - state.zero) * grain, float),
        centres=trail.centre[:noted],
        wall_gaps=trail.gap[:noted],
        orientations=trail.orientation[:noted],
        turns=trail.turn[:noted],
    )
