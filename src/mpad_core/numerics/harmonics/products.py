"""Solves and products with the mobility of a level, by columns."""

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.harmonics.krylov import solve_columns
from mpad_core.numerics.harmonics.levels import Level

MOST = 600
"""Iterations after which a solve is given up."""


def solved(level: Level, ambient: Array, loads: Array, tolerance: float, y: Array) -> tuple[Array, int, float]:
    """Solve for loads with all corrections.

    Parameters
    ----------
    level
        The system; unit viscosity.
    ambient : (n,)
        Traces of the flow.
    loads : (K, N, 6)
        In the level's units.
    tolerance
        Residual to reach.
    y : (K, n)
        First guesses; the sources are written here.

    Returns
    -------
    velocities (K, N, 6), iterations, residual

    Raises
    ------
    FloatingPointError
        If the iteration does not converge.
    """
    u = np.empty(loads.shape)
    iterations, residual = solve_columns(level.system, ambient, loads, tolerance, MOST, y, u)
    if not residual <= tolerance:
        raise FloatingPointError(f"no convergence: residual {residual:.2g} after {iterations} iterations")
    return u / level.units, iterations, residual


def product(level: Level, loads: Array, tolerance: float) -> Array:
    """Multiply a level's mobility at unit viscosity with loads (K, N, 6), the flow left out."""
    y = np.zeros((len(loads), level.system.at.own[-1]))
    return solved(level, np.zeros_like(level.ambient), np.ascontiguousarray(loads / level.units), tolerance, y)[0]
