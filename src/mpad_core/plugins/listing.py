"""The installed parts in words, for people."""

from collections.abc import Iterator
from typing import Any

import attrs

from mpad_core.interfaces.errors import MpadError
from mpad_core.plugins.registry import KINDS, InstalledPart, installed, load

_ABILITIES = {
    "solver": {"root": "thermal motion", "flow": "fluid velocity"},
    "bond": {"on_rate": "own on-rate", "exchange": "inner states", "factor": "shear-controlled encounter"},
}


def part_lines() -> Iterator[str]:
    """Yield the lines of ``mpad parts``: by kind, each part with its parameters, or what is wrong with it."""
    for kind in KINDS:
        found = installed(kind)
        if found:
            yield f"{kind}:"
        for part in found:
            yield from _described(part)


def _described(part: InstalledPart) -> Iterator[str]:
    try:
        loaded = load(part.kind, part.name)
    except MpadError as error:
        yield f"  {part.name}  ({part.distribution} {part.version})  BROKEN: {error}"
        return
    first = (loaded.__doc__ or "").strip().partition("\n")[0]
    yield f"  {part.name}  ({part.distribution} {part.version})  {first}"
    abilities = [text for member, text in _ABILITIES.get(part.kind, {}).items() if hasattr(loaded, member)]
    if abilities:
        yield f"      can also: {', '.join(abilities)}"
    for name, preset in getattr(loaded, "presets", {}).items():
        yield f"      preset {name}  {preset.provenance}: {preset.source}"
    if attrs.has(loaded):
        yield from (_parameter(field, KINDS[part.kind].filled) for field in attrs.fields(loaded) if field.init)


def _parameter(field: "attrs.Attribute[Any]", filled: tuple[str, ...]) -> str:
    unit, doc = field.metadata.get("unit"), field.metadata.get("doc", "")
    default = "" if field.default is attrs.NOTHING else f" = {field.default!r}"
    if field.alias in filled:
        doc = f"{doc} (filled from the scene)".strip()
    return f"      {field.alias}{default}{f' [{unit}]' if unit else ''}  {doc}".rstrip()
