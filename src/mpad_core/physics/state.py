"""The state of a run: all that going on needs, and nothing that can be worked out again."""

from collections.abc import Iterator, Mapping
from typing import Any

import attrs
import numpy as np
from attrs import field, frozen

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.values import BOND_EVENT


@frozen(kw_only=True, eq=False)
class BondList:
    """The living bonds, one cell's after those of the cell before, each cell's oldest first."""

    cell: Indices  # (B,) ascending
    site: Indices  # (B,) index of the molecule among all cells' molecules
    species: Indices  # (B,)
    state: Indices  # (B,) inner state
    partner: Indices  # (B,) the other cell; -1 for the wall
    ligand: Indices  # (B,) the partner's molecule, or the identity of the wall's; -1 where not told apart
    anchor: Array  # (B, 3) µm; not used between cells

    def __len__(self) -> int:
        """Give the number of living bonds."""
        return len(self.cell)

    def pairs(self) -> Indices:
        """Give the pairs of cells (P, 2) that are bound to each other."""
        bridging = self.partner >= 0
        pairs: Indices = np.unique(np.stack([self.cell[bridging], self.partner[bridging]], axis=1), axis=0)
        return pairs


def no_bonds() -> BondList:
    """Give the empty list."""
    none = np.zeros(0, np.int64)
    return BondList(cell=none, site=none, species=none, state=none, partner=none, ligand=none, anchor=np.zeros((0, 3)))


def _no_events() -> Any:
    return np.zeros(0, BOND_EVENT)


@frozen(kw_only=True, eq=False)
class Waypoint:
    """Where the cells were on the way of an outer step; named as in State."""

    step: int
    time: float
    centres: Array
    wall_gaps: Array
    orientations: Array
    drift: Array  # (N, 6) mean velocity since the waypoint before


@frozen(kw_only=True, eq=False)
class Way:
    """The way of an outer step: W places of N cells, the last of them where it ends."""

    steps: Indices  # (W,)
    times: Array  # (W,) s
    centres: Array  # (W, N, 3) µm
    wall_gaps: Array  # (W, N)
    orientations: Array  # (W, N, 4)
    turns: Array  # (W, N, 3) angular velocity, integrated over time since the way began

    def points(self, start: "State") -> Iterator[Waypoint]:
        """Yield its places; `start` is the state where it began."""
        time, centres, turns = start.time, start.centres, np.zeros_like(start.centres)
        for k in range(len(self.steps)):
            moved = np.concatenate([self.centres[k] - centres, self.turns[k] - turns], axis=1)
            drift = moved / (self.times[k] - time)
            time, centres, turns = float(self.times[k]), self.centres[k], self.turns[k]
            yield Waypoint(
                step=int(self.steps[k]), time=time, centres=centres, wall_gaps=self.wall_gaps[k],
                orientations=self.orientations[k], drift=drift,
            )  # fmt: skip


@frozen(kw_only=True, eq=False)
class State:
    """The state between two outer steps; N cells."""

    step: int  # grains of time since the preparation began; keys the draws
    zero: int  # the step at which the clock showed zero
    time: float  # s
    centres: Array  # (N, 3) µm
    wall_gaps: Array  # (N,) µm, smooth sphere to wall
    orientations: Array  # (N, 4)
    velocities: Array  # (N, 6) of the last sub-step: where the next one's Newton iteration starts
    drift: Array  # (N, 6) mean velocity over the last outer step
    mean_loads: Array  # (N, 6) mean over the last outer step of all loads but the fluid's
    bonds: BondList
    clocks: Array  # (N,) how much hazard each cell uses up before its next event
    draws: Array  # (N,) how many such numbers it has drawn; whole
    bound_since: Array  # (N,) s; infinite for a free cell
    bound_at: Array  # (N,) µm, x at that time
    caught_since: Array  # (N,) s; infinite until the cell is caught
    guess: Array | None = None  # of the solver
    level: int = 0  # the rung climbed to, where the solver stands for several
    trust: float = 0.0  # in the error that it reports
    events: Any = field(factory=_no_events)  # bond events of the last outer step; not part of what going on needs
    way: Way | None = None  # of the last outer step; neither is this

    def bond_counts(self) -> Indices:
        """Give each cell's number of living bonds, those to other cells included."""
        cells, partner = len(self.wall_gaps), self.bonds.partner
        kept = np.bincount(self.bonds.cell, minlength=cells)
        return kept + np.bincount(partner[partner >= 0], minlength=cells)


def to_arrays(state: State) -> dict[str, Any]:
    """Give the state as named arrays, for a checkpoint."""
    named = attrs.asdict(state, recurse=False, filter=lambda a, _: a.name not in ("bonds", "events", "way", "guess"))
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
    "clocks": (),
    "draws": (),
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
    for name in ("cell", "site", "species", "state", "partner", "ligand"):
        found = getattr(bonds, name)
        if found.shape != (count,) or found.dtype.kind != "i":
            raise ValueError(f"bonds' {name} is {found.dtype} of shape {found.shape}")
    if bonds.anchor.shape != (count, 3) or (count and (bonds.cell.max() >= cells or bonds.site.max() >= sites)):
        raise ValueError("bonds hold cells or sites that are not there")
    if (bonds.partner >= cells).any() or (bonds.ligand[bonds.partner >= 0] >= sites).any():
        raise ValueError("bonds between cells hold cells or sites that are not there")
    if (np.diff(bonds.cell) < 0).any():
        raise ValueError("bonds are not in the order of their cells")


def from_arrays(arrays: Mapping[str, Any], cells: int, sites: int) -> State:
    """Make the state of a checkpoint's arrays; the inverse of `to_arrays`.

    Raises
    ------
    ValueError, TypeError, KeyError
        If the arrays are not a state of so many cells with so many sites in all.
    """
    own = {name.removeprefix("state."): value for name, value in arrays.items() if name.startswith("state.")}
    whole = {name: own.pop(name).item() for name in ("step", "zero", "time")}
    whole |= {name: own.pop(name).item() for name in ("level", "trust") if name in own}  # older states have neither
    bonds = BondList(**{n.removeprefix("bonds."): v for n, v in arrays.items() if n.startswith("bonds.")})
    state = State(**whole, **own, bonds=bonds, guess=arrays.get("guess"))
    _check(state, cells, sites)
    return state
