"""A third plain question, for solvers that can answer it: the fluid's velocity, which carries tracers."""

from typing import Any

import numpy as np

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import InputError, RefusedError
from mpad_core.interfaces.mobility import FluidVelocity, MobilitySolver
from mpad_core.interfaces.values import Configuration
from mpad_core.physics import asking
from mpad_core.physics.given import configuration_of, loads_of, numbers_of, setting_of
from mpad_core.physics.questions import check_needs

ON_SURFACE = 1e-9
"""Radii: points this near to a sphere's surface are on it."""


def fluid_velocities(
    solver: MobilitySolver, centres: Any, radii: Any, points: Any, *, viscosity: float, shear_rate: float = 0.0,
    forces: Any = None, torques: Any = None, wall: bool = True,
) -> Array:  # fmt: skip
    """Give the fluid's velocity at points, where a tracer would be carried, around free spheres.

    Parameters
    ----------
    solver, centres, radii, viscosity, shear_rate, forces, torques, wall
        As for `velocities`; the solver must be able to tell the fluid's velocity.
    points : (n, 3)
        Outside the spheres and not below the wall. On a sphere's surface, to a billionth of its radius, the fluid moves
        as the surface does.

    Returns
    -------
    velocities : (n, 3)

    Raises
    ------
    InputError, RefusedError
        As for `mobility_matrix`, for a solver without this ability, and for points where there is no fluid.
    """
    if not isinstance(solver, FluidVelocity):
        raise RefusedError(f"solver {solver.name!r} has no flow: it cannot tell the fluid's velocity; another may")
    configuration = configuration_of(centres, radii, wall)
    setting = setting_of(viscosity, shear_rate, wall)
    loads = loads_of(len(configuration.radii), forces, torques)
    check_needs(solver.traits, solver.name, configuration, setting, torques is not None)
    at = _points(points, configuration, wall)
    prepared = asking.prepare(solver, solver.plan(setting), configuration)
    motion = asking.solve(solver, prepared, loads)
    flow = asking.flow(solver, prepared, motion, at)
    for centre, radius, own in zip(configuration.centres, configuration.radii, motion.velocity, strict=True):
        arm = at - centre
        on = np.linalg.norm(arm, axis=1) <= radius * (1 + ON_SURFACE)
        flow[on] = own[:3] + np.cross(own[3:], arm[on])
    return flow


def _points(points: Any, configuration: Configuration, wall: bool) -> Array:
    """Give the points (n, 3), none of them below the wall or in a sphere."""
    at = np.atleast_2d(numbers_of("points", points))
    if at.ndim != 2 or at.shape[1] != 3 or not np.isfinite(at).all():
        raise InputError(f"points must be (n, 3) and finite, not {at.shape}")
    if wall and (at[:, 2] < 0).any():
        raise RefusedError(f"point {int(np.argmin(at[:, 2]))} is below the wall z = 0: there is no fluid")
    for i, (centre, radius) in enumerate(zip(configuration.centres, configuration.radii, strict=True)):
        depth = radius - np.linalg.norm(at - centre, axis=1)
        if (depth > ON_SURFACE * radius).any():
            k = int(np.argmax(depth))
            raise RefusedError(f"point {k} is in sphere {i}, {depth[k]:.3g} below its surface: there is no fluid")
    return at
