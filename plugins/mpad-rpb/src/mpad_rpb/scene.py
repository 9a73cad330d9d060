"""The spheres as the kernels want them: heights not below the radii, damping of those cut by the wall, lone spheres."""

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.values import Configuration, Setting
from mpad_rpb.lone import ambient_velocities


@frozen(kw_only=True, eq=False)
class Spheres:
    r"""Spheres above the wall, those cut by it raised until they touch it, and damped.

    With c_i = min(h_i/a_i, 1), the mobility is  M_ii = c_i M⁺_ii,  M_ij = c_i c_j M⁺_ij  (i ≠ j), where M⁺ is the
    mobility with heights max(h, a). That is C M⁺ C + C(1 - C) blockdiag(M⁺_ii): positive semidefinite plus a block
    diagonal that is definite wherever a sphere is cut, so spheres cut by the wall keep the matrix definite even where
    raising puts two in one place. The damping factor h/a is that of Balboa Usabiaga, Delmotte and Donev, J. Chem. Phys.
    146 (2017) 134104, there with M_ii = c_i² M⁺_ii: continuous at contact, zero as the centre reaches the wall.
    """

    centres: Array  # (N, 3), raised
    radii: Array  # (N,)
    gaps: Array  # (N,), as given
    damping: Array | None  # (N,), c; None where no sphere is cut
    ambient: Array  # (N, 6), the ambient flow's velocity and rotation at the centres as given
    setting: Setting
    exact: bool
    configuration: Configuration  # as given

    @classmethod
    def of(cls, configuration: Configuration, setting: Setting, exact: bool) -> "Spheres":
        """Raise and damp what the wall cuts."""
        centres, radii = configuration.centres, configuration.radii
        damping = None
        ambient = ambient_velocities(centres, setting.shear_rate)
        if setting.wall and (centres[:, 2] < radii).any():
            if not exact:  # else only rounding has put the height below the radius
                damping = np.minimum(centres[:, 2] / radii, 1.0)
            centres = centres.copy()
            centres[:, 2] = np.maximum(centres[:, 2], radii)
        return cls(
            centres=centres,
            radii=radii,
            gaps=configuration.wall_gaps,
            damping=damping,
            ambient=ambient,
            setting=setting,
            exact=exact,
            configuration=configuration,
        )

    def closest(self) -> str:
        """Name the two spheres whose centres are nearest to each other, for a message."""
        apart = np.linalg.norm(self.centres[:, None] - self.centres[None], axis=2)
        np.fill_diagonal(apart, np.inf)
        i, j = (int(k) for k in np.unravel_index(np.argmin(apart), apart.shape))
        return f"the nearest centres are those of spheres {i} and {j}, {apart[i, j]:.3g} µm apart"
