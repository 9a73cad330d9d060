"""What is wrong in a scene and where; and how a fault is put into one line."""

import json
import re
from collections.abc import Iterable
from typing import Any, TypeAlias

from attrs import frozen

Path: TypeAlias = tuple[str | int, ...]

BARE = re.compile(r"[A-Za-z0-9_-]+")
LONGEST_KEY = 60
LONGEST_LINE = 400
MOST_FAULTS = 200  # gathered from one list; a hostile file could hold half a million


@frozen
class Fault:
    """One thing wrong: the path of its key, what is wrong, and what would do."""

    path: Path
    message: str

    def under(self, path: Path) -> "Fault":
        """Give the same fault, seen from further up."""
        return Fault(path + self.path, self.message)


class WrongError(ValueError):
    """Faults found while one value was read; their paths start at that value."""

    def __init__(self, *faults: Fault) -> None:
        super().__init__("; ".join(fault.message for fault in faults))
        self.faults = faults


def wrong(message: str) -> WrongError:
    """Make the error for a value that is wrong itself."""
    return WrongError(Fault((), message))


def shown(value: Any) -> str:
    """Give a short picture of a value from a TOML file, whatever it is."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return repr(value if len(value) <= 40 else value[:37] + "...")
    if isinstance(value, int | float):
        return f"{value:.6g}" if 1e15 < abs(value) < 1e300 else repr(value)[:40]
    if isinstance(value, dict | list):
        return "a table" if isinstance(value, dict) else "a list"
    return "a date or time"


def dotted(path: Path) -> str:
    """Write a path as TOML would: ``cells.free.x``, ``stop.when[0]``."""
    steps = [f"[{step}]" if isinstance(step, int) else f".{_key(step)}" for step in path]
    return "".join(steps).removeprefix(".")


def _key(key: str) -> str:
    short = key if len(key) <= LONGEST_KEY else key[: LONGEST_KEY - 3] + "..."
    return short if BARE.fullmatch(key) else json.dumps(short, ensure_ascii=False)


def one_line(*pieces: str) -> str:
    """Join what is not empty by colons into one printable line of bounded length."""
    text = ": ".join(piece for piece in pieces if piece)
    plain = "".join(letter if letter.isprintable() else f"\\x{ord(letter):02x}" for letter in text)
    return plain if len(plain) <= LONGEST_LINE else plain[: LONGEST_LINE - 3] + "..."


def listed(names: Iterable[str]) -> str:
    """List names for a message."""
    known = list(names)
    return (", ".join(known[:12]) + (", ..." if len(known) > 12 else "")) or "none"
