"""How contracts ask a mobility solver: what all of them share."""

from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve, frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration, Motion, Setting
from mpad_core.physics.levels import relative_error

SHEAR = Setting(viscosity=1.3, shear_rate=2.0)


@frozen(kw_only=True, eq=False)
class Place:
    """Where a solver was asked: the fluid and the spheres."""

    setting: Setting
    at: Configuration


class AskedSolver:
    """A solver, and the questions that contracts put to it.

    Attributes
    ----------
    solver
        The solver; give it in the class that inherits.
    claimed
        The error that the solver claims for its parameters, see `AccuracyLevel`; None: it claims none.
    only
        The one place at which all laws are to be asked, instead of those that they draw.
    asked
        The last place that a law has drawn: that of the example that a failing law is told by.
    """

    solver: MobilitySolver
    claimed: float | None = None
    only: Place | None = None
    asked: Place | None = None
    _fluid: Setting = SHEAR

    @property
    def tolerance(self) -> float:
        """Give to what identities hold: 1e-8, or ten times the `tolerance` that the solver says it iterates to."""
        return max(1e-8, 10 * float(getattr(self.solver, "tolerance", 0.0)))

    def setting(self, wall: bool = True, shear_rate: float = SHEAR.shear_rate) -> Setting:
        """Give a setting, or skip the test if the solver does not treat it."""
        traits = self.solver.traits
        if not (traits.wall if wall else traits.unbounded):
            pytest.skip(f"{self.solver.name} does not treat {'a wall' if wall else 'unbounded fluid'}")
        base = SHEAR if self.only is None else self.only.setting
        if self.only is not None and base.wall != wall:
            pytest.skip(f"the scene has {'no' if wall else 'a'} wall")
        quiet = shear_rate == 0 or not traits.ambient_flow
        self._fluid = evolve(base, wall=wall, shear_rate=0.0 if quiet else base.shear_rate)
        return self._fluid

    def fitting(self, at: Configuration, fits: Callable[[Configuration], bool] | None = None) -> Configuration:
        """Change a configuration into one that the solver says it can treat, and remember it.

        Parameters
        ----------
        at
            What a law asks for; the one place that is to be asked takes its place, if there is one.
        fits
            Whether a configuration is one that the law is about; left out: it is about any.
        """
        chosen = self._treated(at) if self.only is None else self.only.at
        if fits is not None and not fits(chosen):
            whose = f"{self.solver.name} treats no" if self.only is None else "the scene has no"
            pytest.skip(f"{whose} spheres such as this law is about")
        self.asked = Place(setting=self._fluid, at=chosen)
        return chosen

    def _treated(self, at: Configuration) -> Configuration:
        """Leave out spheres and differences of radii that the solver does not treat."""
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


def single(at: Configuration) -> bool:
    """Tell whether there is one sphere."""
    return len(at.radii) == 1


def paired(at: Configuration) -> bool:
    """Tell whether there are two spheres."""
    return len(at.radii) == 2


def several(at: Configuration) -> bool:
    """Tell whether there are two spheres or more."""
    return len(at.radii) > 1


def relative(found: Array, expected: Array, radii: Array) -> float:
    """Give the error of one sphere's velocities (6,) or of several spheres', see `mpad_core.physics.levels`."""
    return relative_error(np.atleast_2d(found), np.atleast_2d(expected), radii)
