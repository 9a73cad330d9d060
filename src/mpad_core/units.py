"""One inner system of units: µm, s, pN (and K). Quantities on input are strings with units, such as "0.4 angstrom".

A strict pattern refuses whatever is not plainly a number and units before pint sees it; pint is imported only when a
quantity is read.
"""

import math
import re
from functools import cache
from typing import Any

import attrs

BOLTZMANN = 1.380649e-5  # pN µm / K (SI 2019: 1.380649e-23 J/K, exact)

_UNIT = r"[A-Za-zµμÅ]+(?:\^-?\d{1,2})?"
_PATTERN = re.compile(
    rf"(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{{1,3}})?) (?P<units>(?:1/)?{_UNIT}(?:(?: |\*|/){_UNIT})*)"
)
_INNER = {"[length]": "um", "[time]": "s", "[mass]": "(pN s^2/um)", "[temperature]": "K"}


class UnitsError(ValueError):
    """A quantity that cannot be read, or one of the wrong kind; the message says what would do."""


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(cache_folder=None)


def _parse(text: object, example: str) -> Any:
    if not isinstance(text, str):
        raise UnitsError(f"{text!r} has no units; write a string such as {example}")
    match = _PATTERN.fullmatch(text.strip())
    if match is None or len(text) > 80:
        raise UnitsError(f"{text[:40]!r} is not a number, a space and units; write a string such as {example}")
    number = float(match["number"])
    if not math.isfinite(number):
        raise UnitsError(f"{text!r} is not a finite number")
    try:
        return _registry().Quantity(number, match["units"])
    except Exception as error:  # pint raises a wide range of errors for units it does not know
        raise UnitsError(f"{text!r}: unknown units {match['units']!r}; write a string such as {example}") from error


def _tidy(value: Any) -> float:
    """Undo the last-digit noise of unit factors, so that "100 pN/nm" is 100000 pN/µm and not 99999.99999999999."""
    return float(f"{float(value):.15g}")


def convert(text: object, unit: str) -> float:
    """Read a quantity and give its value in `unit`.

    Raises
    ------
    UnitsError
        If `text` is not a string of a number and units, or its dimension is not that of `unit`.
    """
    example = f'"2 {unit}"'
    quantity = _parse(text, example)
    target = _registry().Unit(unit)
    if quantity.dimensionality != target.dimensionality:
        raise UnitsError(f"{text!r} has the wrong dimension; write a string such as {example}")
    return _tidy(quantity.to(target).magnitude)


def to_inner(text: object) -> float:
    """Read a quantity of any dimension made of length, time, mass, temperature; give it in inner units."""
    quantity = _parse(text, '"2 pN/um"')
    powers = dict(quantity.dimensionality)
    strange = sorted(set(powers) - set(_INNER))
    if strange:
        raise UnitsError(f"{text!r} has a dimension unknown here: {', '.join(strange)}")
    target = " * ".join(f"{_INNER[kind]}**{power}" for kind, power in powers.items()) or "dimensionless"
    return _tidy(quantity.to(target).magnitude)


def quantity(unit: str, *, default: Any = attrs.NOTHING, alias: str | None = None, doc: str = "") -> Any:
    """Declare an attrs field that scenes write as a string with units and code sees as a float in `unit`.

    Parameters
    ----------
    unit
        A unit of the inner system, such as ``"1/s"`` or ``"pN/um"``.
    default
        The value (a float in `unit`) where the scene is silent; without it the scene must give one.
    alias
        The key in the scene, where it differs from the field's name.
    doc
        One line for ``mpad parts``.
    """
    return attrs.field(default=default, alias=alias, metadata={"unit": unit, "doc": doc})


def thermal_energy(temperature: float) -> float:
    """Give kT in pN µm at a temperature in K."""
    return BOLTZMANN * temperature
