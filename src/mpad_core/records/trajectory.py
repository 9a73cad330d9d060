"""A trajectory as a value: all of a run's frames and bond events, in inner units."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from mpad_core.interfaces.observer import FieldDeclaration, Frame
from mpad_core.interfaces.values import Array
from mpad_core.records.header import TrajectoryHeader

_FORMED, _CHANGED = 0, 2  # BOND_EVENT's kind
_WHO = ["species", "cell", "receptor", "partner", "ligand"]  # no two living bonds have all of them alike


@frozen(kw_only=True, eq=False, repr=False)
class Trajectory:
    """What a run recorded: T frames of N cells. Quantities that were not recorded are NaN throughout."""

    header: TrajectoryHeader
    steps: NDArray[np.int64]  # (T,)
    times: Array  # (T,), s
    positions: Array  # (T, N, 3), µm
    orientations: Array  # (T, N, 4), unit quaternions, scalar first, body to space
    velocities: Array  # (T, N, 6), µm/s and 1/s
    wall_gaps: Array  # (T, N), µm
    overlaps: Array  # (T, N), µm
    bond_counts: Array  # (T, N)
    capture_hazards: Array  # (T, N), 1/s
    fields: tuple[FieldDeclaration, ...]
    observed: Mapping[str, NDArray[Any]]  # (T, *shape) by a field's name
    bond_events: NDArray[np.void]  # BOND_EVENT, in the order in which they happened
    finished: bool  # False: the writer was killed, or is still at work

    def __repr__(self) -> str:
        """Say how much there is, not what."""
        span = f"{self.times[0]:g} to {self.times[-1]:g} s" if len(self) else "no time"
        state = "finished" if self.finished else "not finished"
        size = f"{len(self)} frames of {len(self.header.cells)} cells, {len(self.bond_events)} bond events"
        return f"Trajectory({size}, {span}, {state})"

    def __len__(self) -> int:
        """Give the number of frames."""
        return len(self.times)

    def frame(self, index: int) -> Frame:
        """Give one frame as the observers saw it."""
        return Frame(
            step=int(self.steps[index]),
            time=float(self.times[index]),
            cells=self.header.cells,
            centres=self.positions[index],
            orientations=self.orientations[index],
            velocities=self.velocities[index],
            wall_gaps=self.wall_gaps[index],
            overlaps=self.overlaps[index],
            bond_counts=self.bond_counts[index],
            capture_hazards=self.capture_hazards[index],
        )


def living_bonds(trajectory: Trajectory, time: float) -> NDArray[np.void]:
    """Give the bonds alive at a time, rebuilt from the table of events.

    Parameters
    ----------
    trajectory
        with its bonds recorded
    time
        s; an event at this very time has happened

    Returns
    -------
    (B,) of BOND_EVENT
        the event in which each of them formed, in the order of forming, with the inner state that it has at the time
    """
    past = trajectory.bond_events[trajectory.bond_events["time"] <= time]
    if not len(past):
        return past
    latest = past[_last_of_each(past)]
    turned = past["kind"] == _CHANGED
    births = past[~turned][_last_of_each(past[~turned])]
    alive: NDArray[np.void] = births[births["kind"] == _FORMED]
    _, mine, current = np.intersect1d(alive[_WHO], latest[_WHO], assume_unique=True, return_indices=True)
    alive["state"][mine] = latest["state"][current]
    return alive


def _last_of_each(events: NDArray[np.void]) -> NDArray[np.intp]:
    """Give the rows of the last event of every bond, ascending."""
    _, last = np.unique(events[_WHO][::-1], return_index=True)
    rows: NDArray[np.intp] = np.sort(len(events) - 1 - last)
    return rows
