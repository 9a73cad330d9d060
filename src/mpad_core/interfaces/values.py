"""The values that parts and core hand to each other: frozen, in inner units (µm, s, pN)."""

from typing import Any

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from mpad_core.arrays import Array

__all__ = [
    "BOND_EVENT",
    "AccuracyLevel",
    "Array",
    "Configuration",
    "Motion",
    "Report",
    "Rung",
    "Setting",
    "SolverTraits",
]

BOND_EVENT = np.dtype(
    [
        ("time", "f8"),  # s
        ("step", "i8"),
        ("kind", "u1"),  # 0 formed, 1 broken, 2 changed its inner state
        ("species", "u1"),  # index into the scene's bonds
        ("state", "u1"),  # inner state of the bond, after the event; before it, if the bond broke
        ("cell", "i4"),
        ("receptor", "i8"),  # index of the molecule on its cell
        ("partner", "i4"),  # the other cell of a bond between cells; -1 for the wall
        ("ligand", "i8"),  # index of the partner's molecule, or identity of the wall's; -1: not told apart
        ("anchor_x", "f8"),  # µm, where the bond holds the wall; of one between cells: the partner's end at its birth
        ("anchor_y", "f8"),
        ("length", "f8"),  # µm
        ("force", "f8"),  # pN
    ]
)


def _floats(values: Any) -> Array:
    return np.ascontiguousarray(values, dtype=np.float64)


@frozen(kw_only=True)
class Setting:
    """What stays the same during a run, as far as the fluid is concerned."""

    viscosity: float  # pN s/µm²
    shear_rate: float = 0.0  # 1/s; ambient flow u = shear_rate · z · x̂
    wall: bool = True  # a no-slip wall at z = 0, fluid above


@frozen(kw_only=True, eq=False)
class Configuration:
    """Where the spheres are.

    The gap to the wall is kept beside the height, since their difference loses digits near contact.
    """

    centres: Array = field(converter=_floats)  # (N, 3), µm
    radii: Array = field(converter=_floats)  # (N,), µm
    wall_gaps: Array = field(converter=_floats)  # (N,), µm; height minus radius, exact near contact

    @wall_gaps.default
    def _heights_minus_radii(self) -> Array:
        return self.centres[:, 2] - self.radii

    def part(self, cells: NDArray[np.intp]) -> "Configuration":
        """Give the configuration of some of the spheres, in the order asked for."""
        return Configuration(centres=self.centres[cells], radii=self.radii[cells], wall_gaps=self.wall_gaps[cells])

    def moved(self, shift: Array) -> "Configuration":
        """Give the configuration displaced by (N, 3), heights and gaps alike."""
        return Configuration(
            centres=self.centres + shift, radii=self.radii, wall_gaps=self.wall_gaps + np.asarray(shift)[:, 2]
        )


@frozen(kw_only=True)
class Report:
    """How a solve went.

    ``error`` estimates the relative 2-norm error of (U, a·Ω) over the spheres for this right-hand side.
    """

    error: float
    iterations: int = 0
    residual: float = 0.0


@frozen(kw_only=True, eq=False)
class Motion:
    """A solver's answer: velocities (N, 6) or (N, 6, k), rows Ux Uy Uz Ωx Ωy Ωz in µm/s and 1/s.

    ``guess`` is whatever lets the next solve start warm; it is stored with the run's state, so it must be an array.
    """

    velocity: Array
    report: Report
    guess: Array | None = None


@frozen(kw_only=True)
class AccuracyLevel:
    """One setting of a solver and the error it claims there.

    A ``reference`` is there to compare others with, and dearer than runs can bear.
    """

    parameters: tuple[tuple[str, object], ...]
    error: float
    reference: bool = False


@frozen(kw_only=True)
class SolverTraits:
    """What a solver can treat, and how well: the core supplies or refuses the rest before step one."""

    wall: bool = True
    unbounded: bool = True
    unequal_radii: bool = True
    torques: bool = True
    ambient_flow: bool = True
    coupling: bool = True  # cells feel each other through the fluid
    lubrication: bool = False  # exact near-contact forces between cells
    largest_number: int | None = None
    levels: tuple[AccuracyLevel, ...] = ()


@frozen(kw_only=True)
class Rung:
    """One solver of those that another stands for, and the error it claims.

    ``trust`` is what its reported errors are multiplied with to be the true ones, as measured.
    """

    label: str
    solver: Any  # a MobilitySolver
    claim: float
    trust: float = 1.0
