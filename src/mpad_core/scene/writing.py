"""The resolved scene: every default filled in, every quantity a string in inner units."""

from typing import Any

import attrs
import tomli_w

from mpad_core.plugins import registry
from mpad_core.scene.attached import attached_to
from mpad_core.scene.spec import PART_KEYS, Condition, Part, Scene


def resolved_toml(scene: Scene) -> str:
    """Write a scene as TOML, complete and exact: read again, it gives an equal scene.

    Files are named as in a run directory, which has copies of them: see `mpad_core.scene.attached`.
    """
    return tomli_w.dumps(table(scene))


def table(value: Any) -> dict[str, Any]:
    """Turn a value of the scene into a table that TOML can hold."""
    fields = attrs.fields(type(value))
    found = {field.name: _plain(getattr(value, field.name), field.metadata.get("unit")) for field in fields}
    return {key: item for key, item in found.items() if item is not None and item != {}}


def _plain(value: Any, unit: str | None) -> Any:
    """Turn a value into what TOML can hold."""
    if isinstance(value, Part):
        return _part(value)
    if isinstance(value, Condition):
        return str(value)
    if isinstance(value, dict):
        return {key: _plain(item, unit) for key, item in value.items()}
    if isinstance(value, tuple):
        return [_plain(item, unit) for item in value]
    if attrs.has(type(value)):
        return table(value)
    return f"{value!r} {unit}" if unit and isinstance(value, float) else value


def _part(part: Part) -> dict[str, Any]:
    fields = attrs.fields(registry.load(part.kind, part.name))
    units = {field.alias: field.metadata.get("unit") for field in fields}
    found = {key: _plain(value, units.get(key)) for key, value in part.parameters.items()}
    kept = {file.key: file.kept_as for file in attached_to(part)}
    return {PART_KEYS.get(part.kind, "name"): part.name} | found | part.written | kept
