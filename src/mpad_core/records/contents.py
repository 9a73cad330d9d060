"""What a trajectory file says it holds, checked against the layout: the way both to the reader and to salvage."""

from typing import Any

import h5py
import numpy as np
from attrs import frozen

from mpad_core.interfaces.errors import InputError
from mpad_core.interfaces.observer import FieldDeclaration
from mpad_core.interfaces.values import BOND_EVENT
from mpad_core.records.creation import CREATOR
from mpad_core.records.guard import is_finished
from mpad_core.records.header import BondSpecies, TrajectoryHeader
from mpad_core.records.layout import (
    BOND_EVENTS,
    EVENT_SUMS_PATH,
    EVENTS_PATH,
    FORMAT,
    FRAMES,
    OBSERVERS_PATH,
    ROW_SUMS_PATH,
    Column,
    columns,
)
from mpad_core.records.sums import header_sum, whole_rows


@frozen(kw_only=True, eq=False)
class Contents:
    """An open file's header, fields and datasets, and the number of whole rows; valid while the file is open."""

    header: TrajectoryHeader
    fields: tuple[FieldDeclaration, ...]
    columns: tuple[Column, ...]
    datasets: tuple[Any, ...]  # one a column
    events: Any | None
    rows: dict[str, int]
    finished: bool  # ended by its writer, not cut off or still being written


def contents(file: Any) -> Contents:
    """Find out what a file holds; it must have come through `opened`.

    Raises
    ------
    InputError
        when something is missing or not of the type and shape that mpad writes
    """
    _check_format(file)
    header = _header(file)
    fields = _fields(file)
    made = columns(header, fields)
    if _number(file, "/mpad", "sum") != header_sum(header, fields):
        raise InputError("/mpad: what is written once is damaged, its sum is wrong")
    found = tuple(_expected(file, column.path, column.shape, column.dtype) for column in made)
    events = _expected(file, EVENTS_PATH, (), BOND_EVENT) if "bonds" in header.quantities else None
    return Contents(
        header=header,
        fields=fields,
        columns=made,
        datasets=found,
        events=events,
        rows={FRAMES: _frames(file, made, found), BOND_EVENTS: _events(file, events)},
        finished=is_finished(file),
    )


def _frames(file: Any, made: tuple[Column, ...], found: tuple[Any, ...]) -> int:
    sums = _expected(file, ROW_SUMS_PATH, (), "u4")
    summed = tuple(dataset for column, dataset in zip(made, found, strict=True) if column.is_summed)
    return _whole(summed, sums, min(map(len, (*found, sums))), is_finished(file))


def _events(file: Any, events: Any | None) -> int:
    if events is None:
        return 0
    sums = _expected(file, EVENT_SUMS_PATH, (), "u4")
    return _whole((events,), sums, min(len(events), len(sums)), is_finished(file))


def _check_format(file: Any) -> None:
    if not isinstance(file.get("mpad"), h5py.Group) or _text(file, "/h5md/creator", "name") != CREATOR:
        raise InputError("not written by mpad: no /mpad group, or another creator")
    found = _number(file, "/mpad", "format")
    if found > FORMAT:
        raise InputError(f"has format {found}, this mpad reads up to {FORMAT}: use a newer mpad")


def _header(file: Any) -> TrajectoryHeader:
    parts = [_texts(file, f"/mpad/bonds/{name}") for name in ("names", "reaches", "compressions")]
    if len({len(part) for part in parts}) != 1:
        raise InputError("/mpad/bonds: names, reaches and compressions differ in number")
    return TrajectoryHeader(
        cells=_texts(file, "/mpad/cells/names"),
        kinds=_texts(file, "/mpad/cells/kinds"),
        radii=_dataset(file, "/mpad/cells/radii", 1, "f")[()],
        seed=_number(file, "/mpad", "seed"),
        scene=_dataset(file, "/mpad/scene", 0, "S")[()].decode(),
        bonds=tuple(BondSpecies(name=n, reach=r, compression=c) for n, r, c in zip(*parts, strict=True)),
        quantities=_texts(file, "/mpad/quantities"),
        title=_text(file, "/mpad", "title"),
        author=_text(file, "/h5md/author", "name"),
        version=_text(file, "/h5md/creator", "version"),
    )


def _fields(file: Any) -> tuple[FieldDeclaration, ...]:
    observed = _group(file, OBSERVERS_PATH)
    found = [_dataset(observed, name, None, "fiub") for name in observed]
    found.sort(key=lambda dataset: _number(file, dataset.name, "index"))
    return tuple(
        FieldDeclaration(
            name=dataset.name.rsplit("/", 1)[1],
            unit=_text(file, dataset.name, "unit") if "unit" in dataset.attrs else "",
            shape=dataset.shape[1:],
            dtype=_plain(dataset.dtype),
        )
        for dataset in found
    )


def _plain(dtype: Any) -> str:
    """Name a type as a declaration would: f8 rather than <f8, bool as itself."""
    return "bool" if dtype == np.bool_ else str(np.dtype(dtype).str.lstrip("<|="))


def _whole(found: tuple[Any, ...], sums: Any, rows: int, finished: bool) -> int:
    """Count the rows whose sum is right: all of a finished file's, of another those up to where it was cut off."""
    whole = whole_rows(found, sums, rows)
    if finished and whole < rows:
        raise InputError(f"{sums.name}: row {whole} is damaged, its sum is wrong")
    return whole


def _group(file: Any, path: str) -> Any:
    found = file.get(path)
    if not isinstance(found, h5py.Group):
        raise InputError(f"{path}: group is missing")
    return found


def _expected(file: Any, path: str, shape: tuple[int, ...], dtype: Any) -> Any:
    """Give a dataset that grows, if its type and the shape of a row are as they should be."""
    dataset = _dataset(file, path, None, None)
    if dataset.dtype != np.dtype(dtype):
        raise InputError(f"{path}: holds {dataset.dtype}, expected {np.dtype(dtype)}")
    if dataset.shape == () or dataset.shape[1:] != shape:
        raise InputError(f"{path}: has shape {dataset.shape}, expected (rows, {', '.join(map(str, shape))})")
    return dataset


def _dataset(file: Any, path: str, rank: int | None, kinds: str | None) -> Any:
    found = file.get(path)
    if not isinstance(found, h5py.Dataset):
        raise InputError(f"{path}: dataset is missing")
    if rank is not None and len(found.shape) != rank:
        raise InputError(f"{path}: has rank {len(found.shape)}, expected {rank}")
    if kinds is not None and found.dtype.kind not in kinds:
        raise InputError(f"{path}: holds {found.dtype}, which is not what mpad writes there")
    return found


def _texts(file: Any, path: str) -> tuple[str, ...]:
    return tuple(bytes(text).decode() for text in _dataset(file, path, 1, "S")[()])


def _attribute(file: Any, path: str, name: str) -> Any:
    owner = file.get(path)
    if owner is None or name not in owner.attrs:
        raise InputError(f"{path}: attribute {name} is missing")
    return owner.attrs[name]


def _text(file: Any, path: str, name: str) -> str:
    value = _attribute(file, path, name)
    if not isinstance(value, str):
        raise InputError(f"{path}: attribute {name} is no text")
    return value


def _number(file: Any, path: str, name: str) -> int:
    value = _attribute(file, path, name)
    if not isinstance(value, np.integer):
        raise InputError(f"{path}: attribute {name} is no whole number")
    return int(value)
