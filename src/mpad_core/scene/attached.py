"""Files that parts of a scene are given: found beside the scene, and told apart by their bytes.

A part says with ``metadata={"file": "sha256"}`` that a parameter is the path of a file, and which other parameter takes
the SHA-256 of its bytes. The path is made absolute and the sum is filled in when the scene is read, so the part can
refuse a file of other bytes. A run directory keeps a copy of each file, and its resolved scene names that.
"""

import hashlib
from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import Any

import attrs
from attrs import frozen

from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.plugins import registry
from mpad_core.scene.spec import PART_KEYS, Part, Scene

Tables = dict[str, Any]

FOLDER = "files"  # below the run directory


@frozen
class Attached:
    """A file that a part is given, and what a run directory calls its copy."""

    key: str
    path: Path
    sum: str  # SHA-256

    @property
    def kept_as(self) -> str:
        """The copy's path from the run directory; that of a copy is its own."""
        start = f"{self.sum[:12]}-"
        return f"{FOLDER}/{start}{self.path.name.removeprefix(start)}"


def attached_to(part: Part) -> list[Attached]:
    """List the files of a part whose sums are known."""
    given = part.parameters
    keys = [(key, sum_key) for key, sum_key in _file_keys(part.kind, part.name) if key in given and sum_key in given]
    return [Attached(key, Path(given[key]), given[sum_key]) for key, sum_key in keys]


def files_of(scene: Scene) -> list[Attached]:
    """List the files of all parts of a scene."""
    parts = [scene.solver, *scene.record.observers, *(bond.model for bond in scene.bonds.values())]
    parts += [scene.repulsion] if scene.repulsion else []
    parts += scene.wall.sites.values() if scene.wall else []
    return [file for part in parts for file in attached_to(part)]


def attach_files(data: Tables, folder: str | PathLike[str]) -> None:
    """Make paths in a scene's tables absolute, those of files in `folder`, and give the files' sums where none stand.

    What cannot be read is left to the part, which says so.
    """
    for kind, table in _parts(data):
        for key, sum_key in _file_keys(kind, table.get(PART_KEYS.get(kind, "name"))):
            if isinstance(table.get(key), str):
                path = Path(folder, table[key]).absolute()
                table[key] = str(path)
                found = _sum(path)
                if found:
                    table.setdefault(sum_key, found)


def _parts(data: Tables) -> Iterator[tuple[str, Tables]]:
    """Yield the tables that give a part by name and parameters, with its kind; whatever is no table is passed over."""
    wall, record = (data.get(key) for key in ("wall", "record"))
    found = [("solver", data.get("solver")), ("force", data.get("repulsion"))]
    found += [("surface", site) for site in _items(wall.get("sites") if isinstance(wall, dict) else None)]
    found += [("bond", bond.get("model")) for bond in _items(data.get("bonds")) if isinstance(bond, dict)]
    found += [("observer", one) for one in _items(record.get("observers") if isinstance(record, dict) else None)]
    yield from ((kind, table) for kind, table in found if isinstance(table, dict))


def _items(found: Any) -> list[Any]:
    if isinstance(found, dict):
        return list(found.values())
    return found if isinstance(found, list) else []


def _file_keys(kind: str, name: Any) -> Iterator[tuple[str, str]]:
    """Give the parameters of a part that are files, and those that take their sums; none of a part that is none."""
    if not isinstance(name, str) or len(name) > 60:
        return
    try:
        made = registry.load(kind, name)
    except (InputError, PartError):  # reported where the part is read
        return
    for field in attrs.fields(made) if attrs.has(made) else ():
        if "file" in field.metadata:
            yield field.alias, field.metadata["file"]


def _sum(path: Path) -> str:
    """Give the SHA-256 of a file; empty if it cannot be read, or has no end, as devices do not."""
    try:
        if not path.is_file():
            return ""
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except (OSError, ValueError):
        return ""
