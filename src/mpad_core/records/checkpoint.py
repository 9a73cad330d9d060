"""Checkpoints: a handful of named arrays in one file that is either the old one or the new one, never half of each."""

import io
import os
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mpad_core.interfaces.errors import DiskFullError, InputError
from mpad_core.records.directory import sync_directory, temporary
from mpad_core.records.room import is_no_room

FORMAT = 1
FORMAT_ENTRY = "mpad_checkpoint_format"

_DAMAGE = (OSError, ValueError, KeyError, EOFError, RuntimeError, MemoryError, zipfile.BadZipFile)


def write_checkpoint(path: str | os.PathLike[str], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write a checkpoint; it survives the death of the machine when this returns.

    Parameters
    ----------
    path
        an older checkpoint there is replaced in one act
    arrays
        by name, of any type but object; numbers and texts go as arrays without axes

    Raises
    ------
    ValueError
        when an array holds Python objects, or takes the name of the format's own entry
    DiskFullError
        when there is no room; the older checkpoint is kept
    """
    if FORMAT_ENTRY in arrays:
        raise ValueError(f"checkpoint entry {FORMAT_ENTRY}: the name is taken")
    target = Path(path)
    try:
        with temporary(target).open("wb") as stream:
            _write(stream, {FORMAT_ENTRY: np.array(FORMAT), **arrays})
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary(target), target)
        sync_directory(target.parent)
    except BaseException as error:
        temporary(target).unlink(missing_ok=True)
        if is_no_room(error):
            raise DiskFullError(f"{target}: no room for a checkpoint; the one before is kept") from error
        raise


def read_checkpoint(path: str | os.PathLike[str]) -> dict[str, NDArray[Any]]:
    """Read a checkpoint back; nothing in the file is trusted.

    Raises
    ------
    InputError
        one line, when it is absent, damaged, another program's, or of a newer format
    """
    source = Path(path)
    with _one_line(source):
        if not source.is_file():
            raise InputError(f"{source}: no checkpoint here")
        with zipfile.ZipFile(source) as archive:
            _refuse_bombs(archive, source)
            arrays = {name.removesuffix(".npy"): _read_array(archive.read(name)) for name in archive.namelist()}
    _check_format(arrays.pop(FORMAT_ENTRY, None), source)
    return arrays


def _write(stream: io.BufferedWriter, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write an npz as numpy would, but with a fixed date, so that equal states give equal files."""
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        for name, values in arrays.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(values), allow_pickle=False)


def _read_array(data: bytes) -> NDArray[Any]:
    array: NDArray[Any] = np.lib.format.read_array(io.BytesIO(data), allow_pickle=False)
    return array


def _refuse_bombs(archive: zipfile.ZipFile, source: Path) -> None:
    members = archive.infolist()
    if any(member.compress_type != zipfile.ZIP_STORED for member in members):
        raise InputError(f"{source}: is compressed, which an mpad checkpoint is not")
    if sum(member.file_size for member in members) > source.stat().st_size:
        raise InputError(f"{source}: declares more than it holds")


def _check_format(found: NDArray[Any] | None, source: Path) -> None:
    if found is None or found.shape != () or found.dtype.kind != "i":
        raise InputError(f"{source}: not an mpad checkpoint ({FORMAT_ENTRY} is missing)")
    if int(found) > FORMAT:
        raise InputError(f"{source}: has format {int(found)}, this mpad reads up to {FORMAT}: use a newer mpad")


@contextmanager
def _one_line(source: Path) -> Iterator[None]:
    try:
        yield
    except _DAMAGE as error:
        reason = " ".join(str(error).split())[:200]
        raise InputError(f"{source}: damaged or not a checkpoint ({reason})") from error
