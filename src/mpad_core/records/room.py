"""Room on the disk: asked for before writing, and the ways in which its absence is told."""

import errno
import os
import re
import resource
from pathlib import Path
from typing import Any

from mpad_core.interfaces.errors import DiskFullError

RESERVE = 16 * 2**20  # bytes kept free for a checkpoint, the log and the trajectory's own end

_NO_ROOM = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_HDF5_ERRNO = re.compile(r"errno = (\d+)")


class NearlyFullError(DiskFullError):
    """Everything given has been written, but the reserve is touched: room is left for a checkpoint, then stop."""


class BrokenTrajectoryError(DiskFullError):
    """Rows could not be written: those since the last flush are lost, and the trajectory has been let go of.

    The last checkpoint written still fits the file, so the run can be resumed from it.
    """


def free_bytes(directory: Path) -> int:
    """Bytes that an ordinary user may still write there."""
    found = os.statvfs(directory)
    return found.f_bavail * found.f_frsize


def need_room(directory: Path, wanted: int) -> None:
    """Refuse to begin what would not fit.

    Raises
    ------
    DiskFullError
        when less is free than wanted
    """
    free = free_bytes(directory)
    if free < wanted:
        raise DiskFullError(f"{directory}: {wanted} bytes are needed, {free} are free")


def is_no_room(error: BaseException) -> bool:
    """Tell a full disk (or quota, or file size limit) from other failures; HDF5 hides the number in its message."""
    hidden = _HDF5_ERRNO.search(str(error))
    number = int(hidden.group(1)) if hidden else getattr(error, "errno", None)
    return number in _NO_ROOM


def let_go(file: Any) -> None:
    """Close an HDF5 file without writing another byte.

    HDF5 cannot close a file that it cannot write: closing fails, and the interpreter then ends in a segmentation
    fault. So the file's descriptor is first pointed elsewhere, at what takes whatever is still to be written.
    """
    sink = _sink()
    try:
        os.dup2(sink, file.id.get_vfd_handle(), inheritable=False)
    finally:
        os.close(sink)
    file.close()


def _sink() -> int:
    """Open what takes anything: memory, which can also be cut to a length, or nothing where files are kept short."""
    limit, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
    if limit == resource.RLIM_INFINITY and hasattr(os, "memfd_create"):
        return os.memfd_create("mpad")
    return os.open(os.devnull, os.O_RDWR)
