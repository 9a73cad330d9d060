"""What a lone sphere above the wall lacks in this method: resistance and load up to the exact ones; compiled."""

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.stokeslets import self_mobilities
from mpad_core.numerics.wall_functions import wall_resistance, wall_shear_load


@compiled
def ambient_velocities(centres: Array, shear_rate: float) -> Array:
    """Give the velocity and rotation (N, 6) of the flow (shear_rate z, 0, 0) at the centres."""
    ambient = np.zeros((len(centres), 6))
    for i in range(len(centres)):
        ambient[i, 0] = shear_rate * centres[i, 2]
        ambient[i, 4] = 0.5 * shear_rate
    return ambient


@compiled
def wall_inverse(block: Array, out: Array) -> None:
    """Invert a 6x6 of the symmetry of a sphere at the wall: x with Ω_y, y with Ω_x, and z and Ω_z alone."""
    determinant = block[0, 0] * block[4, 4] - block[0, 4] * block[4, 0]
    out[:] = 0.0
    out[0, 0] = out[1, 1] = block[4, 4] / determinant
    out[3, 3] = out[4, 4] = block[0, 0] / determinant
    out[0, 4] = out[4, 0] = -block[0, 4] / determinant
    out[1, 3] = out[3, 1] = -block[1, 3] / determinant
    out[2, 2] = 1 / block[2, 2]
    out[5, 5] = 1 / block[5, 5]


@compiled
def lone_corrections(
    centres: Array, radii: Array, gaps: Array, viscosity: float, shear_rate: float, resistance: Array, load: Array
) -> None:
    """Write what makes each sphere exact when it is alone.

    Parameters
    ----------
    centres, radii, gaps : (N, 3), (N,), (N,)
        The gaps count for the exact functions, the heights for this method's; gaps positive.
    viscosity, shear_rate
        Of fluid and ambient flow.
    resistance : (N, 6, 6)
        Written: ΔR = R_exact - R_rpb, positive semidefinite since R_rpb is a Galerkin projection.
    load : (N, 6)
        Written: ΔF, the exact load on the sphere held in the flow less R_rpb u_∞.
    """
    own = self_mobilities(centres, radii, viscosity, True)
    ambient = ambient_velocities(centres, shear_rate)
    exact, plain = np.empty((6, 6)), np.empty((6, 6))
    for i in range(len(radii)):
        height = centres[i, 2]
        wall_resistance(height, gaps[i], radii[i], viscosity, exact)
        wall_inverse(own[i], plain)
        wall_shear_load(height, gaps[i], radii[i], viscosity, shear_rate, load[i])
        for k in range(6):
            for m in range(6):
                resistance[i, k, m] = exact[k, m] - plain[k, m]
                load[i, k] -= plain[k, m] * ambient[i, m]
