"""How exactly bonds form and break when they should: the same short stretches of a run, with other tolerances.

Events happen when the hazard of all that can happen to a cell has used up a random number, which is the same whatever
the tolerances are. Until paths part, the waiting times between the same events differ by what the integrated hazard is
wrong by: an error without noise, relative to the mean waiting time.
"""

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any

import numpy as np
from attrs import evolve

from mpad_core.arrays import Array
from mpad_core.physics.state import State
from mpad_core.running.initial import ZERO, initial_state
from mpad_core.running.march import Machine, march

_SAME = ("kind", "species", "receptor", "partner")  # by which two events are the same one


def moments(machine: Machine, until: float, number: int) -> list[State]:
    """Give states spread over the outer steps of a run, from which stretches can be replayed; in any step's grains."""
    seen = [state for state in march(machine, initial_state(machine), until) if len(state.bonds)]
    chosen = np.unique(np.linspace(0, len(seen) - 1, number if seen else 0).round().astype(int))
    return [evolve(seen[k], step=ZERO, zero=ZERO, time=0.0, events=seen[k].events[:0], way=None) for k in chosen]


def replay(machine: Machine, start: State, most: int, until: float) -> Any:
    """Give the first bond events after a state: as many as asked for, and those of the same outer step."""
    found, number = [start.events], 0
    for state in islice(march(machine, start, until), 1, None):
        found.append(state.events)
        number += len(state.events)
        if number >= most:
            break
    return np.concatenate(found)


def waiting_errors(found: Sequence[Any], expected: Sequence[Any]) -> Array:
    """Give by how much waiting times are wrong, relative to their mean, over all events that happened alike in both.

    Parameters
    ----------
    found, expected
        Events of the same stretches, with some tolerances and with finer ones.
    """
    errors = [error for one, other in zip(found, expected, strict=True) for error in _of_stretch(one, other)]
    return np.concatenate(errors) if errors else np.zeros(0)


def _of_stretch(found: Any, expected: Any) -> Iterator[Array]:
    """Yield each cell's; clocks are the cells' own."""
    for cell in np.unique(expected["cell"]):
        one, other = (events[events["cell"] == cell] for events in (found, expected))
        number = min(len(one), len(other))
        alike = np.all([one[name][:number] == other[name][:number] for name in _SAME], axis=0)
        last = number if alike.all() else int(np.argmin(alike))
        if last:
            waited, should = (np.diff(events["time"][:last], prepend=0.0) for events in (one, other))
            mean = float(other["time"][-1]) / len(other)
            yield np.abs(waited - should) / mean
