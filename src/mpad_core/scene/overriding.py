"""Overrides of a scene: ``cells.free.y="7.5 um"`` sets one key before the scene is checked."""

import tomllib
from collections.abc import Sequence
from typing import Any

from mpad_core.interfaces.errors import InputError
from mpad_core.scene.faults import Path, dotted, one_line, shown, wrong
from mpad_core.scene.lines import first_key, refusal

_EITHER = {"height": "overlap", "overlap": "height"}  # setting one of them takes the place of the other


def apply(data: dict[str, Any], overrides: Sequence[str]) -> list[Path]:
    """Set keys in the tables of a scene, and give their paths, with those of tables made on the way.

    Raises
    ------
    InputError
        For overrides that are not ``path=value`` with a TOML value, or that run into a value that is no table.
    """
    paths: list[Path] = []
    lines: list[str] = []
    for override in overrides:
        try:
            paths += _set(data, *_parsed(override))
        except ValueError as error:
            lines.append(one_line("--set", str(error)))
    if lines:
        raise InputError(*lines)
    return paths


_ADVICE = "write a path and a TOML value, as in --set 'cells.free.y=\"7.5 um\"'"


def _parsed(override: str) -> tuple[tuple[str, ...], Any]:
    """Split an override into its path and its value."""
    path = first_key(override)
    what = dotted(path) or shown(override)
    try:
        refused = refusal(override)
        if refused or "\n" in override:
            raise ValueError(f"{what}: {refused[1] if refused else 'has more than one line'}; {_ADVICE}")
        value: Any = tomllib.loads(override)
    except (tomllib.TOMLDecodeError, RecursionError):
        raise ValueError(f"{what}: {shown(override)} cannot be read; {_ADVICE}") from None
    if not path or not value:
        raise ValueError(f"{what}: no path is given; {_ADVICE}")
    for key in path:
        value = value[key]
    return path, value


def _set(data: dict[str, Any], path: tuple[str, ...], value: Any) -> list[Path]:
    made: list[Path] = [path]
    for size, key in enumerate(path[:-1], start=1):
        if key not in data:
            made.append(path[:size])
        data = data.setdefault(key, {})
        if not isinstance(data, dict):
            raise wrong(f"{dotted(path)}: {dotted(path[:size])} is no table; set the whole of it")
    if len(path) == 3 and path[0] in ("cells", "groups"):
        data.pop(_EITHER.get(path[-1], ""), None)
    data[path[-1]] = value
    return made
