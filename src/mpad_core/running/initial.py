"""The state at time zero, with every cell that first rolls alone brought to where its bonds have a steady state."""

from collections.abc import Callable

import numpy as np
from attrs import evolve

from mpad_core.arrays import Array
from mpad_core.physics.coupling import lone_cell
from mpad_core.physics.molecules import site_counts
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import BondList, State, no_bonds
from mpad_core.running.clocks import drawn
from mpad_core.running.crossing import refuse_overlaps
from mpad_core.running.march import Machine, configuration_of, make_ready, march

ZERO = 1 << 40  # the sub-step of time zero: the same with and without preparations, and so are the draws after it

Listener = Callable[[str, State], None]


def at_rest(machine: Machine) -> State:
    """Give the cells at their places, without bonds, moving as flow and weight alone would have them.

    Raises
    ------
    RefusedError
        If smooth spheres overlap there, or the wall cuts one.
    """
    problem = machine.problem
    cells = len(problem.names)
    refuse_overlaps(problem, problem.start, problem.start[:, 2] - problem.radii)
    state = State(
        step=0,
        zero=0,
        time=0.0,
        centres=problem.start.copy(),
        wall_gaps=problem.start[:, 2] - problem.radii,
        orientations=np.tile([1.0, 0.0, 0.0, 0.0], (cells, 1)),
        velocities=np.zeros((cells, 6)),
        drift=np.zeros((cells, 6)),
        mean_loads=problem.external.copy(),
        bonds=no_bonds(),
        clocks=np.array([drawn(machine.fixed.key, owner, 0) for owner in machine.fixed.molecules.owner]),
        draws=np.zeros(cells),
        bound_since=np.full(cells, np.inf),
        bound_at=problem.start[:, 0].copy(),
        caught_since=np.full(cells, np.inf),
    )
    return evolve(state, drift=_first_velocities(machine, state))


def _first_velocities(machine: Machine, state: State) -> Array:
    """Give the velocities (N, 6) under weight and flow: where the first outer step predicts its middle from."""
    problem = machine.problem
    coupling = machine.coupler.at(configuration_of(problem, state), state.mean_loads, None)
    velocity = np.zeros((len(problem.names), 6))
    for group, matrix in zip(coupling.groups, coupling.matrices, strict=True):
        resistance = matrix.copy()
        right = np.zeros(6 * len(group))
        for place, cell in enumerate(group):
            o = 6 * place
            lone, ambient = lone_cell(
                problem.setting, float(problem.radii[cell]), float(state.centres[cell, 2]), float(state.wall_gaps[cell])
            )
            resistance[o : o + 6, o : o + 6] += lone
            right[o : o + 6] = problem.external[cell] + ambient + coupling.loads[cell]
        velocity[group] = np.linalg.solve(resistance, right).reshape(-1, 6)
    return velocity


def initial_state(machine: Machine, listener: Listener = lambda name, state: None) -> State:
    """Give the state at time zero.

    Cells that first roll alone do so one after the other, each without all others; then each is moved back along the
    wall, its bonds with it, to the place that the scene gives. `listener` hears every state of these preparations.
    """
    problem, state = machine.problem, at_rest(machine)
    for cell in np.flatnonzero(problem.alone_for > 0):
        alone = make_ready(problem.only([cell]), machine.coupler.plan)
        rolled = at_rest(alone)
        for rolled_on in march(alone, rolled, float(problem.alone_for[cell])):
            rolled = rolled_on
            listener(problem.names[cell], rolled)
        state = _placed(problem, state, rolled, int(cell))
    refuse_overlaps(problem, state.centres, state.wall_gaps)
    return evolve(state, step=ZERO, zero=ZERO)


def _placed(problem: Problem, state: State, rolled: State, cell: int) -> State:
    """Put one prepared cell into the state of all."""
    shift = problem.start[cell] - rolled.centres[0]
    shift[2] = 0.0
    first_site = int(site_counts(problem)[:cell].sum())
    own = rolled.bonds
    bonds = BondList(
        cell=np.concatenate([state.bonds.cell, np.full(len(own), cell)]),
        site=np.concatenate([state.bonds.site, own.site + first_site]),
        species=np.concatenate([state.bonds.species, own.species]),
        state=np.concatenate([state.bonds.state, own.state]),
        partner=np.concatenate([state.bonds.partner, own.partner]),
        ligand=np.concatenate([state.bonds.ligand, own.ligand]),
        anchor=np.concatenate([state.bonds.anchor, own.anchor + shift]),
    )
    changed = {"centres": rolled.centres[0] + shift}
    names = ("wall_gaps", "orientations", "velocities", "drift", "mean_loads", "clocks", "draws")
    changed |= {name: getattr(rolled, name)[0] for name in names}
    changed["caught_since"] = 0.0 if np.isfinite(rolled.caught_since[0]) else np.inf
    changed["bound_since"] = 0.0 if len(own) else np.inf
    changed["bound_at"] = problem.start[cell, 0]
    arrays = {}
    for name, value in changed.items():
        arrays[name] = getattr(state, name).copy()
        arrays[name][cell] = value
    return evolve(state, bonds=bonds, **arrays)
