"""Spheres alone: their mobilities and their motion in the flow."""

import math

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import RefusedError, refuse_first
from mpad_core.interfaces.values import Configuration, Motion, Report, Setting
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.wall_functions import wall_drift, wall_mobility, wall_shear_load
from mpad_isolated.neglected import error_of


@compiled
def lone_spheres(
    centres: Array, radii: Array, gaps: Array, viscosity: float, rate: float, wall: bool
) -> tuple[Array, Array]:
    """Give mobilities (N, 6, 6) and load-free velocities (N, 6) in the flow (rate z, 0, 0).

    With a wall the exact functions of the gap (bispherical series, see `mpad_core.numerics.wall_functions`); without,
    Stokes' 1/(6πηa) and 1/(8πηa³), and the flow at the centre, which Faxén's laws leave as it is.
    """
    mobility, free = np.zeros((len(radii), 6, 6)), np.zeros((len(radii), 6))
    load = np.empty(6)
    for i in range(len(radii)):
        height = centres[i, 2]
        if wall:
            wall_mobility(height, gaps[i], radii[i], viscosity, mobility[i])
            wall_shear_load(height, gaps[i], radii[i], viscosity, rate, load)
            for k in range(6):
                for m in range(6):
                    free[i, k] += mobility[i, k, m] * load[m]
        else:
            free[i, 0], free[i, 4] = rate * height, 0.5 * rate
            for k in range(3):
                mobility[i, k, k] = 1 / (6 * math.pi * viscosity * radii[i])
                mobility[i, 3 + k, 3 + k] = 1 / (8 * math.pi * viscosity * radii[i] ** 3)
    return mobility, free


@frozen(kw_only=True)
class Plan:
    """The setting."""

    setting: Setting

    def prepared(self, configuration: Configuration) -> "Alone":
        """Check the configuration and look up."""
        fluid, at = self.setting, configuration
        refuse_bad(at, fluid.wall)
        mobility, free = lone_spheres(at.centres, at.radii, at.wall_gaps, fluid.viscosity, fluid.shear_rate, fluid.wall)
        return Alone(setting=fluid, configuration=at, mobility=mobility, free=free)


@frozen(kw_only=True, eq=False)
class Alone:
    """Mobilities (N, 6, 6), and velocities (N, 6) without loads."""

    setting: Setting
    configuration: Configuration
    mobility: Array
    free: Array

    def solve(self, loads: Array) -> Motion:
        """Multiply."""
        columns = np.asarray(loads, dtype=np.float64).reshape(len(self.free), 6, -1)
        velocity = self.mobility @ columns + self.free[:, :, None]
        if not math.isfinite(velocity.sum()):
            raise RefusedError("isolated: the loads are not finite")
        error = error_of(self.configuration, self.setting, np.ascontiguousarray(columns), velocity)
        return Motion(velocity=velocity.reshape(np.shape(loads)), report=Report(error=error))

    def root(self, noise: Array) -> Array:
        """Multiply noise (N, 6) or (N, 6, k) with each sphere's Cholesky factor."""
        columns = np.asarray(noise, dtype=np.float64).reshape(len(self.free), 6, -1)
        return np.asarray(np.linalg.cholesky(self.mobility) @ columns).reshape(np.shape(noise))

    def drift(self) -> Array:
        """Give ∇·M (N, 6): each sphere's own, and zero without a wall."""
        drift = np.zeros((len(self.free), 6))
        if self.setting.wall:
            at = self.configuration
            own = [wall_drift(h, a, self.setting.viscosity) for h, a in zip(at.wall_gaps, at.radii, strict=True)]
            drift[:, 2] = own
        return drift


def refuse_bad(configuration: Configuration, wall: bool) -> None:
    """Refuse what has no answer.

    Raises
    ------
    RefusedError
        Naming the first sphere at fault and its number.
    """
    centres, radii, gaps = configuration.centres, configuration.radii, configuration.wall_gaps
    refuse_first("isolated", "centre {} is not finite", centres, ~np.isfinite(centres).all(axis=1))
    refuse_first("isolated", "radius {} µm is not positive", radii, ~((radii > 0) & np.isfinite(radii)))
    if wall:
        heights = centres[:, 2]
        refuse_first("isolated", "height {} µm of the centre is at or below the wall", heights, ~(heights > 0))
        refuse_first("isolated", "gap {} µm: it touches or cuts the wall", gaps, ~((gaps > 0) & np.isfinite(gaps)))
