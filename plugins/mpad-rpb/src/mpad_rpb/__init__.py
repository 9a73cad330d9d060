"""Rotne-Prager-Blake: spheres that feel each other and the wall through the flows of their forces and torques.

Light: what needs numba is imported in `plan`.
"""

from typing import Any, ClassVar

from attrs import field, frozen, validators

from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import AccuracyLevel, Array, Configuration, Motion, Setting, SolverTraits
from mpad_core.plugins.hookspecs import hookimpl

LONE_SPHERE = ("exact", "blake")


@frozen(kw_only=True)
class RotnePragerBlake:
    """Rotne-Prager mobility with the wall's images (Swan and Brady, Phys. Fluids 19 (2007) 113306), any radii.

    Positive definite for every configuration; no stresslets between spheres and no pair lubrication, so good to some
    per cent while the gaps between cells exceed a radius, and wrong by its own size for squeezing at contact.

    Parameters
    ----------
    lone_sphere
        ``"exact"``: each sphere's resistance and ambient load are corrected so that it is exact when it is alone above
        the wall, at any gap; refuses spheres that touch the wall. ``"blake"``: the bare method, which also takes
        spheres cut by the wall (their mobility falls to zero with the height of the centre).
    """

    name: ClassVar[str] = "rpb"
    traits: ClassVar[SolverTraits] = SolverTraits(
        levels=(
            # two to four cells at gaps of 0.05 radii and more, in shear, under weights and under forces: 0.36 at worst,
            # 0.17 in the median; with "blake" 0.96 and 0.29. In chains at gaps of 1e-3: 1.3, 0.33; 3.1, 0.9
            AccuracyLevel(parameters=(("lone_sphere", "exact"),), error=0.6),
            AccuracyLevel(parameters=(("lone_sphere", "blake"),), error=1.0),
        )
    )

    lone_sphere: str = field(default="exact", validator=validators.in_(LONE_SPHERE))

    def plan(self, setting: Setting) -> Any:
        """Import the kernels; nothing else is worth keeping for a run."""
        from mpad_rpb.configured import Plan

        return Plan(setting=setting, exact=self.lone_sphere == "exact" and setting.wall)

    def prepare(self, plan: Any, configuration: Configuration, guess: Array | None = None) -> Any:
        """Form the mobility matrix for few spheres, or the preconditioner for many.

        Raises
        ------
        RefusedError
            For a number that is not finite, a radius that is not positive, a centre at or below the wall, two equal
            spheres in one place; with ``lone_sphere = "exact"`` also for a sphere that touches the wall.
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
            If the mobility is not positive definite, or the iteration does not converge.
        """
        from mpad_rpb import fluctuating

        return fluctuating.root(prepared, noise)

    def drift(self, prepared: Any, noise: Array | None = None) -> Array:
        """Give the divergence of the mobility (N, 6): by central differences, or by a random one of noise (N, 3)."""
        from mpad_rpb import fluctuating

        return fluctuating.drift(prepared, noise)


@hookimpl
def mpad_mobility_solvers() -> list[type[MobilitySolver]]:
    """Give the solver."""
    return [RotnePragerBlake]
