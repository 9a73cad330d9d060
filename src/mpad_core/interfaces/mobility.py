"""What a mobility solver must be."""

from typing import Any, ClassVar, Protocol, runtime_checkable

from mpad_core.interfaces.values import Array, Configuration, Motion, Rung, Setting, SolverTraits


@runtime_checkable
class MobilitySolver(Protocol):
    """Velocities of spheres in Stokes flow under given forces and torques.

    Three verbs, split where their inputs change at different rates: `plan` once a run, `prepare` once a configuration,
    `solve` once a right-hand side. A solver is a frozen attrs class; its fields are its parameters in the scene. It
    keeps nothing between calls: what `plan` and `prepare` learn is in what they return.
    """

    name: ClassVar[str]
    traits: ClassVar[SolverTraits]

    def plan(self, setting: Setting) -> Any:
        """Make ready for a run; the place to import heavy modules and to load tables."""
        ...

    def prepare(self, plan: Any, configuration: Configuration, guess: Array | None = None) -> Any:
        """Make ready for solves at one configuration.

        Parameters
        ----------
        plan
            What `plan` returned.
        configuration
            Centres, radii, and gaps to the wall.
        guess
            `Motion.guess` of an earlier solve nearby, to start from. It must not change the answer beyond the
            solver's tolerance.

        Raises
        ------
        RefusedError
            For a configuration that the solver cannot treat, naming spheres and gap.
        """
        ...

    def solve(self, prepared: Any, loads: Array) -> Motion:
        """Give the velocities of freely moving spheres under `loads` in the ambient flow of the setting.

        Parameters
        ----------
        loads : (N, 6) or (N, 6, k)
            Force (pN) and torque about the centre (pN µm) on each sphere; k right-hand sides at once.

        Returns
        -------
        Motion
            Velocities of the shape of `loads`: the motion of the load-free spheres in the ambient flow, plus the
            mobility times the loads.
        """
        ...


@runtime_checkable
class Fluctuating(Protocol):
    """A solver that can also drive thermal motion: its mobility M is that of `solve`, without the ambient flow."""

    def root(self, prepared: Any, noise: Array) -> Array:
        """Apply a root B of the mobility, B·Bᵀ = M.

        Parameters
        ----------
        noise : (N, 6) or (N, 6, k)
            Independent standard normal numbers. B does not depend on them.

        Returns
        -------
        (N, 6) or (N, 6, k)
            B·noise: velocities of covariance M, (µm/s)² and so on for M in µm/(pN s) and so on.
        """
        ...

    def drift(self, prepared: Any, noise: Array | None = None) -> Array:
        """Give the divergence of the mobility, ∇·M, row i being Σ_j ∂M_ij/∂x_j over the 3N coordinates of the centres.

        Parameters
        ----------
        noise : (N, 3), optional
            Independent numbers of mean 0 and variance 1. With them the answer may be an estimate that is right in the
            mean and costs a few solves however many the spheres; without, it is the divergence itself.

        Returns
        -------
        (N, 6)
            1/(pN s), and 1/(pN s µm) for the rotations; times kT a velocity.
        """
        ...


@runtime_checkable
class FluidVelocity(Protocol):
    """A solver that can also tell the velocity of the fluid outside the spheres."""

    def flow(self, prepared: Any, motion: Motion, points: Array) -> Array:
        """Give the fluid's velocity (n, 3) at points (n, 3)."""
        ...


@runtime_checkable
class Laddered(Protocol):
    """A solver that stands for several: a run begins on the first rung and climbs where its error asks for it."""

    accuracy: float  # the error that is asked for

    def rungs(self) -> tuple[Rung, ...]:
        """Give the solvers it stands for, from the cheapest that should do to the most exact."""
        ...
