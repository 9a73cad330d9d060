"""Shares of the velocity: what each effect did to the cells over one outer step, in numbers between 0 and 1 or so."""

import numpy as np
from attrs import evolve

from mpad_core.arrays import Array
from mpad_core.physics.coupling import Coupling
from mpad_core.running.balance import LOADS, OuterStep

Shares = dict[str, Array]  # by effect (1 + N, 2): of all cells, and of each; of the velocity, and of that to the wall


def shares(step: OuterStep, bare: Coupling | None = None) -> Shares:
    """Give every effect's share of the velocity over one outer step, and of the velocity normal to the wall.

    With |·| the 2-norm of (U, aΩ) over all free cells, or of U_z: the share of a load, of heat and of the coupling is
    the size of its own velocity by the sum of all these sizes. The share of the wall, and of lubrication, is the size
    of what the velocity changes by when it is left out, by the larger of the two velocities (for the wall: of each
    cell without the others).

    Parameters
    ----------
    step
        The outer step.
    bare
        The coupling without lubrication, where there is one.

    Returns
    -------
    dict
        By effect, those off included, (1 + N, 2): over all cells, then for each by itself; the velocity's share, then
        that of the velocity normal to the wall. NaN where there is no velocity; nothing where no cell is free.
    """
    scale = np.where(np.arange(6) < 3, 1.0, step.problem.radii[:, None])
    found = {name: velocity * scale for name, velocity in step.velocities().items()}
    if not found:
        return {}
    told = _of_sum({name: found[name] for name in (*LOADS, "coupling", "thermal")})
    told["wall"] = _changed(np.sum([found[name] for name in LOADS], axis=0), found["unbounded"])
    if bare is not None:
        told["lubrication"] = _changed(found["whole"], evolve(step, coupling=bare).velocities()["whole"] * scale)
    return told


def _sizes(velocity: Array) -> Array:
    """Give the norms (1 + N, 2): over all cells and of each, of (U, aΩ) and of U_z."""
    each = np.stack([np.linalg.norm(velocity, axis=1), np.abs(velocity[:, 2])], axis=1)
    return np.concatenate([np.linalg.norm(each, axis=0)[None], each])


def _of_sum(velocities: dict[str, Array]) -> Shares:
    sizes = {name: _sizes(velocity) for name, velocity in velocities.items()}
    total = np.sum(list(sizes.values()), axis=0)
    return {name: _by(size, total) for name, size in sizes.items()}


def _changed(velocity: Array, without: Array) -> Array:
    return _by(_sizes(velocity - without), np.maximum(_sizes(velocity), _sizes(without)))


def _by(sizes: Array, whole: Array) -> Array:
    with np.errstate(invalid="ignore", divide="ignore"):
        return sizes / whole
