"""The bonds behind the rolling: how many, how loaded when they break, how long they last.

All of it is of the table of events, which is exact in time; frames are not needed.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from mpad_core.arrays import Array
from mpad_core.studies.measures.estimates import Sample, deviation_of, mean_of, quotient

_FORMED, _BROKEN = 0, 1  # BOND_EVENT's kind
_WHO = ["species", "cell", "receptor", "partner", "ligand"]
WALL = -1

BOND_LIFE = np.dtype(
    [
        ("formed", "f8"),  # s
        ("broken", "f8"),  # s; infinite: it outlived the record
        ("cell", "i4"),
        ("partner", "i4"),  # the other cell, WALL for none
        ("species", "u1"),
        ("length", "f8"),  # µm, when it broke; NaN if it did not
        ("force", "f8"),  # pN, when it broke; NaN if it did not
    ]
)


def lives_of(events: NDArray[np.void]) -> NDArray[np.void]:
    """Give every bond's life, in the order of forming.

    Parameters
    ----------
    events : (R,) of BOND_EVENT
        In the order in which they happened; changes of inner states are no matter here.

    Returns
    -------
    (B,) of BOND_LIFE
    """
    events = events[events["kind"] <= _BROKEN]
    if not len(events):
        return np.empty(0, BOND_LIFE)
    whose = np.unique(events[_WHO], return_inverse=True)[1]
    order = np.argsort(whose, kind="stable")  # one bond's events together, each in its order
    sorted_events, same = events[order], np.append(np.diff(whose[order]) == 0, False)
    births = np.flatnonzero(sorted_events["kind"] == _FORMED)
    ended = same[births]
    deaths = sorted_events[np.minimum(births + 1, len(events) - 1)]
    lives = np.empty(len(births), BOND_LIFE)
    for name in ("cell", "partner", "species"):
        lives[name] = sorted_events[name][births]
    lives["formed"] = sorted_events["time"][births]
    lives["broken"] = np.where(ended, deaths["time"], np.inf)
    lives["length"], lives["force"] = (np.where(ended, deaths[name], np.nan) for name in ("length", "force"))
    found: NDArray[np.void] = lives[np.argsort(order[births])]
    return found


@frozen(kw_only=True, eq=False)
class CellBonds:
    """The bonds of one cell while it was watched."""

    lives: NDArray[np.void]  # (B,) of BOND_LIFE
    times: Array  # (T,), s: the edges of intervals over which numbers are averaged
    cell: str
    run: str = ""

    def number_integral(self, power: int = 1) -> Array:
        """Integrate the number of bonds to a power over each interval, (T − 1,) s."""
        return self._integrals(lambda number: number.astype(float) ** power)

    def share(self, number: int) -> Array:
        """Give the time (s) in each interval during which there were just so many bonds, (T − 1,)."""
        return self._integrals(lambda there: (there == number).astype(float))

    def most(self) -> int:
        """Give the largest number of bonds while the cell was watched."""
        times, number = self._steps()
        return int(number[np.diff(np.append(times, self.times[-1])) > 0].max(initial=0))

    def ruptures(self) -> NDArray[np.void]:
        """Give the bonds that broke while the cell was watched, in the order of breaking."""
        if not len(self.times):
            return self.lives[:0]
        broken = self.lives["broken"]
        there: NDArray[np.void] = self.lives[(broken > self.times[0]) & (broken <= self.times[-1])]
        return there[np.argsort(there["broken"], kind="stable")]

    def _steps(self) -> tuple[Array, NDArray[np.int64]]:
        """Give when the number of bonds changes while the cell is watched, and what it is from then on."""
        ends = self.lives["broken"][np.isfinite(self.lives["broken"])]
        change = np.repeat([0, 1, -1], [1, len(self.lives), len(ends)])
        times = np.concatenate([self.times[:1], self.lives["formed"], ends])
        order = np.argsort(times, kind="stable")
        return np.clip(times[order], self.times[0], self.times[-1]), np.cumsum(change[order])

    def _integrals(self, what: Callable[[NDArray[np.int64]], Array]) -> Array:
        if not len(self.times):
            return np.empty(0)
        times, number = self._steps()
        knots = np.append(times, self.times[-1])
        grown = np.concatenate([[0.0], np.cumsum(what(number) * np.diff(knots))])
        integrals: Array = np.diff(np.interp(self.times, knots, grown))
        return integrals


def bonds_of(
    lives: NDArray[np.void], cells: Sequence[str], times: Mapping[str, Array], *, run: str = "",
    between_cells: bool = False,
) -> list[CellBonds]:  # fmt: skip
    """Give the bonds of some cells: those with the wall, or those with other cells.

    Parameters
    ----------
    lives : (B,) of BOND_LIFE
        Of all cells of a run, see `lives_of`.
    cells
        Names of all cells of the run, in its order.
    times : (T,) for each cell's name
        s, edges of the intervals over which numbers of bonds are averaged; cells that are not named are left out.
    run
        Which run it is.
    between_cells
        A bond between cells is one of each of the two.
    """
    return [
        CellBonds(lives=lives[_of(lives, i, between_cells)], times=times[name], cell=name, run=run)
        for i, name in enumerate(cells)
        if name in times
    ]


def _of(lives: NDArray[np.void], cell: int, between_cells: bool) -> NDArray[np.bool_]:
    mine = (lives["cell"] == cell) | (lives["partner"] == cell)
    kept: NDArray[np.bool_] = mine & ((lives["partner"] == WALL) != between_cells)
    return kept


def _counted(bonds: Sequence[CellBonds]) -> dict[str, int]:
    return {"cells": len({(b.run, b.cell) for b in bonds}), "seeds": len({b.run for b in bonds})}


def bond_number(bonds: Sequence[CellBonds]) -> Sample:
    """Give the mean number of bonds of a cell, over time."""
    series = [np.stack([b.number_integral(), np.diff(b.times)], axis=1) for b in bonds]
    return Sample(series=series, statistic=quotient(0, 1), least=0.0, **_counted(bonds))


def bond_number_deviation(bonds: Sequence[CellBonds]) -> Sample:
    """Give the standard deviation of the number of bonds of a cell, over time."""
    series = [np.stack([b.number_integral(), b.number_integral(2), np.diff(b.times)], axis=1) for b in bonds]
    return Sample(
        series=series, statistic=lambda mean: deviation_of(mean / mean[..., 2:]), least=0.0, **_counted(bonds)
    )


def bond_number_shares(bonds: Sequence[CellBonds]) -> Array:
    """Give the share of time with 0, 1, 2, … bonds, (most + 1,); empty where nothing was watched."""
    watched = [b for b in bonds if len(b.times) > 1]
    most = max((b.most() for b in watched), default=-1)
    times = np.array([sum(float(b.share(n).sum()) for b in watched) for n in range(most + 1)])
    return times / times.sum() if len(times) else times


def rupture_forces(bonds: Sequence[CellBonds]) -> list[Array]:
    """Give the forces (pN) of bonds when they broke, one series a cell, in order."""
    return [b.ruptures()["force"] for b in bonds]


def rupture_force(bonds: Sequence[CellBonds]) -> Sample:
    """Give the mean force (pN) of bonds when they broke."""
    return Sample(series=rupture_forces(bonds), statistic=mean_of, **_counted(bonds))


def lifetime(bonds: Sequence[CellBonds]) -> Sample:
    """Give the mean lifetime of bonds (s): the time that bonds lived while watched, by the number that broke.

    So bonds that were there before, or outlive the record, count with the time they were seen.
    """
    series = [np.stack([b.number_integral(), _ruptures_in(b)], axis=1) for b in bonds]
    return Sample(series=series, statistic=quotient(0, 1), least=0.0, **_counted(bonds))


def _ruptures_in(bonds: CellBonds) -> Array:
    """Count the ruptures in each interval, an interval's end being its own."""
    at = np.searchsorted(bonds.times, bonds.ruptures()["broken"], side="left") - 1
    return np.bincount(at, minlength=max(len(bonds.times) - 1, 0)).astype(float)
