"""Numbers of a solver at one configuration: the spectrum of its mobility, its free motion, and how far off that is."""

import math
from functools import cache

import numpy as np

from clusters import ritz_values
from hard.cases import Outcome, judged
from mpad_core import mobility_matrix, solver
from mpad_core.interfaces.errors import MpadError
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration, Motion, Setting
from mpad_core.physics import asking
from spheres import stokes_units, velocity_error

FEW = 50  # spheres up to which the whole matrix is asked for
SYMMETRIC = 1e-7  # of Stokes' mobilities; what is iterated leaves an asymmetry
SHORTFALL = 3.0  # an estimate of the error is one to within this factor
FINEST = 3e-4  # error of the finest solver near contact, see docs/accuracy.md
LANCZOS = 25  # steps


@cache
def finest() -> MobilitySolver:
    """Give the solver that others are compared with."""
    return solver("cdl-biem", accuracy=1e-4)


def spectrum(chosen: MobilitySolver, at: Configuration, wall: bool) -> tuple[float, float, float]:
    """Give lowest and highest eigenvalue of the mobility in Stokes' units, and its asymmetry."""
    if len(at.radii) > FEW:
        values = ritz_values(chosen, at, LANCZOS)
        return float(values[0]), float(values[-1]), 0.0
    units = np.outer(stokes_units(at.radii), stokes_units(at.radii))
    matrix = mobility_matrix(chosen, at.centres, at.radii, viscosity=1.0, wall=wall) / units
    values = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))
    return float(values[0]), float(values[-1]), float(np.abs(matrix - matrix.T).max())


def free_motion(chosen: MobilitySolver, at: Configuration, wall: bool) -> Motion:
    """Give the motion in shear under weights as strong as the shear's load."""
    setting, loads = Setting(viscosity=1.0, shear_rate=1.0, wall=wall), np.zeros((len(at.radii), 6))
    loads[:, 2] = -6 * np.pi * at.radii**2
    return asking.solve(chosen, asking.prepare(chosen, chosen.plan(setting), at), loads)


def true_motion(at: Configuration, wall: bool) -> Motion | None:
    """Give the free motion by the finest solver; None where it refuses, or where there are many."""
    if len(at.radii) > FEW:
        return None
    try:
        return free_motion(finest(), at, wall)
    except MpadError:
        return None


ELEMENTS = {24: 6e-2, 96: 2e-2}  # what boundary elements claim at most, see `ElementsPlan`


def level_of(chosen: MobilitySolver) -> float:
    """Give the error that the solver's level claims."""
    if getattr(chosen, "discretisation", "") == "elements":
        return ELEMENTS[chosen.elements]  # type: ignore[attr-defined]
    levels = chosen.traits.levels
    return max((x.error for x in levels if all(getattr(chosen, k) == v for k, v in x.parameters)), default=0.0)


def at_configuration(chosen: MobilitySolver, at: Configuration, wall: bool = True) -> Outcome:
    """Ask for the mobility and for free motion; judge them."""
    lowest, highest, asymmetry = spectrum(chosen, at, wall)
    motion, true = free_motion(chosen, at, wall), true_motion(at, wall)
    claimed, found = motion.report.error, math.nan
    faults = [] if asymmetry <= SYMMETRIC else [f"asymmetric by {asymmetry:.1e}"]
    if not lowest > 0:
        faults.append(f"not positive definite: lowest eigenvalue {lowest:.1e}")
    if true is not None:
        found = float(velocity_error(motion.velocity, true.velocity, at.radii))
        granted = max(FINEST, SHORTFALL * true.report.error)  # the finest solver's own error
        if not found <= max(SHORTFALL * claimed, level_of(chosen)) + granted:
            faults.append(f"claims an error of {claimed:.1e} and has {found:.1e}")
    return judged(
        faults, condition=highest / lowest, lowest=lowest, iterations=motion.report.iterations, claimed=claimed,
        found=found,
    )  # fmt: skip
