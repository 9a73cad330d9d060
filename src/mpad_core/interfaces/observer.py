"""What an observer must be: somebody who looks at every recorded frame."""

from typing import ClassVar, Protocol, runtime_checkable

from attrs import frozen

from mpad_core.interfaces.values import Array


@frozen(kw_only=True)
class FieldDeclaration:
    """One quantity that an observer records a frame: declared before step one, since the file's layout is fixed."""

    name: str
    unit: str
    shape: tuple[int, ...] = ()
    dtype: str = "f8"


@frozen(kw_only=True, eq=False)
class Frame:
    """The state at one recorded time, in inner units."""

    step: int
    time: float  # s
    cells: tuple[str, ...]
    centres: Array  # (N, 3), µm
    orientations: Array  # (N, 4), unit quaternions, scalar first, body to space
    velocities: Array  # (N, 6), µm/s and 1/s: displacement and turn over the last outer step, by its length
    wall_gaps: Array  # (N,), µm, between the smooth sphere and the wall; infinite without a wall
    overlaps: Array  # (N,), µm: δ, height above the one where unstressed bonds just reach; NaN without bonds
    bond_counts: Array  # (N,) number of living bonds
    capture_hazards: Array  # (N,), 1/s: expected rate of a first bond, molecules taken as spread evenly


@runtime_checkable
class Observer(Protocol):
    """Sees each frame and gives the values of the fields it declared."""

    name: ClassVar[str]

    def fields(self, cells: tuple[str, ...]) -> tuple[FieldDeclaration, ...]:
        """Declare what `see` will return, in that order."""
        ...

    def see(self, frame: Frame) -> tuple[Array | float, ...]:
        """Look at a frame; the values must depend on the frame alone, so that a resumed run records the same."""
        ...

    def close(self) -> None:
        """Hear that the run has ended."""
        ...
