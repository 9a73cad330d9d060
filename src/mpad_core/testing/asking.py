"""How contracts ask a mobility solver: what all of them share."""

import numpy as np
import pytest
from attrs import evolve

from mpad_core.arrays import Array
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration, Motion, Setting

SHEAR = Setting(viscosity=1.3, shear_rate=2.0)


class AskedSolver:
    """A solver, and the questions that contracts put to it.

    Attributes
    ----------
    solver
        The solver; give it in the class that inherits.
    """

    solver: MobilitySolver

    @property
    def tolerance(self) -> float:
        """Give to what identities hold: 1e-8, or ten times the `tolerance` that the solver says it iterates to."""
        return max(1e-8, 10 * float(getattr(self.solver, "tolerance", 0.0)))

    def setting(self, wall: bool = True, shear_rate: float = SHEAR.shear_rate) -> Setting:
        """Give a setting, or skip the test if the solver does not treat it."""
        traits = self.solver.traits
        if not (traits.wall if wall else traits.unbounded):
            pytest.skip(f"{self.solver.name} does not treat {'a wall' if wall else 'unbounded fluid'}")
        return evolve(SHEAR, wall=wall, shear_rate=shear_rate if traits.ambient_flow else 0.0)

    def fitting(self, at: Configuration) -> Configuration:
        """Change a configuration into one that the solver says it can treat."""
        traits = self.solver.traits
        if traits.largest_number is not None:
            at = at.part(np.arange(min(len(at.radii), traits.largest_number)))
        if traits.unequal_radii:
            return at
        radii = np.full(len(at.radii), at.radii.min())
        return Configuration(centres=at.centres, radii=radii)

    def motion(self, setting: Setting, at: Configuration, loads: Array, guess: Array | None = None) -> Motion:
        """Ask for the motion under loads."""
        return self.solver.solve(self.solver.prepare(self.solver.plan(setting), at, guess), loads)

    def free(self, setting: Setting, at: Configuration) -> Array:
        """Give the velocities (N, 6) without loads."""
        return self.motion(setting, at, np.zeros((len(at.radii), 6))).velocity

    def matrix(self, setting: Setting, at: Configuration) -> Array:
        """Give the mobility matrix (6N, 6N)."""
        size = 6 * len(at.radii)
        quiet = evolve(setting, shear_rate=0.0)
        return self.motion(quiet, at, np.eye(size).reshape(-1, 6, size)).velocity.reshape(size, size)

    def scales(self, setting: Setting, at: Configuration) -> Array:
        """Give Stokes' own velocities (6N,) under unit loads, by roots: what matrices are divided by on both sides."""
        eta = setting.viscosity
        linear, angular = 1 / (6 * np.pi * eta * at.radii), 1 / (8 * np.pi * eta * at.radii**3)
        return np.sqrt(np.repeat(np.stack([linear, angular], axis=1), 3, axis=1)).ravel()

    def apart(self, setting: Setting, at: Configuration, found: Array, expected: Array) -> float:
        """Give the largest difference of two mobility matrices, entries in Stokes' units."""
        scales = self.scales(setting, at)
        return float(np.max(np.abs(found - expected) / np.outer(scales, scales)))


def relative(found: Array, expected: Array, radii: Array) -> float:
    """Give the relative 2-norm error of (U, aΩ): "the error" everywhere here."""
    found, expected = np.atleast_2d(found), np.atleast_2d(expected)
    weights = np.ones((len(radii), 6))
    weights[:, 3:] = radii[:, None]
    size = np.linalg.norm(weights * expected)
    wrong = np.linalg.norm(weights * (found - expected))
    return float(wrong / size) if size > 0 else float(wrong)
