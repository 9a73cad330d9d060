"""Files that appear in a directory whole or not at all."""

import os
from pathlib import Path


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
