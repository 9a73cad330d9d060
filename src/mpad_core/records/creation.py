"""A new trajectory file: everything that is written once, and every dataset that will grow, before the first frame."""

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from mpad_core.interfaces.errors import DiskFullError
from mpad_core.interfaces.observer import FieldDeclaration
from mpad_core.interfaces.values import BOND_EVENT
from mpad_core.records.directory import sync_directory, temporary
from mpad_core.records.header import TrajectoryHeader
from mpad_core.records.layout import (
    EVENT_SUMS_PATH,
    EVENTS_PATH,
    EVENTS_UNIT,
    FORMAT,
    NANOMETRES,
    OBSERVERS_PATH,
    POSITION_PATH,
    ROW_SUMS_PATH,
    Column,
    columns,
)
from mpad_core.records.room import is_no_room, let_go
from mpad_core.records.sums import header_sum

CHUNK_BYTES = 2**14  # small, since a flush writes whole chunks
MOST_ROWS = 1024  # of a chunk
CREATOR = "mpad"
_PARTICLES = "/particles/trajectory"


def create_file(
    path: Path, header: TrajectoryHeader, fields: Sequence[FieldDeclaration], *, chunk_bytes: int = CHUNK_BYTES
) -> Any:
    """Make an HDF5 file with all that never changes and all datasets, still empty, under a temporary name.

    `settle` gives it its own name. A temporary file that a killed process left behind is removed.
    """
    growing = columns(header, fields)
    temporary(path).unlink(missing_ok=True)
    file = h5py.File(temporary(path), "x", libver=("v110", "v110"))  # virtual datasets over newer ones break VTK
    with unless_it_fails(file, path):
        _write_h5md(file, header)
        _write_particles(file, header)
        _write_mpad(file, header)
        for column in growing:
            _make_column(file, column, chunk_bytes)
        _make(file, ROW_SUMS_PATH, (), "u4", MOST_ROWS)
        _name_again(file)
        _number_fields(file, fields)
        file["mpad"].attrs["sum"] = header_sum(header, fields)
        if "bonds" in header.quantities:
            _make_events(file)
    return file


@contextmanager
def unless_it_fails(file: Any, path: Path) -> Iterator[None]:
    """Let go of a file that is not settled yet, and remove it, if the block fails.

    Raises
    ------
    DiskFullError
        when it fails for want of room
    """
    try:
        yield
    except BaseException as error:
        let_go(file)
        temporary(path).unlink(missing_ok=True)
        if is_no_room(error):
            raise DiskFullError(f"{path}: disk full, not begun") from error
        raise


def settle(file: Any, path: Path) -> None:
    """Make a new file safe to be killed over, then give it its own name: there is never half a trajectory there."""
    with unless_it_fails(file, path):
        file.swmr_mode = True
        file.flush()
        os.fsync(file.id.get_vfd_handle())
        os.replace(temporary(path), path)
    sync_directory(path.parent)


def extend(dataset: Any, block: NDArray[Any]) -> None:
    """Add rows at a dataset's end; by h5py's lower calls, since its upper ones take three times as long."""
    start, *rest = dataset.id.shape
    dataset.id.set_extent((start + len(block), *rest))
    space = dataset.id.get_space()
    space.select_hyperslab((start, *(0 for _ in rest)), block.shape)
    dataset.id.write(h5py.h5s.create_simple(block.shape), space, np.ascontiguousarray(block))


def _write_h5md(file: Any, header: TrajectoryHeader) -> None:
    h5md = file.create_group("h5md")
    h5md.attrs["version"] = np.array([1, 1], dtype="i4")
    h5md.create_group("author").attrs["name"] = header.author
    creator = h5md.create_group("creator")
    creator.attrs["name"] = CREATOR
    creator.attrs["version"] = header.version
    h5md.create_group("modules/units").attrs["version"] = np.array([1, 0], dtype="i4")


def _write_particles(file: Any, header: TrajectoryHeader) -> None:
    """Write what H5MD knows of the cells, in its units; MDAnalysis asks for this group's name and for nothing else."""
    box = file.create_group(f"{_PARTICLES}/box")
    box.attrs["dimension"] = 3
    box.attrs["boundary"] = np.array(["none"] * 3, dtype=h5py.string_dtype())
    kinds = sorted(set(header.kinds))
    file[f"{_PARTICLES}/id"] = np.arange(len(header.cells), dtype="i8")
    file[f"{_PARTICLES}/species"] = np.array([kinds.index(kind) for kind in header.kinds], dtype="i4")
    file[f"{_PARTICLES}/radius"] = np.array(header.radii) * NANOMETRES
    file[f"{_PARTICLES}/radius"].attrs["unit"] = "nm"
    _write_texts(file, f"{_PARTICLES}/name", header.cells)
    _write_texts(file, f"{_PARTICLES}/kind", header.kinds)


def _write_mpad(file: Any, header: TrajectoryHeader) -> None:
    mpad = file.create_group("mpad")
    mpad.attrs["format"] = FORMAT
    mpad.attrs["title"] = header.title
    mpad.attrs["seed"] = np.uint64(header.seed)
    _write_texts(file, "/mpad/scene", header.scene)
    _write_texts(file, "/mpad/quantities", header.quantities)
    _write_texts(file, "/mpad/cells/names", header.cells)
    _write_texts(file, "/mpad/cells/kinds", header.kinds)
    file["/mpad/cells/radii"] = np.array(header.radii)
    file["/mpad/cells/radii"].attrs["unit"] = "um"
    for attribute, name in (("name", "names"), ("reach", "reaches"), ("compression", "compressions")):
        _write_texts(file, f"/mpad/bonds/{name}", [getattr(bond, attribute) for bond in header.bonds])
    file.create_group(OBSERVERS_PATH)


def _write_texts(file: Any, path: str, texts: str | Iterable[str]) -> None:
    """Write a text, or a row of them, as fixed-length UTF-8: SWMR has no types of variable length."""
    encoded = texts.encode() if isinstance(texts, str) else [text.encode() for text in texts]
    bare = np.array(encoded, dtype="S")
    length = max(bare.dtype.itemsize, 1)
    file[path] = bare.astype(h5py.string_dtype("utf-8", length))


def _make(file: Any, path: str, shape: tuple[int, ...], dtype: Any, rows: int) -> Any:
    return file.create_dataset(path, shape=(0, *shape), maxshape=(None, *shape), chunks=(rows, *shape), dtype=dtype)


def _make_column(file: Any, column: Column, chunk_bytes: int) -> None:
    rows = min(max(chunk_bytes // column.row_bytes, 1), MOST_ROWS)
    dataset = _make(file, column.path, column.shape, column.dtype, rows)
    if column.unit:
        dataset.attrs["unit"] = column.unit


def _name_again(file: Any) -> None:
    """Let /mpad be whole by itself: step and time are the very datasets of H5MD under a second name."""
    for name in ("step", "time"):
        file[f"/mpad/{name}"] = file[f"{POSITION_PATH}/{name}"]


def _number_fields(file: Any, fields: Sequence[FieldDeclaration]) -> None:
    for index, declared in enumerate(fields):
        file[f"{OBSERVERS_PATH}/{declared.name}"].attrs["index"] = index


def _make_events(file: Any) -> None:
    table = _make(file, EVENTS_PATH, (), BOND_EVENT, MOST_ROWS)
    table.attrs["unit"] = EVENTS_UNIT
    table.attrs["kinds"] = np.array(["formed", "broken"], dtype=h5py.string_dtype())
    _make(file, EVENT_SUMS_PATH, (), "u4", MOST_ROWS)
