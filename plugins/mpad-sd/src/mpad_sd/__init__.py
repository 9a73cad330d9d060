"""Stokesian dynamics above a wall: first moments far apart, harmonics and lubrication near; for two to thousands.

Light: what needs numba is imported in `plan`.
"""

from typing import Any, ClassVar

from attrs import field, frozen, validators

from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import AccuracyLevel, Array, Configuration, Motion, Setting, SolverTraits
from mpad_core.plugins.hookspecs import hookimpl


@frozen(kw_only=True)
class StokesianDynamics:
    """Spheres of any radii in shear above a wall, right to some per cent down to contact.

    Far pairs exchange forces, torques and stresslets with all their wall images (Durlofsky, Brady and Bossis, J. Fluid
    Mech. 180 (1987) 21; Swan and Brady, Phys. Fluids 19 (2007) 113306); near ones all moments of degree 4, and more on
    the larger of two unequal spheres; to near pairs and to each sphere at the wall is added what their exact resistance
    and loads in the ambient flow, when isolated, have beyond these moments. Work grows as N², memory as N.

    Parameters
    ----------
    tolerance
        Residual at which the iteration stops.
    reach
        In smaller radii: the gap up to which a pair counts as near. The drift from and to the wall is of the order of
        the moments left out beyond. Where cells are crowded, 4 takes less time and memory; with less, tight contacts
        beside far neighbours may make the mobility indefinite, which is refused where a whole matrix is asked for.
    strain
        Whether the ambient rate of strain acts on the spheres; without, the error in shear shows what it is worth.
    least_gap
        In smaller radii: lubrication between closer surfaces, touching ones included, is that of this gap.
    """

    name: ClassVar[str] = "sd"
    traits: ClassVar[SolverTraits] = SolverTraits(
        lubrication=True,
        levels=(
            AccuracyLevel(parameters=(("reach", 8.0),), error=2e-2),
            AccuracyLevel(parameters=(("reach", 1.5),), error=3e-2),
        ),
    )

    tolerance: float = field(default=1e-6, validator=[validators.ge(1e-12), validators.le(1e-2)])
    reach: float = field(default=8.0, validator=[validators.ge(1.0), validators.le(100.0)])
    strain: bool = True
    least_gap: float = field(default=1e-6, validator=[validators.ge(1e-8), validators.le(0.1)])

    def plan(self, setting: Setting) -> Any:
        """Import the kernels; nothing else is worth keeping for a run."""
        from mpad_sd.solving import Plan

        return Plan(
            setting=setting, tolerance=self.tolerance, strain=self.strain, least_gap=self.least_gap, reach=self.reach
        )

    def prepare(self, plan: Any, configuration: Configuration, guess: Array | None = None) -> Any:
        """Form the blocks of all spheres and near pairs, and factor lubrication.

        Raises
        ------
        RefusedError
            For a number that is not finite, a radius that is not positive, spheres that overlap each other or are cut
            by the wall, or a mobility that is not positive definite.
        """
        return plan.prepared(configuration, guess)

    def solve(self, prepared: Any, loads: Array) -> Motion:
        """Give the velocities under loads (N, 6) or (N, 6, k).

        Raises
        ------
        RefusedError
            For loads that are not finite, or if the iteration does not converge.
        """
        motion: Motion = prepared.solve(loads)
        return motion

    def root(self, prepared: Any, noise: Array) -> Array:
        """Multiply noise (N, 6) or (N, 6, k) with a root of the mobility: Cholesky's for few spheres, else Lanczos.

        Raises
        ------
        RefusedError
            If an iteration does not converge.
        """
        root: Array = prepared.root(noise)
        return root

    def drift(self, prepared: Any, noise: Array | None = None) -> Array:
        """Give the divergence of the mobility (N, 6): by central differences, or by a random one of noise (N, 3)."""
        drift: Array = prepared.drift(noise)
        return drift


@hookimpl
def mpad_mobility_solvers() -> list[type[MobilitySolver]]:
    """Give the solver."""
    return [StokesianDynamics]
