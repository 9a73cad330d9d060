"""Where the values of a scene come from: what the scene says itself, its presets, its author, or mpad's defaults."""

from collections.abc import Collection, Iterable, Iterator
from typing import Any

from mpad_core.plugins.registry import nearest
from mpad_core.scene.faults import Fault, Path, shown
from mpad_core.scene.spec import Part, Scene
from mpad_core.scene.writing import table

WORDS = ("published", "recalled", "calibrated", "user", "default")
_PHYSICAL = ("fluid", "flow", "gravity", "wall", "kinds", "bonds", "repulsion")
_NO_VALUES = ("name", "law", "layout", "kind", "between")  # keys that name a part, a law or a site
_MOST = 20


def take(data: dict[str, Any]) -> tuple[dict[str, str], list[Fault]]:
    """Take the table ``provenance`` out of a scene: texts by dotted key, and what is wrong in it."""
    said = data.pop("provenance", {})
    if not isinstance(said, dict):
        return {}, [Fault(("provenance",), f"must be a table, not {shown(said)}")]
    found: dict[str, str] = {}
    faults: list[Fault] = []
    for path, text in _leaves(said):
        if isinstance(text, str) and text.startswith(WORDS):
            found[_key(path)] = text
        elif len(faults) < _MOST:
            what = f"must be text that begins with one of {', '.join(WORDS)}, not {shown(text)}"
            faults.append(Fault(("provenance", *path), what))
    return found, faults


def given(data: dict[str, Any]) -> set[str]:
    """Give the dotted keys of all values that a scene holds."""
    return {_key(path) for path, _ in _leaves(data)}


def kept(said: dict[str, str], overridden: Iterable[Path]) -> dict[str, str]:
    """Leave out what was said of values that have been set from outside since."""
    replaced = {_key(path) for path in overridden}
    return {key: text for key, text in said.items() if not replaced.intersection(_ways(key))}


def _ways(key: str) -> list[str]:
    """Give a dotted key and those of the tables above it."""
    return [key[:end] for end, letter in enumerate(key) if letter == "."] + [key]


def complete(scene: Scene, said: dict[str, str], written: set[str]) -> dict[str, str]:
    """Tell of every physical value of a scene where it comes from.

    Parameters
    ----------
    scene
        The scene.
    said
        What its table says, by dotted key.
    written
        Dotted keys of values that the file gives.
    """
    origins = dict(_origins(scene))
    return {key: said.get(key) or ("user" if key in written else origins.get(key, "default")) for key in keys(scene)}


def unknown(said: dict[str, str], known: Collection[str]) -> list[Fault]:
    """Find keys of the table that are no physical values of the scene."""
    strange = [key for key in said if key not in known][:_MOST]
    return [
        Fault(("provenance", key), f"the scene has no value {shown(key)}{nearest(key[:100], known)}") for key in strange
    ]


def keys(scene: Scene) -> list[str]:
    """Give the dotted keys of a scene's physical values: neither places of cells, nor what is recorded."""
    whole = table(scene)
    physical = {name: whole[name] for name in _PHYSICAL if name in whole}
    return [_key(path) for path, _ in _leaves(physical) if path[-1] not in _NO_VALUES]


def lines(scene: Scene) -> Iterator[str]:
    """Yield the provenance in short: for each word the keys that it stands for."""
    for word in WORDS:
        found = [key for key, text in scene.provenance.items() if text.startswith(word)]
        if found:
            yield f"  {word:<12} {', '.join(found)}"


def _origins(scene: Scene) -> Iterator[tuple[str, str]]:
    parts: dict[str, Part | None] = {f"bonds.{name}.model": bond.model for name, bond in scene.bonds.items()}
    parts |= {f"wall.sites.{name}": part for name, part in (scene.wall.sites if scene.wall else {}).items()}
    parts["repulsion"] = scene.repulsion
    for place, part in parts.items():
        for name, text in part.origins.items() if part else ():
            yield f"{place}.{name}", text


def _leaves(tables: dict[str, Any], above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Walk through the values of nested tables."""
    for key, value in tables.items():
        if isinstance(value, dict):
            yield from _leaves(value, (*above, key))
        else:
            yield (*above, key), value


def _key(path: Path) -> str:
    return ".".join(str(step) for step in path)
