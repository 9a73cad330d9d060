"""Situations that a problem's own run comes through: where solvers are tried for it."""

from collections.abc import Iterator
from itertools import islice

import numpy as np

from mpad_core.interfaces.errors import RefusedError
from mpad_core.physics.levels import Situation
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import State
from mpad_core.running.initial import initial_state
from mpad_core.running.march import Machine, configuration_of, march


def situation_of(problem: Problem, state: State) -> Situation:
    """Give where the cells are, and the loads that the last outer step had in the mean."""
    held = np.flatnonzero(problem.held)
    return Situation(configuration=configuration_of(problem, state), loads=state.mean_loads, held=held)


def situations(machine: Machine, until: float, number: int, most_steps: int | None = None) -> list[Situation]:
    """March, and give situations spread evenly over the outer steps, the one of the closest pair among them.

    Parameters
    ----------
    machine
        A problem made ready.
    until
        Time (s) to march to at most.
    number
        Of situations to be chosen, at least 2.
    most_steps
        Outer steps to take at most.

    Returns
    -------
    list
        In the order of time, the start first. Fewer than asked for where there were fewer outer steps. A march that is
        refused ends where it was.

    Raises
    ------
    RefusedError
        If the very start is refused.
    """
    seen = [situation_of(machine.problem, state) for state in islice(_as_far_as_it_goes(machine, until), most_steps)]
    if not seen:
        raise RefusedError(f"solver {machine.problem.solver.name!r} refuses where the run begins")
    chosen = set(np.linspace(0, len(seen) - 1, number - 1).round().astype(int).tolist())
    return [seen[k] for k in sorted(chosen | {int(np.argmin([one.closest()[0] for one in seen]))})]


def _as_far_as_it_goes(machine: Machine, until: float) -> Iterator[State]:
    try:
        yield from march(machine, initial_state(machine), until)
    except RefusedError:
        return
