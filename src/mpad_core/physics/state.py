"""The state of a run: all that going on needs, and nothing that can be worked out again."""

from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np
from attrs import field, frozen

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.values import BOND_EVENT


@frozen(kw_only=True, eq=False)
class BondList:
    """The living bonds, oldest first."""

    cell: Indices  # (B,)
    site: Indices  # (B,) index of the molecule among all cells' molecules
    species: Indices  # (B,)
    ligand: Indices  # (B,) identity of the wall's molecule; -1 where not told apart
    anchor: Array  # (B, 3) µm

    def __len__(self) -> int:
        """Give the number of living bonds."""
        return len(self.cell)


def no_bonds() -> BondList:
    """Give the empty list."""
    none = np.zeros(0, np.int64)
    return BondList(cell=none, site=none, species=none, ligand=none, anchor=np.zeros((0, 3)))


def _no_events() -> Any:
    return np.zeros(0, BOND_EVENT)


@frozen(kw_only=True, eq=False)
class State:
    """The state between two outer steps; N cells."""

    step: int  # sub-steps done since the preparation began; keys the draws
    zero: int  # the sub-step at which the clock showed zero
    time: float  # s
    centres: Array  # (N, 3) µm
    wall_gaps: Array  # (N,) µm, smooth sphere to wall
    orientations: Array  # (N, 4)
    velocities: Array  # (N, 6) of the last sub-step: where the next one's Newton iteration starts
    drift: Array  # (N, 6) mean velocity over the last outer step
    mean_loads: Array  # (N, 6) mean over the last outer step of all loads but the fluid's
    bonds: BondList
    bound_since: Array  # (N,) s; infinite for a free cell
    bound_at: Array  # (N,) µm, x at that time
    caught_since: Array  # (N,) s; infinite until the cell is caught
    guess: Array | None = None  # of the solver
    events: Any = field(factory=_no_events)  # bond events of the last outer step; not part of what going on needs

    def bond_counts(self) -> Indices:
        """Give each cell's number of living bonds."""
        return np.bincount(self.bonds.cell, minlength=len(self.wall_gaps))


def to_arrays(state: State) -> dict[str, Any]:
    """Give the state as named arrays, for a checkpoint."""
    named = attrs.asdict(state, recurse=False, filter=lambda a, _: a.name not in ("bonds", "events", "guess"))
    arrays = {f"state.{name}": np.asarray(value) for name, value in named.items()}
    arrays |= {f"bonds.{name}": value for name, value in attrs.asdict(state.bonds).items()}
    return arrays if state.guess is None else arrays | {"guess": state.guess}


_SHAPES: dict[str, tuple[int, ...]] = {
    "centres": (3,),
    "wall_gaps": (),
    "orientations": (4,),
    "velocities": (6,),
    "drift": (6,),
    "mean_loads": (6,),
    "bound_since": (),
    "bound_at": (),
    "caught_since": (),
}


def _check(state: State, cells: int, sites: int) -> None:
    for name, shape in _SHAPES.items():
        found = getattr(state, name)
        if found.shape != (cells, *shape) or found.dtype != np.float64:
            raise ValueError(f"{name} is {found.dtype} of shape {found.shape}")
    bonds = state.bonds
    count = bonds.cell.shape[0] if bonds.cell.ndim else -1
    for name in ("cell", "site", "species", "ligand"):
        found = getattr(bonds, name)
        if found.shape != (count,) or found.dtype.kind != "i":
            raise ValueError(f"bonds' {name} is {found.dtype} of shape {found.shape}")
    if bonds.anchor.shape != (count, 3) or (count and (bonds.cell.max() >= cells or bonds.site.max() >= sites)):
        raise ValueError("bonds hold cells or sites that are not there")


def from_arrays(arrays: Mapping[str, Any], cells: int, sites: int) -> State:
    """Make the state of a checkpoint's arrays; the inverse of `to_arrays`.

    Raises
    ------
    ValueError, TypeError, KeyError
        If the arrays are not a state of so many cells with so many sites in all.
    """
    own = {name.removeprefix("state."): value for name, value in arrays.items() if name.startswith("state.")}
    whole = {name: own.pop(name).item() for name in ("step", "zero", "time")}
    bonds = BondList(**{n.removeprefix("bonds."): v for n, v in arrays.items() if n.startswith("bonds.")})
    state = State(**whole, **own, bonds=bonds, guess=arrays.get("guess"))
    _check(state, cells, sites)
    return state
