"""Sums over what was written: they tell a whole row from a torn, lost or damaged one.

HDF5 guards its own tables with sums, but not the numbers. Its filter for that sums over pieces that are written anew
with every row, so that a death in the midst of a write would cost rows that had long been safe. A sum a row cannot.
"""

import json
import zlib
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from mpad_core.interfaces.observer import FieldDeclaration
from mpad_core.records.header import TrajectoryHeader

_BLOCK_BYTES = 2**22  # looked at a time


def row_sums(blocks: Sequence[NDArray[Any]]) -> NDArray[np.uint32]:
    """Give the CRC-32 of each row, over the bytes of all blocks one after the other; all are equally long."""
    rows = len(blocks[0])
    parts = [np.ascontiguousarray(block).view(np.uint8).reshape(rows, -1) if rows else block for block in blocks]
    matrix = np.hstack(parts) if rows else np.empty((0, 0), dtype=np.uint8)
    return np.array([zlib.crc32(row.data) for row in matrix], dtype=np.uint32)


def whole_rows(datasets: Sequence[Any], sums: Any, rows: int) -> int:
    """Count the rows from the beginning whose sum is right."""
    size = sum(dataset.dtype.itemsize * int(np.prod(dataset.shape[1:])) for dataset in datasets)
    for start, stop in blocks(rows, size):
        expected = row_sums([dataset[start:stop] for dataset in datasets])
        wrong = np.flatnonzero(expected != sums[start:stop])
        if len(wrong):
            return start + int(wrong[0])
    return rows


def blocks(rows: int, row_bytes: int) -> list[tuple[int, int]]:
    """Cut rows into blocks of a few MB."""
    step = max(_BLOCK_BYTES // max(row_bytes, 1), 1)
    return [(start, min(start + step, rows)) for start in range(0, rows, step)]


def header_sum(header: TrajectoryHeader, fields: Sequence[FieldDeclaration]) -> int:
    """Give the CRC-32 of all that is written once."""
    said = [attrs.asdict(header), [attrs.asdict(field) for field in fields]]
    return zlib.crc32(json.dumps(said, sort_keys=True).encode())
