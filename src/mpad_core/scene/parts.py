"""How a scene names a part, and how the parameters it gives are checked against the part's own fields."""

from collections.abc import Callable
from typing import Any

import attrs
from attrs import frozen

from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.plugins import registry
from mpad_core.scene.faults import Fault, WrongError, listed, shown, wrong
from mpad_core.scene.spec import PART_KEYS, Part, Slot

ReadValue = Callable[[Any, Any, str | None], Any]
Fields = dict[str, "attrs.Attribute[Any]"]


def read_part(value: Any, slot: Slot, read: ReadValue) -> Part:
    """Read a part from its name, or from a table of its name and parameters.

    Parameters
    ----------
    value
        What stands in the file.
    slot
        Which kind of part is wanted.
    read
        Reads one parameter, given its type and unit, or raises WrongError.
    """
    name, given = _named(value, slot)
    fields = _fields(slot.kind, name)
    preset = _preset(slot.kind, name, given, fields)
    optional = registry.KINDS[slot.kind].filled
    found, wrongs = {}, _unknown(given, fields, name) + _lacking(preset.parameters | given, fields, optional, name)
    for key in (key for key in given if key in fields):
        try:
            found[key] = read(given[key], fields[key].type, fields[key].metadata.get("unit"))
        except WrongError as error:
            wrongs += [fault.under((key,)) for fault in error.faults]
    if wrongs:
        raise WrongError(*wrongs)
    defaults = {key: plain(field) for key, field in fields.items() if key not in optional}
    defaults = {key: default for key, default in defaults.items() if default is not None}
    written = {key: text for key, text in given.items() if isinstance(text, str) and isinstance(found[key], float)}
    part = Part(
        kind=slot.kind, name=name, parameters=defaults | preset.parameters | found,
        written=_only_dimension(written, fields), origins=dict.fromkeys(preset.parameters, preset.text),
    )  # fmt: skip
    if not optional:
        try_build(part)
    return part


def _named(value: Any, slot: Slot) -> tuple[str, dict[str, Any]]:
    """Split what stands in the file into the part's name and its parameters."""
    key = PART_KEYS.get(slot.kind, "name")
    if isinstance(value, str):
        return _installed(slot.kind, value, ()), {}
    if not isinstance(value, dict):
        raise wrong(f"must be the name of a {slot.kind}, or a table with {key}, not {shown(value)}")
    name = value.get(key, slot.default)
    if not isinstance(name, str):
        known = listed(part.name for part in registry.installed(slot.kind))
        what = "missing" if name is None else f"must be text in quotes, not {shown(name)}"
        raise WrongError(Fault((key,), f"{what}; name a {slot.kind} (installed: {known})"))
    return _installed(slot.kind, name, (key,)), {name: given for name, given in value.items() if name != key}


@frozen
class _Chosen:
    """What a preset gives, and how its provenance reads."""

    parameters: dict[str, Any] = attrs.field(factory=dict)
    text: str = ""


def _preset(kind: str, name: str, given: dict[str, Any], fields: Fields) -> _Chosen:
    """Take the key ``preset`` out of what is given, and look it up; a part may have a parameter called so itself."""
    if "preset" not in given or "preset" in fields:
        return _Chosen()
    known = getattr(registry.load(kind, name), "presets", {})
    chosen = given.pop("preset")
    if not isinstance(chosen, str) or chosen not in known:
        hint = registry.nearest(chosen[:100], known) if isinstance(chosen, str) else ""
        raise WrongError(Fault(("preset",), f"{name!r} has no preset {shown(chosen)}{hint} (it has: {listed(known)})"))
    preset = known[chosen]
    strange = sorted(set(preset.parameters) - set(fields))
    if strange:
        raise PartError(f"{kind} {name!r}: its preset {chosen!r} sets {', '.join(strange)}, which it does not have")
    return _Chosen(dict(preset.parameters), f"{preset.provenance}: preset {chosen}, {preset.source}")


def _installed(kind: str, name: str, path: tuple[str, ...]) -> str:
    """Load the part once, so that an unknown name is a fault at its key."""
    if len(name) > 60:
        raise WrongError(Fault(path, f"no {kind} {shown(name)} is installed"))
    try:
        registry.load(kind, name)
    except InputError as error:
        raise WrongError(*(Fault(path, line) for line in error.lines)) from None
    return name


def _fields(kind: str, name: str) -> Fields:
    """Give the fields that make the parameters of a part, by their key."""
    made = registry.load(kind, name)
    if not attrs.has(made):
        raise PartError(f"{kind} {name!r} is no attrs class, so its parameters are not known")
    try:
        resolved = attrs.resolve_types(made)
    except NameError as error:
        raise PartError(f"{kind} {name!r}: its field types cannot be told: {error}") from error
    return {field.alias: field for field in attrs.fields(resolved) if field.init}


def _unknown(given: dict[str, Any], fields: Fields, name: str) -> list[Fault]:
    known = listed(fields)
    return [
        Fault((key,), f"unknown parameter of {name!r}{registry.nearest(key[:100], fields)} (its parameters: {known})")
        for key in [key for key in given if key not in fields][:20]
    ]


def _lacking(given: dict[str, Any], fields: Fields, optional: tuple[str, ...], name: str) -> list[Fault]:
    lacking = {key: field for key, field in fields.items() if key not in given and key not in optional}
    return [
        Fault((key,), f"missing parameter of {name!r}{_example(key, field)}")
        for key, field in lacking.items()
        if field.default is attrs.NOTHING
    ]


def _example(key: str, field: "attrs.Attribute[Any]") -> str:
    unit = field.metadata.get("unit")
    return f'; write {key} = "2 {unit}"' if unit else ""


def plain(field: "attrs.Attribute[Any]") -> Any:
    """Give the default of a field, if a scene can say it; else None."""
    default: Any = field.default
    if isinstance(default, attrs.Factory) and not default.takes_self:  # type: ignore[arg-type]
        default = default.factory()
    return default if _sayable(default) else None


def _sayable(value: Any) -> bool:
    if isinstance(value, tuple):
        return all(_sayable(item) for item in value)
    return isinstance(value, bool | int | float | str)


def _only_dimension(written: dict[str, str], fields: Fields) -> dict[str, str]:
    return {key: text for key, text in written.items() if fields[key].metadata.get("unit") is None}


def try_build(part: Part, **filled: Any) -> None:
    """Build a part to let its validators speak.

    Raises
    ------
    WrongError
        With what a validator says, at its parameter.
    PartError
        If the part fails in any other way.
    """
    try:
        part.build(**filled)
    except (ValueError, TypeError) as error:
        message = str(error.args[0]) if error.args else type(error).__name__
        raise WrongError(Fault(_culprit(part, message), f"{part.name!r} refuses: {message}")) from error
    except Exception as error:  # a stranger's class may raise anything
        raise PartError(f"{part.kind} {part.name!r} cannot be made: {type(error).__name__}: {error}") from error


def _culprit(part: Part, message: str) -> tuple[str, ...]:
    """Find the parameter whose validator says this; empty if none does on its own."""
    for field in attrs.fields(registry.load(part.kind, part.name)):
        if field.validator is not None and field.alias in part.parameters:
            try:
                field.validator(None, field, part.parameters[field.alias])
            except Exception as error:  # also where a validator needs the instance
                if error.args and str(error.args[0]) == message:
                    return (field.alias,)
    return ()
