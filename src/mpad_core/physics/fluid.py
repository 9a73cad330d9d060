"""A third plain question, for solvers that can answer it: the fluid's velocity, which carries tracers."""

from typing import Any

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import InputError, RefusedError
from mpad_core.interfaces.mobility import FluidVelocity, MobilitySolver
from mpad_core.interfaces.values import Configuration
from mpad_core.physics import asking
from mpad_core.physics.given import configuration_of, loads_of, numbers_of, setting_of
from mpad_core.physics.questions import check_needs

ON_SURFACE = 1e-9
"""Radii: points this near to a sphere's surface are on it."""


FADE = 0.1
"""Radii over which what a solver leaves of slip at a surface, and is taken off, fades away from it."""


@frozen(kw_only=True, eq=False)
class _Surface:
    """A sphere's surface as n points see it: what a solver does not resolve there, no-slip gives."""

    nearest: Array  # (n, 3), its points nearest to them, just outside
    distance: Array  # (n,)
    fading: Array  # (n,), 1 on the surface
    velocity: Array  # (n, 3), the surface's own there

    @classmethod
    def of(cls, sphere: tuple[Array, float], motion: Array, points: Array) -> "_Surface":
        centre, radius = sphere
        arm = points - centre
        length = np.linalg.norm(arm, axis=1)
        distance = np.maximum(length - radius * (1 + ON_SURFACE), 0.0)
        foot = arm * (radius / length)[:, None]
        return cls(
            nearest=centre + (1 + ON_SURFACE) * foot,
            distance=distance,
            fading=np.exp(-distance / (FADE * radius)),
            velocity=motion[:3] + np.cross(motion[3:], np.where((distance > 0)[:, None], foot, arm)),
        )


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
        as the surface does; what the solver leaves of slip there is taken off, fading over a tenth of a radius.

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
    spheres = zip(configuration.centres, configuration.radii, strict=True)
    surfaces = [_Surface.of(*sphere, at) for sphere in zip(spheres, motion.velocity, strict=True)]
    flow = asking.flow(solver, prepared, motion, np.concatenate([at, *(s.nearest for s in surfaces)]))
    free, *slipping = np.split(flow, len(surfaces) + 1)
    inverse = [1 / np.maximum(s.distance, 1e-300) for s in surfaces]
    for surface, found, share in zip(surfaces, slipping, inverse, strict=True):
        free -= (share / sum(inverse) * surface.fading)[:, None] * (found - surface.velocity)
    for surface in surfaces:
        on = surface.distance == 0
        free[on] = surface.velocity[on]
    return free


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
