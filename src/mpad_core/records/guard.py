"""The one door through which a trajectory file comes in: nothing is read before all of it has been looked over.

HDF5 follows links into other files, reads datasets from foreign raw files, and believes a file of 6 kB that declares
terabytes. None of that is in a file that mpad wrote, so all of it is refused.
"""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py

from mpad_core.interfaces.errors import InputError
from mpad_core.records.unended import UnendedFile, is_unended

_FILTERS = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32}  # as h5repack may add
_DEFLATE_RATIO = 1032  # the most that deflate can shrink
_SLACK = 2**20  # bytes that a dataset may claim beyond what is stored: rows that a killed writer had announced
_MOST_OBJECTS = 10_000
_DAMAGE = (OSError, RuntimeError, ValueError, KeyError, TypeError, MemoryError, OverflowError, AttributeError)


@contextmanager
def opened(path: str | os.PathLike[str]) -> Iterator[Any]:
    """Open a finished, live or killed trajectory for reading, looked over first.

    Parameters
    ----------
    path
        of the file; it is opened for reading only, and through `UnendedFile` where a writer has not ended it

    Yields
    ------
    h5py.File

    Raises
    ------
    InputError
        one line, when the file is absent, damaged, or holds what mpad does not write
    """
    with _one_line(Path(path)):
        _check_kind(Path(path))
        with _view(Path(path)) as view, h5py.File(view, "r") as file:
            _inspect(file)
            yield file


@contextmanager
def _one_line(path: Path) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise InputError(*(line if line.startswith(f"{path}: ") else f"{path}: {line}" for line in error.lines)) from (
            error.__cause__
        )
    except _DAMAGE as error:
        reason = " ".join(str(error).split())[:200]
        raise InputError(f"{path}: cannot be read as a trajectory ({type(error).__name__}: {reason})") from error


def is_finished(file: Any) -> bool:
    """Tell whether an opened file was ended by its writer, rather than cut off or still being written."""
    return bool(file.driver != "fileobj")


@contextmanager
def _view(path: Path) -> Iterator[Any]:
    if not is_unended(path):
        yield path
        return
    view = UnendedFile(path)
    try:
        yield view
    finally:
        view.close()


def _check_kind(path: Path) -> None:
    try:
        found = path.stat()
    except FileNotFoundError as error:
        raise InputError("no such file") from error
    if not stat.S_ISREG(found.st_mode):
        raise InputError("not a regular file")
    if not h5py.is_hdf5(path):
        raise InputError("not an HDF5 file, or its beginning is lost")


def _inspect(file: Any) -> None:
    seen: set[int] = set()
    waiting = [file["/"]]
    while waiting:
        for name, member in _members(waiting.pop()):
            address = h5py.h5o.get_info(member.id).addr
            if address in seen:
                continue
            seen.add(address)
            if len(seen) > _MOST_OBJECTS:
                raise InputError(f"holds more than {_MOST_OBJECTS} objects")
            if isinstance(member, h5py.Group):
                waiting.append(member)
            else:
                _inspect_dataset(name, member)


def _members(group: Any) -> Iterator[tuple[str, Any]]:
    for name in group:
        path = f"{group.name.rstrip('/')}/{name}"
        link = group.get(name, getlink=True)
        if not isinstance(link, h5py.HardLink):
            raise InputError(f"{path}: is a link ({type(link).__name__}), which mpad does not write or follow")
        yield path, group[name]


def _inspect_dataset(path: str, dataset: Any) -> None:
    fault = _fault(dataset) if isinstance(dataset, h5py.Dataset) else "is neither group nor dataset"
    if fault:
        raise InputError(f"{path}: {fault}")


def _fault(dataset: Any) -> str:
    if dataset.external:
        return "lies in another file (external storage), which mpad does not follow"
    if dataset.is_virtual:
        return "is a virtual dataset, which mpad does not follow"
    if not _filters(dataset) <= _FILTERS:
        return f"is stored through an unknown filter (number {min(_filters(dataset) - _FILTERS)})"
    if dataset.shape is None or dataset.dtype.hasobject:
        return "has a type that mpad does not write"
    if dataset.size * dataset.dtype.itemsize > _most_bytes(dataset):
        return f"declares shape {dataset.shape}, but stores {dataset.id.get_storage_size()} bytes"
    return ""


def _filters(dataset: Any) -> set[int]:
    made = dataset.id.get_create_plist()
    return {made.get_filter(index)[0] for index in range(made.get_nfilters())}


def _most_bytes(dataset: Any) -> int:
    ratio = _DEFLATE_RATIO if _filters(dataset) else 1
    return int(dataset.id.get_storage_size()) * ratio + _SLACK
