"""A scene without what is drawn at random, so that small errors of its paths can be seen.

Two seeds of a scene differ by more than two good solvers do: what a bound cell does from moment to moment is drawn at
random, and is felt by the others. Left out, the same cells in the same flow move on paths that depend on nothing but
solver and steps.
"""

import numpy as np
from attrs import evolve

from mpad_core.arrays import Array
from mpad_core.physics.problem import Booleans, Problem


def is_random(problem: Problem) -> bool:
    """Tell whether anything in a problem is drawn at random while it runs."""
    return bool(problem.site_densities.any()) or problem.thermal_energy > 0


def quiet(problem: Problem, start: Array, cell: int) -> Problem:
    """Give the problem without bonds and thermal motion.

    Parameters
    ----------
    problem
        Any.
    start : (N, 3)
        Where the cells are at time zero, after preparations (µm).
    cell
        The one that is followed: it goes free. All others that can bind are held where they are, as their bonds would.
    """
    binding: Booleans = np.asarray(problem.site_densities.any(axis=1))
    binding[cell] = False
    return evolve(
        problem,
        start=start.copy(),
        alone_for=np.zeros(len(start)),
        held=problem.held | binding,
        site_densities=np.zeros_like(problem.site_densities),
        species=(),
        thermal_energy=0.0,
    )


def stays_a_scene(problem: Problem, cell: int) -> bool:
    """Tell whether anything is left to be seen without bonds: whether the cell that is followed is seldom bound.

    A cell that passes others is; one that rolls by itself is not.
    """
    return not problem.held[cell] and not problem.site_densities[cell].any()
