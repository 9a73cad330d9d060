"""A file that its writer has not ended, seen as if it had been.

HDF5 refuses to open such a file but for its SWMR readers, and these wait for sound tables with pauses that double a
hundred times: in a file whose writer is dead and whose tables are damaged, that is forever. What a SWMR reader sees is
what lies on the disk, since a SWMR writer writes nothing before what it points to. So the file is opened as a
finished one through a view in which only its first block differs: not marked as being written, and with the true
length. The file itself is never touched.
"""

import os
import struct
from pathlib import Path

from mpad_core.interfaces.errors import InputError

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_SUPERBLOCK = struct.Struct("<8sBBBBQQQQI")  # version 3, the only one with marks; the sum is over all but itself
_MARKS = 5  # bits: 1 a writer, 4 a SWMR writer is at work, or was killed
_BEYOND = 2**30  # bytes that a live file may grow while it is read; what is not there yet reads as zeros
_32_BITS = 2**32 - 1


def is_unended(path: Path) -> bool:
    """Tell whether a writer is at work on an HDF5 file, or was killed over it."""
    with path.open("rb") as stream:
        head = stream.read(12)
    return head[:9] == _SIGNATURE + b"\x03" and bool(head[11] & _MARKS)


class UnendedFile:
    """A view of such a file, for h5py's driver for file objects; reading only.

    Raises
    ------
    InputError
        when the first block is damaged
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        self._length = os.fstat(self._descriptor).st_size + _BEYOND
        self._place = 0
        try:
            self._head = _as_if_ended(os.pread(self._descriptor, _SUPERBLOCK.size, 0), self._length)
        except BaseException:
            self.close()
            raise

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place; from the beginning or the end."""
        self._place = offset + (self._length if whence == os.SEEK_END else 0)
        return self._place

    def tell(self) -> int:
        """Give the place."""
        return self._place

    def readinto(self, buffer: memoryview) -> int:
        """Fill a buffer from the place on."""
        wanted = len(buffer)
        data = os.pread(self._descriptor, wanted, self._place).ljust(wanted, b"\0")
        if self._place < len(self._head):
            data = (self._head[self._place :] + data[len(self._head) - self._place :])[:wanted]
        buffer[:] = data
        self._place += wanted
        return wanted

    def read(self, size: int) -> bytes:
        """Read from the place on."""
        buffer = bytearray(size)
        self.readinto(memoryview(buffer))
        return bytes(buffer)

    def close(self) -> None:
        """Let go of the file."""
        os.close(self._descriptor)


def _as_if_ended(head: bytes, length: int) -> bytes:
    if len(head) < _SUPERBLOCK.size or lookup3(head[:-4]) != _SUPERBLOCK.unpack(head)[-1]:
        raise InputError("its first block is damaged")
    signature, version, offsets, lengths, _, base, extension, _, root, _ = _SUPERBLOCK.unpack(head)
    plain = (signature, version, offsets, lengths, 0, base, extension, length, root)
    return _SUPERBLOCK.pack(*plain, lookup3(_SUPERBLOCK.pack(*plain, 0)[:-4]))


def lookup3(data: bytes) -> int:
    """Give the sum that HDF5 keeps of its tables: Bob Jenkins' hash `hashlittle` of 2006, with no start value."""
    a = b = c = (0xDEADBEEF + len(data)) & _32_BITS
    while len(data) > 12:
        a, b, c = _mix(*_added(a, b, c, data[:12]))
        data = data[12:]
    return _final(*_added(a, b, c, data.ljust(12, b"\0"))) if data else c


def _added(a: int, b: int, c: int, data: bytes) -> tuple[int, int, int]:
    x, y, z = struct.unpack("<3I", data)
    return (a + x) & _32_BITS, (b + y) & _32_BITS, (c + z) & _32_BITS


def _turned(value: int, bits: int) -> int:
    return ((value << bits) | (value >> (32 - bits))) & _32_BITS


def _mix(a: int, b: int, c: int) -> tuple[int, int, int]:
    for bits in (4, 6, 8, 16, 19, 4):
        a = ((a - c) & _32_BITS) ^ _turned(c, bits)
        c = (c + b) & _32_BITS
        a, b, c = b, c, a
    return a, b, c


def _final(a: int, b: int, c: int) -> int:
    for bits in (14, 11, 25, 16, 4, 14, 24):
        c = ((c ^ b) - _turned(b, bits)) & _32_BITS
        a, b, c = b, c, a
    return b
