"""The little grammar of stop conditions: ``free.dx > 60 um``, ``free.caught``."""

import re
from typing import Any, cast, get_args

from mpad_core.plugins.registry import nearest
from mpad_core.scene.faults import listed, shown, wrong
from mpad_core.scene.readers import measure, text
from mpad_core.scene.spec import Condition, Measured

_FORM = re.compile(r"\s*([A-Za-z0-9_-]+)\.([a-z]+)\s*(?:([<>])\s*(\S.*?))?\s*")
_EXAMPLE = '"cell.dx > 60 um" or "cell.caught"'
_QUANTITIES = get_args(Measured)


def cell_of(value: Any) -> str | None:
    """Give the cell that a condition speaks of; None if it is no condition."""
    match = _FORM.fullmatch(value) if isinstance(value, str) else None
    return match[1] if match else None


def read(value: Any) -> Condition:
    """Read one condition."""
    match = _FORM.fullmatch(text(value))
    if match is None:
        raise wrong(f"{shown(value)} is not a condition; write {_EXAMPLE}")
    cell, name, op, limit = match.groups()
    quantity = "z" if name == "height" else name
    if quantity not in _QUANTITIES:
        raise wrong(f"{name!r} cannot be asked for{nearest(name, _QUANTITIES)} (known: {listed(_QUANTITIES)})")
    if (quantity == "caught") != (op is None):
        raise wrong(f"{shown(value)}: caught stands alone, all else needs a limit; write {_EXAMPLE}")
    asked = cast(Measured, quantity)
    if op is None:
        return Condition(cell=cell, quantity=asked)
    return Condition(cell=cell, quantity=asked, op=">" if op == ">" else "<", value=measure(limit, "um"))
