"""One cell passes others: what did they do to its path, and was it caught?

The overlap δ is followed against the distance Δx from the cell that is passed, beside the path of the same cell alone.
Both are compared at the same place along the wall.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import evolve, frozen

from mpad_core.arrays import Array
from mpad_core.physics.coupling import lone_velocity
from mpad_core.physics.measures import hazards
from mpad_core.physics.problem import Problem
from mpad_core.records.trajectory import Trajectory

_ON_CONTACT = 0.5  # of the weight that repulsion must carry


@frozen(kw_only=True, eq=False)
class Path:
    """One cell's way past another (T frames)."""

    problem: Problem
    cell: int
    times: Array  # s
    centres: Array  # (T, N, 3) µm
    dx: Array  # µm
    overlap: Array  # µm
    caught_at: float  # s, infinite if it was not caught
    bound_at: float  # s, when the bonds began that hold it at the end; infinite if none do

    @property
    def binds(self) -> bool:
        """Whether the cell can form bonds; otherwise it is a probe."""
        return bool(self.problem.site_densities[self.cell].any())

    @property
    def x(self) -> Array:
        """Place along the wall (µm)."""
        return self.centres[:, self.cell, 0]

    @property
    def speed(self) -> Array:
        """Speed (µm/s) at which Δx changes."""
        return np.gradient(self.dx, self.times) if len(self.times) > 1 else np.zeros(len(self.times))

    def hazard(self, on_rate: float | None = None) -> Array:
        """Give the capture hazard (1/s) along the path, of the scene's on-rate or of another (1/s)."""
        measured = hazards(self.problem, on_rate)
        return np.array([measured.at(centres)[self.cell] for centres in self.centres])

    def rests_on_contact(self) -> Any:
        """Tell for every frame whether the wall's repulsion carries the cell's weight (or half of it)."""
        problem, i = self.problem, self.cell
        tip_gap = self.centres[:, i, 2] - problem.radii[i] - problem.roughness[i] - problem.wall_roughness
        if problem.contact is None:
            return np.zeros(len(tip_gap), bool)
        low, high = problem.contact.gaps()
        force = np.where(tip_gap < high, problem.contact.force(np.clip(tip_gap, low, high)), 0.0)
        weight = -problem.external[i, 2]
        return (force > _ON_CONTACT * weight) & (weight > 0)


def free_part(path: Path, trajectory: Trajectory) -> Path:
    """Give the path up to the cell's first bond: what flow, weight and contact alone did to it."""
    events = trajectory.bond_events[trajectory.bond_events["cell"] == path.cell]
    first = events["time"][0] if len(events) else np.inf
    frames = max(int(np.searchsorted(path.times, first, side="right")), 1)
    cut = {name: getattr(path, name)[:frames] for name in ("times", "centres", "dx", "overlap")}
    return evolve(path, **cut)


def bound_since(trajectory: Trajectory, cell: int) -> float:
    """Give the time (s) since when a cell has had a bond without a break, at the end; infinite if it has none."""
    events = trajectory.bond_events[trajectory.bond_events["cell"] == cell]
    living = np.cumsum(np.where(events["kind"] == 0, 1, -1))
    if len(living) == 0 or living[-1] == 0:
        return float("inf")
    breaks = np.flatnonzero(living == 0)
    return float(events["time"][breaks[-1] + 1 if len(breaks) else 0])


def path_of(problem: Problem, trajectory: Trajectory, cell: str, caught_at: float = np.inf) -> Path:
    """Take one cell's path out of a trajectory; Δx is from its partner, or from the place that stands for it."""
    i = problem.names.index(cell)
    x = trajectory.positions[:, i, 0]
    other = problem.partner[i]
    origin = trajectory.positions[:, other, 0] if other >= 0 else problem.dx_from[i]
    return Path(
        problem=problem,
        cell=i,
        times=trajectory.times,
        centres=trajectory.positions,
        dx=x - origin,
        overlap=trajectory.positions[:, i, 2] - problem.zero_overlap[i],
        caught_at=caught_at,
        bound_at=bound_since(trajectory, i),
    )


def contribution(path: Path, alone: Path) -> Array:
    """Give δ less that of the same cell alone at the same place along the wall (µm); NaN where that never was.

    Both are free parts of paths, along which x only grows.
    """
    return path.overlap - np.interp(path.x, alone.x, alone.overlap, left=np.nan, right=np.nan)


def least_overlap(path: Path, alone: Path | None, downstream: bool) -> dict[str, Any] | None:
    """Describe the least δ on one side of the cell that is passed, and what it rests on."""
    side = np.flatnonzero(path.dx > 0 if downstream else path.dx < 0)
    if len(side) == 0:
        return None
    at = side[int(np.argmin(path.overlap[side]))]
    found = {
        "delta_nm": 1e3 * path.overlap[at],
        "dx_um": path.dx[at],
        "at_edge_of_range": bool(at in (side[0], side[-1])),
        "rests_on_contact": bool(path.rests_on_contact()[at]),
    }
    if alone is not None:
        by_other = 1e3 * contribution(path, alone)[at]
        found |= {"alone_nm": 1e3 * path.overlap[at] - by_other, "contribution_of_the_other_nm": by_other}
    return found


def capture_odds(path: Path, on_rate: float | None = None) -> dict[str, Any]:
    """Give the odds that the cell forms a first bond on its way, were it free to bind, and where it would."""
    hazard = path.hazard(on_rate)
    grown = np.concatenate([[0.0], np.cumsum(0.5 * (hazard[1:] + hazard[:-1]) * np.diff(path.times))])
    odds = 1 - np.exp(-grown)
    half = np.flatnonzero(odds >= 0.5)
    return {
        "on_rate_per_s": on_rate if on_rate is not None else [s.on_rate for s in path.problem.species],
        "probability": float(odds[-1]),
        "median_dx_um": float(np.interp(0.5, odds, path.dx)) if len(half) else None,
        "largest_per_um": float(np.max(hazard / np.maximum(np.abs(path.speed), 1e-12))),
    }


def free_stream_ratio(problem: Problem, cell: int, z: float) -> float:
    """Give U / γz of a lone cell at a height, exactly."""
    radius = float(problem.radii[cell])
    shear = problem.setting.shear_rate
    return lone_velocity(problem.setting, radius, z, z - radius) / (shear * z) if shear else float("nan")


def describe(path: Path, free: Path, alone: Path | None, on_rates: Sequence[float]) -> dict[str, Any]:
    """Describe one passage in numbers: the path, its free part, and the free part of the same cell's path alone."""
    caught, bound = np.isfinite(path.caught_at), np.isfinite(path.bound_at)
    summary: dict[str, Any] = {
        "free_stream_U_over_gamma_z": free_stream_ratio(path.problem, path.cell, float(path.centres[0, path.cell, 2])),
        "free_until_dx_um": free.dx[-1],
        "least_overlap_upstream": least_overlap(free, alone, downstream=False),
        "least_overlap_downstream": least_overlap(free, alone, downstream=True),
        "caught": bool(caught),
        "caught_dx_um": float(np.interp(path.caught_at, path.times, path.dx)) if caught else None,
        "caught_at_s": float(path.caught_at) if caught else None,
        "bound_dx_um": float(np.interp(path.bound_at, path.times, path.dx)) if bound else None,
    }
    if path.problem.species and not path.binds:
        summary["capture_odds_were_it_free_to_bind"] = [capture_odds(path, rate) for rate in (None, *on_rates)]
    return summary
