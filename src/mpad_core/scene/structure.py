"""From the tables of a TOML file to frozen values: strict, in inner units, with all faults at once."""

from collections.abc import Callable, Iterable, Iterator
from functools import cache, partial, reduce
from operator import or_
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import attrs
from attrs import frozen
from cattrs import (
    AttributeValidationNote,
    ClassValidationError,
    Converter,
    ForbiddenExtraKeysError,
    StructureHandlerNotFoundError,
)
from cattrs.gen import make_dict_structure_fn, override

from mpad_core.plugins.registry import nearest
from mpad_core.scene import conditions, readers, spec
from mpad_core.scene.faults import BARE, LONGEST_KEY, MOST_FAULTS, Fault, Path, WrongError, listed, shown, wrong
from mpad_core.scene.parts import read_part

Hook = Callable[[Any, Any], Any]

_MOST_HINTS = 20  # a hint takes 0.1 ms, and a file may hold 100,000 unknown keys


@frozen
class Unit:
    """Marks a float that is written as a quantity; without a name: of any dimension, or a bare number."""

    name: str | None


def with_unit(type_: Any, unit: str | None) -> Any:
    """Mark each float in a type as a quantity."""
    if type_ is float:
        return Annotated[float, Unit(unit)]
    origin, items = get_origin(type_), get_args(type_)
    if origin in (None, Annotated, Literal):
        return type_
    inner = tuple(item if item is Ellipsis else with_unit(item, unit) for item in items)
    if origin in (Union, UnionType):
        return reduce(or_, inner)
    return origin[inner] if origin in (tuple, list, dict) else type_


def faults(error: Exception) -> Iterator[Fault]:
    """Unfold what went wrong while a value was read; what is no fault of the scene is raised again."""
    if isinstance(error, ClassValidationError):
        for inner in error.exceptions:
            yield from _faults_of_field(inner, error.cl)
    elif isinstance(error, ForbiddenExtraKeysError):
        yield from _unknown_keys(error)
    elif isinstance(error, WrongError):
        yield from error.faults
    elif isinstance(error, ValueError):
        yield Fault((), str(error))
    else:
        raise error


def _faults_of_field(error: Exception, owner: type) -> Iterator[Fault]:
    notes = [note for note in getattr(error, "__notes__", ()) if isinstance(note, AttributeValidationNote)]
    path: Path = (notes[0].name,) if notes else ()
    if isinstance(error, KeyError) and notes:
        yield Fault(path, _missing(getattr(attrs.fields(owner), notes[0].name)))
        return
    for fault in faults(error):
        yield fault.under(path)


def _missing(field: "attrs.Attribute[Any]") -> str:
    unit, doc = field.metadata.get("unit"), field.metadata.get("doc", "")
    example = f'; write {field.alias} = "2 {unit}"' if unit and field.type in (float, float | None) else ""
    return f"missing ({doc}){example}" if doc else f"missing{example}"


def _unknown_keys(error: ForbiddenExtraKeysError) -> Iterator[Fault]:
    known = [field.alias for field in attrs.fields(error.cl)]
    for index, key in enumerate(sorted(error.extra_fields)):
        hint = nearest(key, known) if index < _MOST_HINTS and len(key) < 100 else ""
        yield Fault((key,), f"unknown key{hint or f' (known here: {listed(known)})'}")


def _each(items: Iterable[tuple[str | int, Callable[[], Any]]]) -> list[Any]:
    """Read one after the other, and gather the faults of all."""
    found: list[Any] = []
    wrongs: list[Fault] = []
    for step, read in items:
        if len(wrongs) >= MOST_FAULTS:
            break
        try:
            found.append(read())
        except Exception as error:
            wrongs.extend(fault.under((step,)) for fault in faults(error))
    if wrongs:
        raise WrongError(*wrongs)
    return found


def _sequence(type_: Any, converter: Converter) -> Hook:
    items = get_args(type_)
    alike = get_origin(type_) is list or Ellipsis in items

    def hook(value: Any, _: Any) -> Any:
        if not isinstance(value, list):
            raise wrong(f"must be a list in brackets, not {shown(value)}")
        if not alike and len(value) != len(items):
            raise wrong(f"must be a list of {len(items)}, not of {len(value)}")
        types = [items[0]] * len(value) if alike else items
        pairs = enumerate(zip(value, types, strict=True))
        return tuple(_each((i, partial(converter.structure, v, t)) for i, (v, t) in pairs))

    return hook


