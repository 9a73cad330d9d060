"""The one table of a trajectory's datasets: the writer makes them from it, the reader checks them against it."""

import re
from collections.abc import Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.interfaces.observer import FieldDeclaration, Frame
from mpad_core.records.header import TrajectoryHeader

FORMAT = 2  # of the /mpad group; a reader refuses a higher one
FRAMES = "frames"
BOND_EVENTS = "bond_events"
EVENTS_PATH = "/mpad/bond_events"
ROW_SUMS_PATH = "/mpad/row_sums"
EVENT_SUMS_PATH = "/mpad/bond_event_sums"
EVENTS_UNIT = "s 1 1 1 1 1 1 1 1 um um um pN"  # one a column of BOND_EVENT
OBSERVERS_PATH = "/mpad/observers"
POSITION_PATH = "/particles/trajectory/position"
NANOMETRES = 1e3  # in a µm

_FIELD_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,199}")
_FIELD_KINDS = "fiub"


@frozen(kw_only=True)
class Column:
    """One dataset that grows by a row a frame; `attribute` is the Frame's name for it, empty for an observer's."""

    path: str
    unit: str
    shape: tuple[int, ...] = ()  # of one row
    dtype: str = "f8"
    attribute: str = ""
    scale: float = 1.0  # what is stored, for one of the Frame's unit

    @property
    def name(self) -> str:
        """The last part of the path."""
        return self.path.rsplit("/", 1)[1]

    @property
    def row_bytes(self) -> int:
        """Room that one row takes."""
        return int(np.dtype(self.dtype).itemsize * np.prod(self.shape, dtype=np.int64))

    @property
    def is_summed(self) -> bool:
        """Tell whether the row's sum covers it; what only says another column in other units needs none."""
        return self.scale == 1.0

    def row(self, value: object) -> NDArray[np.generic]:
        """Copy a value into the form in which it is stored.

        Raises
        ------
        PartError
            when its shape is not the declared one, or it cannot be stored as the declared type
        """
        try:
            with np.errstate(invalid="ignore"):
                given = np.array(value, dtype=self.dtype)
        except (TypeError, ValueError, OverflowError) as error:
            raise PartError(f"recorded field {self.name}: cannot be stored as {self.dtype}: {error}") from error
        if given.dtype.kind != "f" and not np.array_equal(given, np.asarray(value)):
            raise PartError(f"recorded field {self.name}: declared as {self.dtype}, given {value!r}")
        if given.shape != self.shape:
            raise PartError(f"recorded field {self.name}: declared with shape {self.shape}, given {given.shape}")
        return given if self.scale == 1.0 else given * self.scale


def columns(header: TrajectoryHeader, fields: Sequence[FieldDeclaration]) -> tuple[Column, ...]:
    """Give all datasets that grow with the frames, observers' fields last, in the order declared."""
    return (*_h5md(len(header.cells)), *_always(len(header.cells)), *_asked(header), *map(_observed, checked(fields)))


def _h5md(cells: int) -> tuple[Column, ...]:
    return (
        Column(path=f"{POSITION_PATH}/step", unit="", dtype="i8", attribute="step"),
        Column(path=f"{POSITION_PATH}/time", unit="s", attribute="time"),
        Column(path=f"{POSITION_PATH}/value", unit="nm", shape=(cells, 3), attribute="centres", scale=NANOMETRES),
    )


def _always(cells: int) -> tuple[Column, ...]:
    return (
        Column(path="/mpad/positions", unit="um", shape=(cells, 3), attribute="centres"),
        Column(path="/mpad/orientations", unit="1", shape=(cells, 4), attribute="orientations"),
        Column(path="/mpad/wall_gaps", unit="um", shape=(cells,), attribute="wall_gaps"),
    )


def _asked(header: TrajectoryHeader) -> tuple[Column, ...]:
    """Give the datasets of the optional quantities that the header names, in the order of QUANTITIES."""
    return tuple(column for name, column in optional(len(header.cells)).items() if name in header.quantities)


def optional(cells: int) -> dict[str, Column]:
    """Give the dataset of each optional quantity."""
    velocity = "um/s um/s um/s 1/s 1/s 1/s"
    return {
        "overlap": Column(path="/mpad/overlaps", unit="um", shape=(cells,), attribute="overlaps"),
        "velocity": Column(path="/mpad/velocities", unit=velocity, shape=(cells, 6), attribute="velocities"),
        "bonds": Column(path="/mpad/bond_counts", unit="1", shape=(cells,), dtype="i4", attribute="bond_counts"),
        "capture_hazard": Column(path="/mpad/capture_hazards", unit="1/s", shape=(cells,), attribute="capture_hazards"),
    }


def _observed(declared: FieldDeclaration) -> Column:
    path = f"{OBSERVERS_PATH}/{declared.name}"
    return Column(path=path, unit=declared.unit, shape=tuple(declared.shape), dtype=np.dtype(declared.dtype).str)


def checked(fields: Sequence[FieldDeclaration]) -> tuple[FieldDeclaration, ...]:
    """Hand the fields back if they can be stored.

    Raises
    ------
    InputError
        one line for each field with an unfit name, type or shape, or a name that another field has
    """
    faults = [f"observer field {field.name!r}: {fault}" for field in fields for fault in _faults(field)]
    names = [field.name for field in fields]
    faults += [f"observer field {name!r}: declared twice" for name in sorted({n for n in names if names.count(n) > 1})]
    if faults:
        raise InputError(*faults)
    return tuple(fields)


def _faults(field: FieldDeclaration) -> list[str]:
    faults = []
    if not _FIELD_NAME.fullmatch(field.name):
        faults.append("a name holds letters, digits and . _ - only, at most 200, and begins with no . or -")
    if not all(isinstance(length, int) and length > 0 for length in field.shape) or len(field.shape) > 8:
        faults.append(f"shape {field.shape} must hold at most 8 whole numbers above zero")
    if not _storable(field.dtype):
        faults.append(f"type {field.dtype!r} is not a number of at most 8 bytes")
    return faults


def _storable(dtype: str) -> bool:
    try:
        kind = np.dtype(dtype)
    except TypeError:
        return False
    return kind.kind in _FIELD_KINDS and kind.itemsize <= 8


def frame_rows(
    made: Sequence[Column], frame: Frame, values: Sequence[object], cells: int
) -> tuple[NDArray[np.generic], ...]:
    """Copy one frame into rows, one a column.

    Raises
    ------
    PartError
        when the number of values or the shape of one is not as declared
    """
    own = [column for column in made if column.attribute]
    if len(values) != len(made) - len(own):
        raise PartError(f"recorded fields: {len(made) - len(own)} declared, {len(values)} values given")
    if len(frame.cells) != cells:
        raise PartError(f"frame at step {frame.step}: holds {len(frame.cells)} cells, the trajectory {cells}")
    taken = [column.row(getattr(frame, column.attribute)) for column in own]
    return (*taken, *(column.row(value) for column, value in zip(made[len(own) :], values, strict=True)))
