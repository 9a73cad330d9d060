"""CDL-BIEM: the completed double-layer boundary integral equations for spheres above a wall; mpad's reference solver.

Light: what needs numba is imported in `plan`.
"""

from typing import Any, ClassVar

from attrs import Attribute, field, frozen, validators

from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import AccuracyLevel, Array, Configuration, Motion, Setting, SolverTraits
from mpad_core.plugins.hookspecs import hookimpl

DISCRETISATIONS = ("spectral", "elements")
ITERATIONS = ("gmres", "picard", "direct")


def _cubed(instance: object, attribute: "Attribute[int]", value: int) -> None:
    side = round((value / 6) ** 0.5)
    if value < 24 or 6 * side * side != value:
        raise ValueError(
            f"{attribute.name} must be 6 k² with k at least 2 (24, 54, 96, 150, 216, 294 ...), not {value}"
        )


@frozen(kw_only=True)
class CdlBiem:
    """Completed double-layer boundary integral equations (Kim and Karrila, Microhydrodynamics, ch. 15-17), any radii.

    Second-kind equations with the wall by images, completed by a force and a torque inside each sphere and deflated of
    rigid motions; what the discretisation does not resolve of two spheres' or a wall's near contact is added from exact
    solutions of the isolated pair. Refuses spheres that touch.

    Parameters
    ----------
    discretisation
        ``"spectral"``: vector spherical harmonics, exact Galerkin, symmetric. ``"elements"``: low-order boundary
        elements with collocation, as King and Hammer (2001) did; a per cent, and slower.
    accuracy
        Relative error of the velocities to aim at; chooses the degrees from the gaps (spectral). Where three surfaces
        meet at gaps below a twentieth of a radius some 3e-4 is the best that can be had.
    degree
        Degree of the harmonics for all spheres, instead of choosing it.
    elements
        Number on each sphere, 6 k² (elements).
    iteration
        ``"gmres"``; ``"picard"``, the fixed-point iteration that the deflated equations allow, which does not converge
        near contact; or ``"direct"``, by elimination (elements).
    lubrication
        Whether to add what is not resolved near contact; without, the bare method.
    tolerance
        Residual at which the iteration stops; for several right-hand sides at once 1e-8 at most, since they may be a
        mobility matrix, whose symmetry and weakest motions feel it.
    """

    name: ClassVar[str] = "cdl-biem"
    traits: ClassVar[SolverTraits] = SolverTraits(
        lubrication=True,
        levels=(
            # chains of two to four spheres of radii to 2:1 at the wall, gaps of 0.05 and more, in shear, under weights
            # and under forces, against 1e-5: 1.3e-2, 6e-4 and 3.4e-4 at worst; at gaps of 1e-3 1.9e-2, 2.9e-3, 2.1e-3
            AccuracyLevel(parameters=(("accuracy", 1e-2),), error=2e-2),
            AccuracyLevel(parameters=(("accuracy", 1e-3),), error=1e-3),
            AccuracyLevel(parameters=(("accuracy", 1e-4),), error=5e-4),
            AccuracyLevel(parameters=(("accuracy", 1e-6),), error=5e-5, reference=True),
        ),
    )

    discretisation: str = field(default="spectral", validator=validators.in_(DISCRETISATIONS))
    accuracy: float = field(default=1e-3, validator=[validators.ge(1e-8), validators.le(0.1)])
    degree: int | None = field(default=None, validator=validators.optional([validators.ge(2), validators.le(120)]))
    elements: int = field(default=96, validator=_cubed)
    iteration: str = field(default="gmres", validator=validators.in_(ITERATIONS))
    lubrication: bool = True
    tolerance: float = field(default=1e-6, validator=[validators.ge(1e-14), validators.le(1e-2)])

    def plan(self, setting: Setting) -> Any:
        """Import the kernels; nothing else is worth keeping for a run."""
        if self.discretisation == "elements":
            from mpad_cdlbiem.elements.plan import ElementsPlan

            return ElementsPlan(
                setting=setting,
                elements=self.elements,
                iteration=self.iteration,
                lubrication=self.lubrication,
                tolerance=min(self.tolerance, 1e-8),  # its matrix is formed from columns in any case
            )
        from mpad_cdlbiem.spectral.solving import SpectralPlan

        return SpectralPlan(
            setting=setting,
            accuracy=self.accuracy,
            degree=self.degree,
            lubrication=self.lubrication,
            tolerance=self.tolerance,
        )

    def prepare(self, plan: Any, configuration: Configuration, guess: Array | None = None) -> Any:
        """Form the blocks of all spheres and pairs.

        Raises
        ------
        RefusedError
            For a number that is not finite, a radius that is not positive, spheres that touch or overlap each other or
            the wall, or a mobility that is not positive definite.
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
        """Give the divergence of the mobility (N, 6): by central differences, or by a random one of noise (N, 3).

        The degrees are those of the configuration itself, so that no difference runs across a change of degree.
        """
        drift: Array = prepared.drift(noise)
        return drift

    def flow(self, prepared: Any, motion: Motion, points: Array) -> Array:
        """Give the fluid's velocity (n, 3) at points (n, 3) outside the spheres, for a motion under one load."""
        velocity: Array = prepared.flow(motion, points)
        return velocity


@hookimpl
def mpad_mobility_solvers() -> list[type[MobilitySolver]]:
    """Give the solver."""
    return [CdlBiem]