def _named(type_: Any, converter: Converter) -> Hook:
    inner = get_args(type_)[1]

    def one(name: str, value: Any) -> Any:
        if len(name) > LONGEST_KEY or not BARE.fullmatch(name):
            raise wrong(f"a name has only letters, digits, - and _, at most {LONGEST_KEY}")
        return converter.structure(value, inner)

    def hook(value: Any, _: Any) -> Any:
        _check_table(value)
        return dict(zip(value, _each((k, partial(one, k, v)) for k, v in value.items()), strict=True))

    return hook


def _check_table(value: Any) -> None:
    if not isinstance(value, dict):
        raise wrong(f"must be a table, not {shown(value)}")


def _table(type_: Any, converter: Converter) -> Hook:
    fields = attrs.fields(attrs.resolve_types(type_))
    read = _field if type_.__module__ == spec.__name__ else _foreign_field
    hooks: dict[str, Any] = {field.name: override(struct_hook=read(field, converter)) for field in fields}
    inner = make_dict_structure_fn(
        type_,
        converter,
        _cattrs_forbid_extra_keys=True,
        _cattrs_detailed_validation=True,
        _cattrs_use_alias=True,
        **hooks,
    )

    def hook(value: Any, wanted: Any) -> Any:
        _check_table(value)
        return inner(value, wanted)

    return hook


def _field(field: "attrs.Attribute[Any]", converter: Converter) -> Hook:
    """Read a field by its type and unit, and check it at once, so that a fault is put at its key."""
    unit = field.metadata.get("unit")
    type_: Any = with_unit(field.type, unit) if unit else field.type

    def hook(value: Any, _: Any) -> Any:
        several = [value] if field.metadata.get("single") and isinstance(value, str) else value
        found = converter.structure(several, type_)
        if field.validator is not None:
            field.validator(None, field, found)
        return found

    return hook


def _parameter(value: Any, type_: Any, unit: str | None) -> Any:
    """Read a part's parameter; one of a type unknown here is left to the part's own converter."""
    try:
        return converter().structure(value, with_unit(type_, unit))
    except StructureHandlerNotFoundError:
        return value
    except Exception as error:
        raise WrongError(*faults(error)) from error


def _foreign_field(field: "attrs.Attribute[Any]", converter: Converter) -> Hook:
    """Read a field of a class that a part brings; its validators may need the instance."""
    type_ = with_unit(field.type, field.metadata.get("unit"))
    return lambda value, _: converter.structure(value, type_)


_SINGLE: dict[Any, Callable[[Any], Any]] = {
    float: readers.number,
    int: readers.whole,
    bool: readers.switch,
    str: readers.text,
    spec.Condition: conditions.read,
}


def _alone(read: Callable[[Any], Any], value: Any, _: Any) -> Any:
    return read(value)


def _marked(mark: type) -> Callable[[Any], bool]:
    return lambda type_: get_origin(type_) is Annotated and isinstance(get_args(type_)[1], mark)


def _origin(*origins: Any) -> Callable[[Any], bool]:
    return lambda type_: get_origin(type_) in origins


@cache
def converter() -> Converter:
    """Give the one converter of scenes."""
    made = Converter(detailed_validation=True, forbid_extra_keys=True)
    made.register_structure_hook_factory(lambda type_: attrs.has(type_), _table)
    for type_, read in _SINGLE.items():
        made.register_structure_hook(type_, partial(_alone, read))
    made.register_structure_hook_factory(_origin(tuple, list), _sequence)
    made.register_structure_hook_factory(_origin(dict), _named)
    made.register_structure_hook_func(_origin(Literal), lambda v, t: readers.choice(v, get_args(t)))
    made.register_structure_hook_func(_marked(Unit), lambda v, t: readers.measure(v, get_args(t)[1].name))
    made.register_structure_hook_func(_marked(spec.Slot), lambda v, t: read_part(v, get_args(t)[1], _parameter))
    return made
