"""Salvage: a trajectory that was cut off is never written to again, but copied, as far as its rows are whole."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mpad_core.interfaces.errors import InputError
from mpad_core.interfaces.observer import FieldDeclaration
from mpad_core.records.contents import Contents, contents
from mpad_core.records.creation import CHUNK_BYTES, create_file, extend, settle, unless_it_fails
from mpad_core.records.guard import opened
from mpad_core.records.header import TrajectoryHeader
from mpad_core.records.layout import BOND_EVENTS, EVENT_SUMS_PATH, EVENTS_PATH, FRAMES, ROW_SUMS_PATH
from mpad_core.records.room import RESERVE, need_room
from mpad_core.records.sums import blocks


def salvage(
    path: Path,
    rows: Mapping[str, int],
    *,
    chunk_bytes: int = CHUNK_BYTES,
    reserve: int = RESERVE,
) -> tuple[Any, TrajectoryHeader, tuple[FieldDeclaration, ...]]:
    """Replace a trajectory by a copy cut to some rows, and leave the copy open for writing.

    Parameters
    ----------
    path
        the trajectory: finished, interrupted or killed
    rows
        how many of `frames` and of `bond_events` to keep
    chunk_bytes, reserve
        as for `TrajectoryWriter.create`

    Returns
    -------
    file : h5py.File, in SWMR mode
    header : TrajectoryHeader
    fields : tuple of FieldDeclaration

    Raises
    ------
    InputError
        when the file is damaged, not ours, or holds fewer rows
    DiskFullError
        when there is no room for the copy; the old file is kept
    """
    with opened(path) as source:
        found = contents(source)
        kept = _kept(rows, found)
        need_room(path.parent, reserve + path.stat().st_size)
        copy = create_file(path, found.header, found.fields, chunk_bytes=chunk_bytes)
        with unless_it_fails(copy, path):
            _copy(source, copy, found, kept)
        settle(copy, path)
    return copy, found.header, found.fields


def repair(path: str | os.PathLike[str]) -> dict[str, int]:
    """Replace a trajectory that was cut off by a finished one, with every row that is whole.

    Hold the directory's lock. A run that shall be resumed needs no repair.

    Returns
    -------
    rows : how many `frames` and `bond_events` there are now

    Raises
    ------
    InputError, DiskFullError
        as `salvage`
    """
    with opened(path) as source:
        rows = dict(contents(source).rows)
    copy, _, _ = salvage(Path(path), rows)
    copy.close()
    return rows


def _kept(rows: Mapping[str, int], found: Contents) -> dict[str, int]:
    kept = {}
    for name in (FRAMES, BOND_EVENTS):
        kept[name] = int(rows.get(name, 0))
        if not 0 <= kept[name] <= found.rows[name]:
            raise InputError(
                f"holds {found.rows[name]} {name}, the checkpoint counts {kept[name]}: they do not belong together"
            )
    return kept


def _copy(source: Any, copy: Any, found: Contents, kept: Mapping[str, int]) -> None:
    for path in (*(column.path for column in found.columns), ROW_SUMS_PATH):
        _copy_rows(source[path], copy[path], kept[FRAMES])
    for path in (EVENTS_PATH, EVENT_SUMS_PATH) if found.events is not None else ():
        _copy_rows(source[path], copy[path], kept[BOND_EVENTS])


def _copy_rows(source: Any, target: Any, rows: int) -> None:
    for start, stop in blocks(rows, int(np.prod(source.shape[1:])) * source.dtype.itemsize):
        extend(target, source[start:stop])
