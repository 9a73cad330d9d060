"""Asking a part: what it raises names it, and what it answers is looked at before it is believed."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from attrs import evolve

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import InputError, PartError, RefusedError
from mpad_core.interfaces.mobility import FluidVelocity, MobilitySolver
from mpad_core.interfaces.values import Configuration, Motion


def one_line(error: BaseException) -> str:
    """Give an error's kind and message in one line of bounded length."""
    return f"{type(error).__name__}: {' '.join(str(error).split())}"[:400]


@contextmanager
def blamed(part: str) -> Iterator[None]:
    """Name the part in whatever it raises; a part that tries to leave the process has failed, too."""
    try:
        yield
    except (PartError, InputError):
        raise
    except RefusedError as error:
        raise RefusedError(f"{part}: {error}") from error
    except (Exception, SystemExit) as error:
        raise PartError(f"{part} failed: {one_line(error)}") from error


def prepare(solver: MobilitySolver, plan: Any, configuration: Configuration, guess: Array | None = None) -> Any:
    """Let a solver prepare a configuration; it gets a copy, since it may write to what it is given."""
    copy = Configuration(
        centres=configuration.centres.copy(), radii=configuration.radii.copy(), wall_gaps=configuration.wall_gaps.copy()
    )
    with blamed(f"solver {solver.name!r}"):
        return solver.prepare(plan, copy, guess)


def solve(solver: MobilitySolver, prepared: Any, loads: Array) -> Motion:
    """Let a solver solve, and check its answer.

    Raises
    ------
    PartError
        If the velocities are not finite real numbers in the shape of the loads.
    """
    who = f"solver {solver.name!r}"
    with blamed(who):
        motion = solver.solve(prepared, loads.copy())
        velocity = np.asarray(motion.velocity)
    if velocity.shape != loads.shape or velocity.dtype.kind != "f":
        raise PartError(f"{who} answered with {velocity.dtype} of shape {velocity.shape}, not reals of {loads.shape}")
    if not np.isfinite(velocity).all():
        raise PartError(f"{who} answered with velocities that are not finite")
    return evolve(motion, velocity=velocity.astype(np.float64, copy=False))


def flow(solver: FluidVelocity, prepared: Any, motion: Motion, points: Array) -> Array:
    """Let a solver tell the fluid's velocity (n, 3) at points (n, 3), and check its answer.

    Raises
    ------
    PartError
        If it is not finite real numbers in the shape of the points.
    """
    who = f"solver {getattr(solver, 'name', type(solver).__name__)!r}"
    with blamed(who):
        velocity = np.array(solver.flow(prepared, motion, points.copy()), np.float64)
    if velocity.shape != points.shape or not np.isfinite(velocity).all():
        raise PartError(f"{who} gave a flow of shape {velocity.shape} that is not finite numbers for {points.shape}")
    return velocity
