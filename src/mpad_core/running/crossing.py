"""Smooth spheres stay apart: what would carry one through another, or through the wall, is found and refused.

Without repulsion nothing but lubrication keeps two cells apart, and many solvers have none: their velocities carry one
cell through the other. Steps are looked at when they have been made, over all of their way and not at its ends alone.
"""

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.errors import RefusedError
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import State
from mpad_core.running.assembly import near_pairs, pair_gaps

TOUCHING = 1e-9
"""Radii: overlaps up to this are rounding of spheres that touch."""

_HALF = 0.5  # of a pair's gap, that a prediction may close


@frozen(kw_only=True)
class Crossing:
    """Two cells, or one and the wall, that a step would carry through each other."""

    cells: tuple[int, ...]
    gap: float  # µm, before the step
    depth: float  # µm, the least gap on its way; negative


def refuse_overlaps(problem: Problem, centres: Array, wall_gaps: Array) -> None:
    """Refuse smooth spheres that overlap, or that the wall cuts, where a run begins.

    Raises
    ------
    RefusedError
        Naming the cells and by how much they overlap.
    """
    found = _through_wall(problem, wall_gaps, wall_gaps) if problem.setting.wall else None
    if found is None:
        pairs = near_pairs(problem, centres, 0.0)
        found = _deepest(problem, pairs, pair_gaps(problem, pairs, centres), centres)
    if found is not None:
        fault = f"{_named(problem, found)} overlap by {-found.depth:.4g} um at the start"
        raise RefusedError(f"{fault}: smooth spheres must be apart; move them")


def crossing(problem: Problem, before: State, after: State) -> Crossing | None:
    """Find what a step has carried through each other, the deepest of them; nothing in a good step."""
    if problem.setting.wall and not after.wall_gaps.min() > 0:
        return _through_wall(problem, before.wall_gaps, after.wall_gaps)
    if len(problem.radii) == 1:
        return None
    way = after.centres[None] if after.way is None else after.way.centres
    places = np.concatenate([before.centres[None], way])
    farthest = float(np.sqrt(((places - places[0]) ** 2).sum(axis=2).max()))
    pairs = near_pairs(problem, before.centres, 2 * farthest)
    if len(pairs) == 0:
        return None
    least = _least_distances(places[:, pairs[:, 0]] - places[:, pairs[:, 1]]) - problem.radii[pairs].sum(axis=1)
    return _deepest(problem, pairs, least, before.centres)


def refusal(problem: Problem, found: Crossing, state: State) -> RefusedError:
    """Give the error that ends a run whose cells are driven through each other however short the step."""
    if len(found.cells) == 1:
        remedy = "shorten accuracy.explicit" if problem.tolerances.euler > 0 else "add [repulsion]"
    elif problem.contact is not None:
        remedy = "their [repulsion] is too weak"
    elif not problem.coupled:
        remedy = "add [repulsion], or let the fluid couple them (effects.coupling)"
    elif problem.solver.traits.lubrication:
        remedy = "add [repulsion]"
    else:
        remedy = "add [repulsion], or name a solver with near-contact forces between cells (see `mpad parts`)"
    who = f"{_named(problem, found)} are driven through each other at a gap of {found.gap:.4g} um"
    when = f"step {state.step - state.zero}, t = {state.time:.6g} s"
    return RefusedError(f"{when}: {who}, and nothing keeps them apart; {remedy}; solver {problem.solver.name!r}")


def apart(problem: Problem, pairs: Indices, centres: Array, shift: Array) -> Array:
    """Shorten a predicted displacement (N, 3) until it closes no pair's gap by more than half."""
    if len(pairs) == 0:
        return shift
    gaps = np.maximum(pair_gaps(problem, pairs, centres), 0.0)
    if (gaps - pair_gaps(problem, pairs, centres + shift) <= _HALF * gaps).all():
        return shift
    length = np.linalg.norm(shift[pairs[:, 0]] - shift[pairs[:, 1]], axis=1)  # closes no gap by more than itself
    shorter: Array = shift * min(float((_HALF * gaps / np.maximum(length, 1e-300)).min()), 1.0)
    return shorter


def _least_distances(between: Array) -> Array:
    """Give the least distance (P,) on straight ways between places (W, P, 3) of one cell relative to another."""
    start, way = between[:-1], np.diff(between, axis=0)
    square = np.maximum((way**2).sum(axis=2), 1e-300)
    share = np.clip(-(start * way).sum(axis=2) / square, 0.0, 1.0)
    nearest = start + share[..., None] * way
    least: Array = np.sqrt((nearest**2).sum(axis=2).min(axis=0))
    return least


def _through_wall(problem: Problem, before: Array, after: Array) -> Crossing | None:
    depth = np.where(np.isfinite(after), after / problem.radii, -np.inf)
    cell = int(np.argmin(depth))
    if depth[cell] > 0:
        return None
    return Crossing(cells=(cell,), gap=float(before[cell]), depth=float(after[cell]))


def _deepest(problem: Problem, pairs: Indices, least: Array, before: Array) -> Crossing | None:
    through = least + TOUCHING * problem.radii[pairs].min(axis=1)
    if not (through < 0).any():
        return None
    worst = int(np.argmin(through))
    gap = float(pair_gaps(problem, pairs[worst : worst + 1], before)[0])
    return Crossing(cells=tuple(pairs[worst].tolist()), gap=gap, depth=float(least[worst]))


def _named(problem: Problem, found: Crossing) -> str:
    names = [f"cell {problem.names[i]!r}" for i in found.cells]
    return " and ".join(names if len(names) > 1 else [*names, "the wall"])
