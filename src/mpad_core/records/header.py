"""What is said once about a trajectory, and what is recorded of its bonds' species."""

from collections.abc import Iterable

import numpy as np
from attrs import Attribute, field, frozen

from mpad_core.interfaces.errors import InputError

QUANTITIES = ("overlap", "velocity", "bonds", "capture_hazard")


@frozen(kw_only=True)
class BondSpecies:
    """One of the scene's bonds, in the words that a reader of the trajectory needs."""

    name: str
    reach: str = ""
    compression: str = ""


def _known(header: "TrajectoryHeader", attribute: "Attribute[tuple[str, ...]]", value: tuple[str, ...]) -> None:
    unknown = [name for name in value if name not in QUANTITIES]
    if unknown or len(set(value)) != len(value):
        raise InputError(f"recorded quantities {value!r}: each must be one of {', '.join(QUANTITIES)}, and only once")


def _one_a_cell(
    header: "TrajectoryHeader", attribute: "Attribute[tuple[object, ...]]", value: tuple[object, ...]
) -> None:
    if len(value) != len(header.cells):
        raise InputError(f"{attribute.name}: {len(value)} given for {len(header.cells)} cells")


def _nonempty(header: "TrajectoryHeader", attribute: "Attribute[tuple[str, ...]]", value: tuple[str, ...]) -> None:
    if not value or len(set(value)) != len(value):
        raise InputError(f"cells {value!r}: at least one is needed, and each by its own name")


def _64_bits(header: "TrajectoryHeader", attribute: "Attribute[int]", value: int) -> None:
    if not 0 <= value < 2**64:
        raise InputError(f"seed {value}: must lie between 0 and 2^64 - 1")


def _texts(values: Iterable[str]) -> tuple[str, ...]:
    return tuple(values)


def _in_order(values: Iterable[str]) -> tuple[str, ...]:
    return tuple(sorted(values, key=(*QUANTITIES, *values).index))


def _species(values: Iterable[BondSpecies]) -> tuple[BondSpecies, ...]:
    return tuple(values)


def _floats(values: object) -> tuple[float, ...]:
    return tuple(np.asarray(values, dtype=np.float64).ravel().tolist())


@frozen(kw_only=True)
class TrajectoryHeader:
    """What is written once, before step one, and is the same for every frame.

    Raises
    ------
    InputError
        when kinds or radii are not one a cell, or a quantity is not known
    """

    cells: tuple[str, ...] = field(converter=_texts, validator=_nonempty)
    kinds: tuple[str, ...] = field(converter=_texts, validator=_one_a_cell)
    radii: tuple[float, ...] = field(converter=_floats, validator=_one_a_cell)  # µm
    seed: int = field(converter=int, validator=_64_bits)
    scene: str = ""  # the resolved scene, TOML
    bonds: tuple[BondSpecies, ...] = field(default=(), converter=_species)  # in the order of BOND_EVENT's `species`
    quantities: tuple[str, ...] = field(default=QUANTITIES, converter=_in_order, validator=_known)  # the optional ones
    title: str = ""
    author: str = ""
    version: str = ""  # of the program that made the file
