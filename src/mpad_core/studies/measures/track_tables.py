"""Tables of tracks: plain ``t,x,y,cell``, or the spots that TrackMate exports."""

import csv
import math
from collections.abc import Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen

from mpad_core.interfaces.errors import InputError
from mpad_core.studies.measures.tracks import Track

_TIME, _X, _Y = ("t", "time", "position_t", "frame"), ("x", "position_x"), ("y", "position_y")
_CELL = ("cell", "track_id", "track")
_MORE_HEADINGS = 3  # TrackMate's: long names, short names, units
_UNLINKED = ("", "none", "nan")  # of a spot that belongs to no track
_LARGEST = 2**30  # bytes


@frozen(kw_only=True)
class _Columns:
    """Where the wanted columns of a table are; `cell` is None where there is only one cell."""

    time: int
    x: int
    y: int
    cell: int | None
    time_name: str

    def numbers(self, row: Sequence[str]) -> tuple[float, float, float]:
        return float(row[self.time]), float(row[self.x]), float(row[self.y])


def read_tracks(
    path: str | PathLike[str], *, length_unit: float | None = None, time_unit: float | None = None
) -> tuple[Track, ...]:
    """Read tracks from a table with a heading.

    Parameters
    ----------
    path
        Columns, in any order and case: t, time, POSITION_T or FRAME; x or POSITION_X; y or POSITION_Y; and unless
        there is only one cell, cell, track or TRACK_ID. Between commas, semicolons or tabs. All else is left alone, as
        are TrackMate's further headings and spots in no track.
    length_unit
        µm in one unit of x and y; 1 if left out, which it must not be where the table says that it is in pixels.
    time_unit
        s in one unit of t; 1 if left out, which it must not be for frames.

    Returns
    -------
    tuple of Track
        In the order of their first rows, sorted by time; the table's name is their run.

    Raises
    ------
    InputError
        One line, with the table's name and line: for a column that is missing, what is no finite number, a time that a
        cell has twice, a unit that has to be told.
    """
    name = str(path)
    lines = list(_lines(Path(path)))
    if not lines:
        raise InputError(f"{name}: is empty; a heading such as t,x,y,cell is needed")
    columns = _columns(name, lines[0][1])
    body = _body(name, lines[1:], columns, length_unit)
    if columns.time_name == "frame" and time_unit is None:
        raise InputError(f"{name}:{lines[0][0]}: times are numbers of frames; say how long one is (--time-unit 33ms)")
    return tuple(_tracks(name, body, columns, length_unit or 1.0, time_unit or 1.0))


def write_tracks(path: str | PathLike[str], tracks: Sequence[Track]) -> None:
    """Write tracks as a table ``t,x,y,cell`` in s and µm, to the last bit."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(["t", "x", "y", "cell"])
        for track in tracks:
            places = zip(track.times.tolist(), track.x.tolist(), track.y.tolist(), strict=True)
            table.writerows([repr(t), repr(x), repr(y), track.name] for t, x, y in places)


def _lines(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows that hold anything, with their line numbers."""
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(f"{path}: is larger than {_LARGEST >> 20} MB; give it in parts")
        with path.open(encoding="utf-8-sig", newline="") as file:
            mark = max(",;\t", key=file.readline().count)
            file.seek(0)
            table = csv.reader(file, delimiter=mark)
            yield from ((table.line_num, row) for row in table if any(word.strip() for word in row))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: is no table of text ({' '.join(str(error).split())})") from error


def _columns(name: str, heading: list[str]) -> _Columns:
    words = [word.strip().lower() for word in heading]

    def find(choices: tuple[str, ...], what: str) -> int:
        found = next((words.index(word) for word in choices if word in words), None)
        if found is None:
            raise InputError(f"{name}:1: no column for {what}; one must be called {' or '.join(choices)}")
        return found

    time = find(_TIME, "time")
    cell = next((words.index(word) for word in _CELL if word in words), None)
    return _Columns(time=time, x=find(_X, "x"), y=find(_Y, "y"), cell=cell, time_name=words[time])


def _body(
    name: str, lines: list[tuple[int, list[str]]], columns: _Columns, length_unit: float | None
) -> list[tuple[int, list[str]]]:
    """Leave out the further headings; see that lengths in pixels have been given a size."""
    first = next((i for i, (_, row) in enumerate(lines[: _MORE_HEADINGS + 1]) if not _is_heading(row, columns)), 0)
    for number, row in lines[:first]:
        if length_unit is None and "pixel" in row[columns.x].lower():
            raise InputError(f"{name}:{number}: lengths are in pixels; say how long one is (--length-unit 0.65um)")
    return lines[first:]


def _is_heading(row: list[str], columns: _Columns) -> bool:
    """Tell whether none of the wanted columns of a row of full length is a number."""
    wanted = (columns.time, columns.x, columns.y)
    return len(row) > max(wanted) and all(_number(row[i]) is None for i in wanted)


def _number(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None


def _tracks(
    name: str, lines: list[tuple[int, list[str]]], columns: _Columns, length: float, time: float
) -> Iterator[Track]:
    found: dict[str, list[tuple[float, float, float, int]]] = {}
    for number, row in lines:
        if len(row) <= max(columns.time, columns.x, columns.y, columns.cell or 0):
            raise InputError(f"{name}:{number}: has only {len(row)} columns, fewer than the heading")
        cell = Path(name).stem if columns.cell is None else row[columns.cell].strip()
        if columns.cell is None or cell.lower() not in _UNLINKED:
            found.setdefault(cell, []).append((*_place(name, number, row, columns), number))
    if not found:
        raise InputError(f"{name}: holds no track")
    for cell, rows in found.items():
        yield _track(name, cell, rows, length, time)


def _place(name: str, number: int, row: list[str], columns: _Columns) -> tuple[float, float, float]:
    for what, index in (("time", columns.time), ("x", columns.x), ("y", columns.y)):
        value = _number(row[index])
        if value is None or not math.isfinite(value):
            raise InputError(f"{name}:{number}: {what}: {row[index][:40]!r} is not a finite number")
    return columns.numbers(row)


def _track(name: str, cell: str, rows: list[Any], length: float, time: float) -> Track:
    rows.sort(key=lambda row: row[0])
    table = np.array(rows)
    twice = np.flatnonzero(np.diff(table[:, 0]) == 0)
    if len(twice):
        line = max(rows[twice[0]][3], rows[twice[0] + 1][3])
        raise InputError(f"{name}:{line}: cell {cell!r} has time {rows[twice[0]][0]:g} twice")
    return Track(times=time * table[:, 0], x=length * table[:, 1], y=length * table[:, 2], name=cell, run=name)
