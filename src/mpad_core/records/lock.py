"""One writer a run directory: a lock that dies with its process, however that ends."""

import fcntl
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mpad_core.interfaces.errors import BusyError, InputError

LOCK_NAME = "run.lock"

_logger = logging.getLogger(__name__)


@contextmanager
def locked(directory: str | os.PathLike[str]) -> Iterator[None]:
    """Keep all other writers out of a run directory while the block lasts.

    The kernel holds the lock on the open file ``run.lock``, not its being there: the file stays, and is free again
    as soon as the process is gone. A child made by fork holds it too, so keep worker processes to spawn.

    Parameters
    ----------
    directory
        must exist

    Raises
    ------
    BusyError
        when another writer has it
    InputError
        when the directory is absent, or its file system has no locks
    """
    _warn_of_environment()
    descriptor = _open(Path(directory))
    try:
        _lock(descriptor, Path(directory))
        os.ftruncate(descriptor, 0)
        os.write(descriptor, f"{os.getpid()}\n".encode())
        yield
    finally:
        os.close(descriptor)


def _open(directory: Path) -> int:
    try:
        return os.open(directory / LOCK_NAME, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o644)
    except OSError as error:
        raise InputError(f"{directory}: cannot be locked for writing: {error.strerror}") from error


def _lock(descriptor: int, directory: Path) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise BusyError(f"{directory}: run directory in use by another process{_holder(descriptor)}") from error
    except OSError as error:
        raise InputError(f"{directory}: its file system cannot lock files: {error.strerror}") from error


def _holder(descriptor: int) -> str:
    number = os.pread(descriptor, 32, 0).decode("ascii", "replace").strip()
    return f" (number {number})" if number.isdigit() else ""


def _warn_of_environment() -> None:
    if os.environ.get("HDF5_USE_FILE_LOCKING", "").strip().upper() in {"FALSE", "0"}:
        _logger.warning("HDF5_USE_FILE_LOCKING is off: only mpad's own lock keeps two writers from one trajectory")
