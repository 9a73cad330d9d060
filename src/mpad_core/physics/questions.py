"""Two plain questions that can be asked of any solver: its mobility matrix, and velocities in shear."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import evolve

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.errors import InputError, RefusedError
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration, Motion, Setting, SolverTraits
from mpad_core.physics import asking
from mpad_core.physics.given import configuration_of, held_of, loads_of, setting_of


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
    configuration = configuration_of(centres, radii, wall)
    setting = setting_of(viscosity, 0.0, wall)
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

    Raises
    ------
    RefusedError
        If the held spheres' mobility is not positive definite to the digits that the solver gives.
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
    _check_definite(solver, columns[held].reshape(m, m) / np.tile(unit, len(held)), held)
    return answer, columns, np.asarray(np.linalg.solve(columns[held].reshape(m, m), -bare[held].ravel()))


def _check_definite(solver: MobilitySolver, mobility: Array, held: Indices) -> None:
    """Refuse the held spheres' mobility (m, m) where its weakest motion drowns in what the solver errs by."""
    size = np.sqrt(np.abs(np.diag(mobility)))
    try:
        np.linalg.cholesky((mobility + mobility.T) / np.outer(size, size))
    except np.linalg.LinAlgError as error:
        named = ", ".join(map(str, held.tolist()))
        fault = f"the mobility of the held spheres {named} is singular to the digits it has: move them apart"
        raise RefusedError(f"solver {solver.name!r}: {fault}") from error


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
    configuration = configuration_of(centres, radii, wall)
    setting = setting_of(viscosity, shear_rate, wall)
    n = len(configuration.radii)
    chosen = held_of(held, n)
    check_needs(solver.traits, solver.name, configuration, setting, torques is not None or chosen.size > 0)
    loads = loads_of(n, forces, torques)
    prepared = asking.prepare(solver, solver.plan(setting), configuration)
    radius = float(configuration.radii.max())
    pushed = float(np.abs(loads[:, :3]).max() + np.abs(loads[:, 3:]).max() / radius) / (6 * np.pi * viscosity * radius)
    passed = abs(shear_rate) * float(np.abs(configuration.centres[:, 2]).max())
    return constrained_motion(solver, prepared, loads, chosen, unit_load(viscosity, radius, passed + pushed)).velocity
