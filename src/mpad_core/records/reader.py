"""Reading a trajectory back, whether its writer ended it, was killed, or is still at work."""

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mpad_core.interfaces.values import BOND_EVENT
from mpad_core.records.contents import Contents, contents
from mpad_core.records.guard import opened
from mpad_core.records.layout import BOND_EVENTS, FRAMES, OBSERVERS_PATH, Column, optional
from mpad_core.records.trajectory import Trajectory, living_bonds

__all__ = ["Trajectory", "living_bonds", "read_trajectory"]


def read_trajectory(path: str | os.PathLike[str]) -> Trajectory:
    """Read all of a trajectory.

    Parameters
    ----------
    path
        of a run's ``trajectory.h5``: finished, live or killed. Nothing in the file is trusted

    Returns
    -------
    Trajectory
        with arrays in inner units; of a file that was cut off, all rows that are whole

    Raises
    ------
    InputError
        one line, when the file is absent, damaged, not mpad's, or made to harm
    """
    with opened(path) as file:
        found = contents(file)
        return Trajectory(
            header=found.header,
            fields=found.fields,
            bond_events=_events(found),
            finished=found.finished,
            **_frames(found),
        )


def _frames(found: Contents) -> dict[str, Any]:
    read = {column.path: _rows(found, dataset) for column, dataset in _kept(found)}
    step, time, *own = [read[column.path] for column in found.columns if column.attribute and column.path in read]
    names = [column.name for column in found.columns if column.attribute and column.path in read][2:]
    return {
        "steps": step,
        "times": time,
        **_unrecorded(found),
        **{name: values.astype(np.float64, copy=False) for name, values in zip(names, own, strict=True)},
        "observed": {field.name: read[f"{OBSERVERS_PATH}/{field.name}"] for field in found.fields},
    }


def _kept(found: Contents) -> list[tuple[Column, Any]]:
    """Leave out the positions in nm: those in µm say it exactly."""
    return [pair for pair in zip(found.columns, found.datasets, strict=True) if pair[0].is_summed]


def _rows(found: Contents, dataset: Any) -> NDArray[Any]:
    values: NDArray[Any] = dataset[: found.rows[FRAMES]]
    return values


def _unrecorded(found: Contents) -> dict[str, NDArray[np.float64]]:
    cells = len(found.header.cells)
    return {
        column.name: np.broadcast_to(np.nan, (found.rows[FRAMES], *column.shape))
        for quantity, column in optional(cells).items()
        if quantity not in found.header.quantities
    }


def _events(found: Contents) -> NDArray[np.void]:
    if found.events is None:
        return np.empty(0, dtype=BOND_EVENT)
    values: NDArray[np.void] = found.events[: found.rows[BOND_EVENTS]]
    return values
