"""What ``mpad measure`` asks for, and what it leaves."""

import errno
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mpad_core.interfaces.errors import DiskFullError, InputError
from mpad_core.records.directory import temporary
from mpad_core.studies.measures.measure import measure
from mpad_core.studies.measures.observations import observations
from mpad_core.studies.measures.report import Options, Report, plain

REPORT = "measures.json"
_POSITIVE = ("every", "pause_speed", "pause_time", "window", "within", "free_speed", "length_unit", "time_unit")


def asked(paths: Sequence[Path], **how: Any) -> Report:
    """Read runs and tables and measure them.

    Parameters
    ----------
    paths, how
        As `observations` and `Options` have them, in inner units.

    Raises
    ------
    InputError
        One line, for what cannot be read or measured.
    """
    for name in _POSITIVE:
        if how.get(name) is not None and how[name] <= 0:
            raise InputError(f"--{name.replace('_', '-')}: must be above zero, not {how[name]:g}")
    if how.get("seed", 0) < 0:
        raise InputError(f"--seed: must not be below zero, not {how['seed']}")
    reading = {name: how.pop(name, None) for name in ("length_unit", "time_unit", "free_speed", "within")}
    return measure(observations(paths, **reading), Options(**how))


def json_text(report: Report) -> str:
    """Give a report as JSON."""
    return json.dumps(plain(report), indent=2, ensure_ascii=False, allow_nan=False)


def write_report(report: Report, output: Path) -> Path:
    """Write a report whole or not at all; into a directory under its own name."""
    path = output / REPORT if output.is_dir() else output
    try:
        temporary(path).write_text(json_text(report) + "\n", encoding="utf-8")
        temporary(path).replace(path)
    except OSError as error:
        if error.errno == errno.ENOSPC:
            raise DiskFullError(f"{path}: no room on the disk") from error
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another place with -o") from error
    return path
