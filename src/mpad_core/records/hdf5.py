"""The trajectory's writer: H5MD for others, the /mpad group for ourselves, safe against being killed at any moment."""

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from mpad_core.interfaces.observer import FieldDeclaration, Frame
from mpad_core.interfaces.values import BOND_EVENT
from mpad_core.records.creation import CHUNK_BYTES, create_file, extend, settle
from mpad_core.records.header import TrajectoryHeader
from mpad_core.records.layout import (
    BOND_EVENTS,
    EVENT_SUMS_PATH,
    EVENTS_PATH,
    FRAMES,
    ROW_SUMS_PATH,
    columns,
    frame_rows,
)
from mpad_core.records.room import (
    RESERVE,
    BrokenTrajectoryError,
    NearlyFullError,
    free_bytes,
    is_no_room,
    let_go,
    need_room,
)
from mpad_core.records.salvage import salvage
from mpad_core.records.sums import row_sums

_FLOOR = 2**19  # bytes for a new chunk in every dataset: without them beside the rows a flush is not even tried


class TrajectoryWriter:
    """Writes a trajectory; made by `create` or `resume`.

    Rows given to `append` and `append_events` wait in memory until `flush`; what has been flushed survives the death
    of the process. After a `NearlyFullError` everything is safe and the file still open; after a
    `BrokenTrajectoryError` it has already been let go of and stays as the last good flush left it, and `close` and
    `abandon` do nothing more.
    """

    def __init__(
        self,
        file: Any,
        header: TrajectoryHeader,
        fields: Sequence[FieldDeclaration],
        *,
        path: Path,
        reserve: int = RESERVE,
    ) -> None:
        self.header = header
        self.fields = tuple(fields)
        self.path = path
        self._reserve = reserve
        self._file = file
        self._open = True
        self._columns = columns(header, fields)
        self._datasets = [file[column.path] for column in self._columns]
        self._sums = file[ROW_SUMS_PATH]
        self._table, self._table_sums = map(file.get, (EVENTS_PATH, EVENT_SUMS_PATH))
        self._frames: list[tuple[NDArray[np.generic], ...]] = []
        self._events: list[NDArray[np.void]] = []
        self._rows = {FRAMES: self._datasets[0].shape[0], BOND_EVENTS: 0 if self._table is None else len(self._table)}

    @classmethod
    def create(
        cls,
        path: str | os.PathLike[str],
        header: TrajectoryHeader,
        fields: Sequence[FieldDeclaration] = (),
        *,
        chunk_bytes: int = CHUNK_BYTES,
        reserve: int = RESERVE,
    ) -> Self:
        """Make a new trajectory with all its datasets.

        Parameters
        ----------
        path
            must not exist yet; hold the directory's lock (`locked`) from before this call until after `close`
        header
            what is written once
        fields
            what the observers declared, in the order in which `append` is given the values
        chunk_bytes
            about how large the pieces are in which a dataset grows
        reserve
            bytes that must stay free on the disk; `flush` stops before

        Raises
        ------
        FileExistsError
            when there is such a file
        InputError
            when a field cannot be stored
        DiskFullError
            when less than the reserve is free
        """
        target = Path(path)
        need_room(target.parent, reserve)
        if target.exists():
            raise FileExistsError(f"{target}: exists already")
        file = create_file(target, header, fields, chunk_bytes=chunk_bytes)
        settle(file, target)
        return cls(file, header, fields, path=target, reserve=reserve)

    @classmethod
    def resume(
        cls,
        path: str | os.PathLike[str],
        rows: Mapping[str, int],
        *,
        chunk_bytes: int = CHUNK_BYTES,
        reserve: int = RESERVE,
    ) -> Self:
        """Go on with a trajectory that was killed, interrupted or ended, from the rows that a checkpoint counted.

        The old file is read only, and replaced by a copy cut to those rows.

        Parameters
        ----------
        path
            the trajectory
        rows
            what `rows()` gave when the checkpoint was written; empty for a run that died before its first one
        chunk_bytes, reserve
            as in `create`

        Raises
        ------
        InputError
            when the file is damaged, not ours, or holds fewer rows
        DiskFullError
            when there is no room for the copy
        """
        target = Path(path)
        file, header, fields = salvage(target, rows, chunk_bytes=chunk_bytes, reserve=reserve)
        return cls(file, header, fields, path=target, reserve=reserve)

    def append(self, frame: Frame, values: Sequence[object] = ()) -> None:
        """Take a frame and the observers' values, in the order in which their fields were declared.

        Raises
        ------
        PartError
            when the number of values or the shape of one is not as declared; nothing is taken then
        """
        self._frames.append(frame_rows(self._columns, frame, values, len(self.header.cells)))

    def append_events(self, events: NDArray[np.void]) -> None:
        """Take bond events, a structured array of type BOND_EVENT, in the order in which they happened.

        Where the header leaves bonds out, they are not recorded.
        """
        if self._table is not None and len(events):
            self._events.append(np.array(events, dtype=BOND_EVENT))

    def flush(self, *, sync: bool = False) -> None:
        """Write all rows taken so far, so that they survive the death of this process.

        Parameters
        ----------
        sync
            also wait until they survive the death of the machine (tens of milliseconds)

        Raises
        ------
        NearlyFullError
            the rows are written, but less than the reserve is free: write a checkpoint and stop
        BrokenTrajectoryError
            the rows could not be written and the file has been let go of: stop, resume from the last checkpoint
        """
        if not self._open:
            raise BrokenTrajectoryError(f"{self.path}: is closed, nothing more can be recorded")
        free = free_bytes(self.path.parent)
        pending = self._pending_bytes()
        if free < pending + _FLOOR:
            self.abandon()
            raise BrokenTrajectoryError(f"{self.path}: disk full, {free} bytes free for {pending} bytes of new rows")
        self._write(sync=sync)
        left = free - pending
        if left < self._reserve:
            raise NearlyFullError(f"{self.path}: disk nearly full, {left} bytes free of the {self._reserve} to be kept")

    def rows(self) -> dict[str, int]:
        """Count the rows that have been flushed, as `frames` and `bond_events`: what a checkpoint must hold."""
        return dict(self._rows)

    def close(self) -> None:
        """Write what is left and end the file in order; a second call does nothing.

        Raises
        ------
        BrokenTrajectoryError
            as `flush`; a disk that is only nearly full is no reason not to end in order
        """
        if not self._open:
            return
        with suppress(NearlyFullError):
            self.flush()
        self._end()

    def abandon(self) -> None:
        """Let go of the file without writing another byte; it stays as the last flush left it."""
        if not self._open:
            return
        self._open = False
        self._frames.clear()
        self._events.clear()
        let_go(self._file)

    def __enter__(self) -> Self:
        """Give the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self.close()

    def _pending_bytes(self) -> int:
        frame = sum(column.row_bytes for column in self._columns)
        return frame * len(self._frames) + sum(events.nbytes for events in self._events)

    def _write(self, *, sync: bool) -> None:
        try:
            self._write_pending()
            self._file.flush()
            if sync:
                os.fsync(self._file.id.get_vfd_handle())
        except (OSError, RuntimeError) as error:
            self._give_up(error)
        self._count_pending()

    def _write_pending(self) -> None:
        if self._frames:
            blocks = [np.stack(rows) for rows in zip(*self._frames, strict=True)]
            for dataset, block in zip(self._datasets, blocks, strict=True):
                extend(dataset, block)
            pairs = zip(self._columns, blocks, strict=True)
            extend(self._sums, row_sums([block for column, block in pairs if column.is_summed]))
        if self._events:
            events = np.concatenate(self._events)
            extend(self._table, events)
            extend(self._table_sums, row_sums([events]))

    def _count_pending(self) -> None:
        self._rows[FRAMES] += len(self._frames)
        self._rows[BOND_EVENTS] += sum(map(len, self._events))
        self._frames.clear()
        self._events.clear()

    def _end(self) -> None:
        if not self._open:
            return
        try:
            self._file.close()
            self._open = False
        except (OSError, RuntimeError) as error:
            self._give_up(error)

    def _give_up(self, error: Exception) -> None:
        """Let go of the file after HDF5 failed to write; a full disk is told apart from other failures."""
        self.abandon()
        if is_no_room(error):
            raise BrokenTrajectoryError(f"{self.path}: disk full") from error
        raise error
