"""Strict readers of single values from TOML: what is not plainly meant is refused, never coerced."""

import math
import re
from typing import Any

from mpad_core.plugins.registry import nearest
from mpad_core.scene.faults import shown, wrong
from mpad_core.units import convert, to_inner

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?", re.ASCII)


def _finite(value: float, given: Any) -> float:
    if not math.isfinite(value):
        raise wrong(f"must be a finite number, not {shown(given)}")
    return value


def number(value: Any) -> float:
    """Read a dimensionless number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise wrong(f"must be a number without units, not {shown(value)}")
    try:
        return _finite(float(value), value)
    except OverflowError:
        raise wrong("must be a finite number, not one beyond 1e308") from None


def measure(value: Any, unit: str | None) -> float:
    """Read a quantity in a unit; without a unit, of any dimension, or a bare number."""
    if unit is None and not isinstance(value, str):
        return number(value)
    if not isinstance(value, str):
        raise wrong(f'must be a quantity with units, such as "2 {unit}", not {shown(value)}')
    figures, _, units = value.partition(" ")
    if units == unit and _NUMBER.fullmatch(figures):  # exact, and spares pint, for scenes in inner units
        return _finite(float(figures), value)
    try:
        return _finite(to_inner(value) if unit is None else convert(value, unit), value)
    except ValueError:
        raise
    except Exception as error:  # pint's own, for offset or logarithmic units and powers out of range
        raise wrong(f"{shown(value)} cannot be converted; write it in other units") from error


def whole(value: Any) -> int:
    """Read a whole number."""
    if isinstance(value, bool) or not isinstance(value, int):
        raise wrong(f"must be a whole number, not {shown(value)}")
    return value


def switch(value: Any) -> bool:
    """Read true or false."""
    if not isinstance(value, bool):
        raise wrong(f"must be true or false, not {shown(value)}")
    return value


def text(value: Any) -> str:
    """Read text."""
    if not isinstance(value, str):
        raise wrong(f"must be text in quotes, not {shown(value)}")
    return value


def choice(value: Any, choices: tuple[Any, ...]) -> Any:
    """Read one of a few values, of its very type."""
    for one in choices:
        if type(one) is type(value) and one == value:
            return one
    hint = nearest(value, map(str, choices)) if isinstance(value, str) and len(value) < 100 else ""
    raise wrong(f"must be one of {', '.join(map(shown, choices))}, not {shown(value)}{hint}")
