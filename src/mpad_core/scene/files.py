"""Scenes from files: what is read, what is refused, and on which line.

All faults are gathered and raised at once, each as ``file:line: path: what is wrong; what would do``.
"""

import re
import tomllib
from collections.abc import Iterable, Sequence
from itertools import islice
from os import PathLike
from pathlib import Path as FilePath
from typing import Any, Final

from attrs import evolve, frozen

from mpad_core.interfaces.errors import InputError
from mpad_core.scene import checks, overriding, provenance
from mpad_core.scene.attached import attach_files
from mpad_core.scene.faults import MOST_FAULTS, Fault, Path, dotted, one_line
from mpad_core.scene.lines import LARGEST_TEXT, key_lines, refusal
from mpad_core.scene.spec import Scene
from mpad_core.scene.structure import converter, faults
from mpad_core.scene.writing import resolved_toml

__all__ = ["load_scene", "parse_scene", "resolved_toml"]

_PLACE = re.compile(r"^(?P<what>.*?) \(at (?:line (?P<line>\d+), column (?P<column>\d+)|end of document)\)$", re.DOTALL)
_WATER_TEXT: Final = "1000 kg/m^3"
_MOST_LINES = 50


@frozen
class _Source:
    """Where a scene came from, to say where its faults are."""

    name: str
    text: str
    overridden: tuple[Path, ...] = ()

    def lines(self, found: Iterable[Fault]) -> list[str]:
        """Put each fault into a line, sorted by line number."""
        known = key_lines(self.text)
        placed = [(*self._place(fault.path, known), fault) for fault in found]
        placed.sort(key=lambda item: item[0])
        texts = [one_line(where, dotted(fault.path), fault.message) for _, where, fault in placed]
        return texts if len(texts) <= _MOST_LINES else [*texts[:_MOST_LINES], f"{self.name}: and more"]

    def _place(self, path: Path, known: dict[Path, int]) -> tuple[float, str]:
        """Give the line of a path, or of the nearest one above it that has one."""
        prefixes = [path[:size] for size in range(len(path), -1, -1)]
        nearest = next((prefix for prefix in prefixes if prefix in known or prefix in self.overridden), ())
        if nearest in self.overridden:
            return float("inf"), "--set"
        line = known.get(nearest, 1)
        return line, f"{self.name}:{line}"


def load_scene(path: str | PathLike[str], overrides: Sequence[str] = ()) -> Scene:
    """Read a scene from a TOML file.

    Parameters
    ----------
    path
        The file.
    overrides
        Settings that take the place of the file's, such as ``cells.free.y="7.5 um"``.

    Raises
    ------
    InputError
        With one line for each thing wrong.
    """
    return parse_scene(_read(path), str(path), overrides, FilePath(path).parent)


def parse_scene(
    text: str, name: str = "<scene>", overrides: Sequence[str] = (), folder: str | PathLike[str] = "."
) -> Scene:
    """Read a scene from TOML text; ``name`` stands for the file in messages, ``folder`` is where its files are.

    Raises
    ------
    InputError
        With one line for each thing wrong.
    """
    data = _parsed(text, name)
    source = _Source(name, text, tuple(overriding.apply(data, overrides)))
    said, wrong = provenance.take(data)
    said = provenance.kept(said, source.overridden)
    written = provenance.given(data)
    filled = _fill_densities(data)
    attach_files(data, folder)
    _fill_reach(data)
    scene, found = _structured(data)
    found = [fault for fault in found if fault.path not in filled] + wrong
    found += islice(checks.references(data), MOST_FAULTS)
    if scene is not None and not found:
        found += islice(checks.values(scene), MOST_FAULTS)
        found += provenance.unknown(said, provenance.keys(scene))
    if scene is None or found:
        raise InputError(*source.lines(found))
    return evolve(scene, provenance=provenance.complete(scene, said, written))


def _read(path: str | PathLike[str]) -> str:
    """Read a file of bounded size as UTF-8."""
    try:
        with FilePath(path).open("rb") as file:
            raw = file.read(LARGEST_TEXT + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(one_line(str(path), f"cannot be read: {reason}; name a scene file")) from error
    if len(raw) > LARGEST_TEXT:
        raise InputError(one_line(str(path), _too_large()))
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        message = f"byte {raw[error.start]:#04x} is not UTF-8; save the file as UTF-8"
        raise InputError(one_line(f"{path}:{line}", message)) from error


def _too_large() -> str:
    return f"is larger than {LARGEST_TEXT // 1_000_000} MB; a scene is a few hundred lines"


def _parsed(text: str, name: str) -> dict[str, Any]:
    """Parse TOML, after a look at what would make the parser slow or deep."""
    if len(text) > LARGEST_TEXT:
        raise InputError(one_line(name, _too_large()))
    refused = refusal(text)
    if refused:
        raise InputError(one_line(f"{name}:{refused[0]}", refused[1]))
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(_syntax_line(text, name, str(error))) from error


def _syntax_line(text: str, name: str, message: str) -> str:
    match = _PLACE.match(message)
    if match is None:
        return one_line(name, f"not TOML: {message}")
    line = match["line"] or str(text.count("\n") + 1)
    column = f" in column {match['column']}" if match["column"] else " at the end of the file"
    return one_line(f"{name}:{line}", f"not TOML: {match['what']}{column}; check quotes, brackets and equals signs")


def _fill_densities(data: dict[str, Any]) -> set[Path]:
    """Give each kind without a density that of the fluid, and say where."""
    fluid, kinds = data.get("fluid"), data.get("kinds")
    density = fluid.get("density", _WATER_TEXT) if isinstance(fluid, dict) else _WATER_TEXT
    silent = {name: kind for name, kind in kinds.items() if _silent(kind)} if isinstance(kinds, dict) else {}
    for kind in silent.values():
        kind["density"] = density
    return {("kinds", name, "density") for name in silent}


def _fill_reach(data: dict[str, Any]) -> None:
    """Give bonds between cells the one reading of reach that they have."""
    for bond in checks.between_cells(data).values():
        bond.setdefault("reach", "pairs")


def _silent(kind: Any) -> bool:
    return isinstance(kind, dict) and "density" not in kind


def _structured(data: dict[str, Any]) -> tuple[Scene | None, list[Fault]]:
    try:
        return converter().structure(data, Scene), []
    except Exception as error:
        found = list(faults(error))
        return None, found or [Fault((), str(error))]
