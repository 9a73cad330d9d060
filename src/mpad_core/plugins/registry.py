"""Which parts are installed, and how one is loaded by name.

Names come from the entry points of group ``mpad``, called ``<kind>.<name>``; listing them imports nothing. Only the
part asked for is imported. Every fault names the distribution that it comes from.
"""

import difflib
from collections.abc import Iterable
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import pluggy
from attrs import frozen

from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.plugins.hookspecs import Hooks

GROUP = "mpad"


@frozen
class Kind:
    """One kind of part: the hook that gives it, the members it must have, the fields that the core fills."""

    hook: str
    members: tuple[str, ...]
    filled: tuple[str, ...] = ()  # fields that the core fills where the scene is silent


KINDS = {
    "solver": Kind("mpad_mobility_solvers", ("name", "traits", "plan", "prepare", "solve")),
    "bond": Kind(
        "mpad_bond_models", ("name", "tension", "off_rate", "breakpoints"), filled=("rest_length", "stiffness", "kT")
    ),
    "surface": Kind("mpad_surfaces", ("name", "density", "densest")),
    "force": Kind("mpad_force_laws", ("name", "force", "gaps")),
    "observer": Kind("mpad_observers", ("name", "fields", "see", "close")),
    "command": Kind("mpad_commands", ("name",)),
}


@frozen(order=True)
class InstalledPart:
    """One entry point: what it is called and which distribution brings it."""

    kind: str
    name: str
    distribution: str
    version: str
    module: str


def _described(entry: EntryPoint) -> InstalledPart:
    kind, _, name = entry.name.partition(".")
    if entry.dist is None:
        return InstalledPart(kind, name, "(no distribution)", "", entry.value)
    return InstalledPart(kind, name, entry.dist.name, entry.dist.version, entry.value)


def installed(kind: str | None = None) -> list[InstalledPart]:
    """List the installed parts, sorted by kind and name; imports none of them."""
    found = {_described(entry) for entry in entry_points(group=GROUP)}
    return sorted(part for part in found if kind in (None, part.kind))


def nearest(name: str, known: Iterable[str]) -> str:
    """Give a hint for a name that is unknown: the nearest known one, if any is near."""
    close = difflib.get_close_matches(name, list(known), n=1)
    return f"; did you mean {close[0]!r}?" if close else ""


def find(kind: str, name: str) -> InstalledPart:
    """Find the one installed part of this name.

    Raises
    ------
    InputError
        If there is none, or if two distributions bring one.
    """
    parts = installed(kind)
    found = [part for part in parts if part.name == name]
    if len(found) > 1:
        rivals = " and ".join(f"{part.distribution} {part.version}".strip() for part in found)
        raise InputError(f"{kind} {name!r} is brought by {rivals}; uninstall one of them")
    if not found:
        names = [part.name for part in parts]
        hint = nearest(name, names)
        raise InputError(
            f"no {kind} {name!r} is installed{hint} (installed: {', '.join(names) or 'none'}; is its plugin installed?)"
        )
    return found[0]


def _offered(part: InstalledPart) -> list[Any]:
    """Load one entry point and ask its hook for what it offers."""
    manager = pluggy.PluginManager(GROUP)
    manager.add_hookspecs(Hooks)
    try:
        manager.load_setuptools_entrypoints(GROUP, name=f"{part.kind}.{part.name}")
        manager.check_pending()
        return [item for offer in getattr(manager.hook, KINDS[part.kind].hook)() for item in offer]
    except (Exception, SystemExit) as error:  # a stranger's module may raise anything, or try to leave
        raise PartError(
            f"{part.kind} {part.name!r} of {part.distribution} {part.version} failed to load: "
            f"{type(error).__name__}: {' '.join(str(error).split())}"
        ) from error


def load(kind: str, name: str) -> Any:
    """Import the part of this kind and name and give its class (for commands: the command).

    Raises
    ------
    InputError
        If no such part is installed, or more than one.
    PartError
        If it fails to import, offers nothing of that name, or lacks a member.
    """
    part = find(kind, name)
    owner = f"{kind} {name!r} of {part.distribution} {part.version}"
    offered = [item for item in _offered(part) if getattr(item, "name", None) == name]
    if len(offered) != 1:
        raise PartError(f"{owner}: hook {KINDS[kind].hook} gives {len(offered)} parts of that name; it must give one")
    lacking = [member for member in KINDS[kind].members if not hasattr(offered[0], member)]
    if lacking:
        raise PartError(f"{owner} lacks {', '.join(lacking)}")
    return offered[0]
