"""Two plain questions that can be asked of any solver: its mobility matrix, and velocities in shear."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import evolve

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.errors import InputError
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration, Motion, Setting, SolverTraits
from mpad_core.physics import asking


def solver(name: str, **parameters: Any) -> MobilitySolver:
    """Give an installed mobility solver by name.

    Raises
    ------
    InputError
        If no such solver is installed, or it does not take these parameters.
    """
    from mpad_core.plugins.registry import load

    made = load("solver", name)
    try:
        chosen: MobilitySolver = made(**parameters)
    except (TypeError, ValueError) as error:
        raise InputError(f"solver {name!r}: {error}") from error
    return chosen


def check_needs(
    traits: SolverTraits, name: str, configuration: Configuration, setting: Setting, torques: bool = True
) -> None:
    """Refuse, before any solve, what a solver cannot treat.

    Raises
    ------
    InputError
        Naming the need, the solver, and what other solvers may have.
    """
    radii = configuration.radii
    lacks = {
        "a wall": setting.wall and not traits.wall,
        "an unbounded fluid": not setting.wall and not traits.unbounded,
        "unequal radii": bool(np.ptp(radii) > 0) and not traits.unequal_radii,
        "torques": torques and not traits.torques,
        "ambient flow": setting.shear_rate != 0 and not traits.ambient_flow,
        f"{len(radii)} cells": traits.largest_number is not None and len(radii) > traits.largest_number,
    }
    for need, lacking in lacks.items():
        if lacking:
            raise InputError(f"solver {name!r} cannot treat {need}; see `mpad parts` for the others installed")


def _numbers(what: str, values: Any) -> Array:
    try:
        return np.asarray(values, float)
    except (ValueError, TypeError) as error:
        raise InputError(f"{what} must be numbers in a regular array: {error}") from error


def _setting(viscosity: float, shear_rate: float, wall: bool) -> Setting:
    if not (np.isfinite(viscosity) and viscosity > 0):
        raise InputError(f"viscosity must be positive and finite, not {viscosity}")
    if not np.isfinite(shear_rate):
        raise InputError(f"shear_rate must be finite, not {shear_rate}")
    return Setting(viscosity=viscosity, shear_rate=shear_rate, wall=wall)


def _held(held: Sequence[int], n: int) -> Indices:
    chosen = np.asarray(held)
    if chosen.size and chosen.dtype.kind not in "iu":
        raise InputError(f"held must list the numbers of spheres, not {held!r}")
    if chosen.size and (chosen.min() < 0 or chosen.max() >= n):
        raise InputError(f"held must name spheres 0 to {n - 1}, not {held!r}")
    return np.unique(chosen.astype(np.int64))


def _configuration(centres: Any, radii: Any, wall: bool) -> Configuration:
    centres = np.atleast_2d(_numbers("centres", centres))
    radii = _numbers("radii", radii)
    if radii.shape not in ((), (len(centres),)):
        raise InputError(f"radii must be one number or one for each of the {len(centres)} spheres, not {radii.shape}")
    radii = np.broadcast_to(radii, (len(centres),))
    if centres.ndim != 2 or centres.shape[1] != 3 or len(centres) == 0:
        raise InputError(f"centres must be (N, 3) with N at least 1, not {centres.shape}")
    if not (np.isfinite(centres).all() and np.isfinite(radii).all() and (radii > 0).all()):
        raise InputError("centres must be finite and radii positive")
    if wall and (centres[:, 2] <= 0).any():
        i = int(np.argmin(centres[:, 2]))
        raise InputError(f"sphere {i} has its centre at z = {centres[i, 2]:g}, not above the wall z = 0")
    return Configuration(centres=centres, radii=radii)


def mobility_matrix(solver: MobilitySolver, centres: Any, radii: Any, *, viscosity: float, wall: bool = True) -> Array:
    """Give the mobility matrix of spheres.

    Parameters
    ----------
    solver
        Any mobility solver; see `mpad_core.solver`.
    centres : (N, 3)
        Above the wall z = 0, if there is one.
    radii : (N,) or float
    viscosity
        In any units consistent with the lengths.
    wall
        Whether there is a no-slip wall at z = 0.

    Returns
    -------
    matrix : (6N, 6N)
        Rows, per sphere: Ux Uy Uz Ωx Ωy Ωz; columns Fx Fy Fz Tx Ty Tz, torques about the centres.

    Raises
    ------
    InputError, RefusedError
        For input that makes no sense, or that the solver cannot treat.
    """
    configuration = _configuration(centres, radii, wall)
    setting = _setting(viscosity, 0.0, wall)
    check_needs(solver.traits, solver.name, configuration, setting)
    n = len(configuration.radii)
    prepared = asking.prepare(solver, solver.plan(setting), configuration)
    return asking.solve(solver, prepared, np.eye(6 * n).reshape(n, 6, 6 * n)).velocity.reshape(6 * n, 6 * n)


def unit_load(viscosity: float, radius: float, speed: float) -> Array:
    """Give the load (6,) that moves a sphere at about this speed: columns of a mobility are asked for in such units."""
    force = 6 * np.pi * viscosity * radius * (speed if speed > 0 else 1.0)
    return np.repeat([force, force * radius], 3)


def constrained_motion(solver: MobilitySolver, prepared: Any, loads: Array, held: Indices, unit: Array) -> Motion:
    """Give the motion under loads when some spheres are held: their constraint loads are solved for.

    Parameters
    ----------
    solver, prepared
        A solver and what its `prepare` returned.
    loads : (N, 6)
        On the free spheres; those on held ones do not matter.
    held
        Indices of the spheres whose velocity is zero.
    unit : (6,)
        A load typical of the problem, see `unit_load`, so that neither loads nor flow drown in the other.
    """
    if len(held) == 0:
        return asking.solve(solver, prepared, loads)
    answer, columns, constraint = _constrained(solver, prepared, loads, held, unit)
    velocity = answer.velocity[..., -1] + columns @ constraint
    velocity[held] = 0.0
    return evolve(answer, velocity=velocity)


def held_loads(solver: MobilitySolver, prepared: Any, loads: Array, held: Indices, unit: Array) -> Array:
    """Give the loads (N, 6) with those on held spheres that keep them at rest; the rest as `constrained_motion`."""
    constraint = _constrained(solver, prepared, loads, held, unit)[2]
    whole = loads.copy()
    whole[held] = constraint.reshape(-1, 6) * unit
    return whole


def _constrained(
    solver: MobilitySolver, prepared: Any, loads: Array, held: Indices, unit: Array
) -> tuple[Motion, Array, Array]:
    """Ask for the motion under unit loads on held spheres (N, 6, 6m) and under the others' loads; balance the two.

    The last column of what was asked is the motion with the held spheres free of loads.
    """
    n, m = len(loads), 6 * len(held)
    block = np.zeros((n, 6, m + 1))
    block[..., :] = loads[..., None]
    block[held] = 0.0
    for i, cell in enumerate(held):
        block[cell, :, 6 * i : 6 * i + 6] = np.diag(unit)
    answer = asking.solve(solver, prepared, block)
    bare = answer.velocity[..., -1]
    columns = answer.velocity[..., :-1] - bare[..., None]
    return answer, columns, np.asarray(np.linalg.solve(columns[held].reshape(m, m), -bare[held].ravel()))


def velocities(
    solver: MobilitySolver, centres: Any, radii: Any, *, viscosity: float, shear_rate: float = 0.0,
    forces: Any = None, torques: Any = None, held: Sequence[int] = (), wall: bool = True,
) -> Array:  # fmt: skip
    """Give the velocities of spheres under forces and torques in the shear flow u = shear_rate · z · x̂.

    Parameters
    ----------
    solver, centres, radii, viscosity, wall
        As for `mobility_matrix`; the flow is the same without a wall.
    shear_rate
        Of the ambient flow.
    forces, torques : (N, 3), optional
        On each sphere, torques about its centre; zero where left out.
    held
        Spheres whose velocity is zero; loads given on them do not matter.

    Returns
    -------
    velocities : (N, 6)
        Ux Uy Uz Ωx Ωy Ωz of each sphere.

    Raises
    ------
    InputError, RefusedError
        As for `mobility_matrix`.
    """
    configuration = _configuration(centres, radii, wall)
    setting = _setting(viscosity, shear_rate, wall)
    n = len(configuration.radii)
    chosen = _held(held, n)
    check_needs(solver.traits, solver.name, configuration, setting, torques is not None or chosen.size > 0)
    loads = np.zeros((n, 6))
    for part, given, what in ((slice(0, 3), forces, "forces"), (slice(3, 6), torques, "torques")):
        if given is not None:
            numbers = _numbers(what, given)
            if numbers.shape != (n, 3):
                raise InputError(f"{what} must be ({n}, 3), not {numbers.shape}")
            loads[:, part] = numbers
    if not np.isfinite(loads).all():
        raise InputError("forces and torques must be finite")
    prepared = asking.prepare(solver, solver.plan(setting), configuration)
    radius = float(configuration.radii.max())
    pushed = float(np.abs(loads[:, :3]).max() + np.abs(loads[:, 3:]).max() / radius) / (6 * np.pi * viscosity * radius)
    passed = abs(shear_rate) * float(np.abs(configuration.centres[:, 2]).max())
    return constrained_motion(solver, prepared, loads, chosen, unit_load(viscosity, radius, passed + pushed)).velocity
