"""The run's log: one JSON object a line, readable after any death of the process."""

import json
import math
import os
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from mpad_core.interfaces.errors import DiskFullError, InputError
from mpad_core.records.room import is_no_room


class RunLog:
    """Appends lines to ``run.jsonl``, each handed to the kernel in one write.

    Parameters
    ----------
    path
        of the log; a last line that a killed process left half written is cut off
    resume_at
        simulated time (s) from which the run goes on; noted as the event ``resumed``

    Raises
    ------
    InputError
        when it cannot be opened
    DiskFullError
        when there is no room for a line
    """

    def __init__(self, path: str | os.PathLike[str], resume_at: float | None = None) -> None:
        self.path = Path(path)
        try:
            self._descriptor = os.open(self.path, os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise InputError(f"{self.path}: the log cannot be opened: {error.strerror}") from error
        _cut_torn_line(self._descriptor)
        if resume_at is not None:
            self.write("resumed", simulated=resume_at)

    def write(self, event: str, **data: object) -> str:
        """Append one line, with the wall's time, the event's name and its data, and give it back."""
        line = json_line(event, data)
        encoded = line.encode()
        try:
            written = os.write(self._descriptor, encoded)
        except OSError as error:
            if is_no_room(error):
                raise DiskFullError(f"{self.path}: disk full") from error
            raise
        if written < len(encoded):
            _cut_torn_line(self._descriptor)
            raise DiskFullError(f"{self.path}: disk full")
        return line

    def close(self) -> None:
        """Let go of the file; a second call does nothing."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
        self._descriptor = -1

    def __enter__(self) -> Self:
        """Give the log itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self.close()


def read_log(path: str | os.PathLike[str]) -> list[dict[str, Any]]:
    """Read a log's lines as dictionaries with ``time``, ``event`` and ``data``; a torn last line is left out.

    Raises
    ------
    InputError
        when it is absent, or another line is no JSON object
    """
    try:
        *lines, _ = Path(path).read_bytes().split(b"\n")
        found = [json.loads(line) for line in lines]
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: cannot be read as a log: {error}") from error
    if not all(isinstance(line, dict) for line in found):
        raise InputError(f"{path}: cannot be read as a log: a line is no JSON object")
    return found


def json_line(event: str, data: Mapping[str, object]) -> str:
    """Give a log's line: strict JSON, numbers that are not finite written as text."""
    now = datetime.now(UTC).isoformat(timespec="milliseconds")
    return (
        json.dumps({"time": now, "event": event, "data": _plain(dict(data))}, allow_nan=False, ensure_ascii=False)
        + "\n"
    )


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, dict):
        return {str(name): _plain(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value if value is None or isinstance(value, bool | int | float) else str(value)


def _cut_torn_line(descriptor: int) -> None:
    """Cut off what follows the last line's end, reading backwards in pieces."""
    end = os.fstat(descriptor).st_size
    while end:
        start = max(end - 2**16, 0)
        newline = os.pread(descriptor, end - start, start).rfind(b"\n")
        if newline >= 0:
            end = start + newline + 1
            break
        end = start
    os.ftruncate(descriptor, end)
