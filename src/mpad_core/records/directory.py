"""Directories for results, and files that appear in them whole or not at all."""

import os
from pathlib import Path

from mpad_core.interfaces.errors import DiskFullError, InputError
from mpad_core.records.room import is_no_room


def make_directory(directory: Path) -> None:
    """Make a directory, unless it is there.

    Raises
    ------
    InputError
        If it cannot be made.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{directory}: no directory can be made there ({error.strerror}); choose another with -o"
        ) from error


def write_whole(path: Path, raw: bytes) -> None:
    """Write a file so that it is there whole or not at all.

    Raises
    ------
    DiskFullError
        If there is no room.
    InputError
        If it cannot be written for another reason.
    """
    try:
        temporary(path).write_bytes(raw)
        temporary(path).replace(path)
    except OSError as error:
        if is_no_room(error):
            raise DiskFullError(f"{path}: disk full") from error
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another place with -o") from error


def temporary(path: Path) -> Path:
    """Name the file that is written first and then takes the place of another."""
    return path.with_name(path.name + ".tmp")


def sync_directory(directory: Path) -> None:
    """Wait until the names in a directory survive the death of the machine."""
    descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
