"""Isolated cells: each moves as if it were alone, exactly.

Light: what needs numba is imported in `plan`.
"""

from typing import Any, ClassVar

from attrs import frozen

from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import AccuracyLevel, Array, Configuration, Motion, Setting, SolverTraits
from mpad_core.plugins.hookspecs import hookimpl


@frozen(kw_only=True)
class Isolated:
    """Each sphere with its exact mobility above the wall (unbounded: Stokes), and no coupling between spheres.

    Exact for one sphere at any gap; for more, wrong by what they do to each other, of the order of a/r.
    """

    name: ClassVar[str] = "isolated"
    traits: ClassVar[SolverTraits] = SolverTraits(coupling=False, levels=(AccuracyLevel(parameters=(), error=1.0),))

    def plan(self, setting: Setting) -> Any:
        """Import the kernels; nothing else is worth keeping for a run."""
        from mpad_isolated.alone import Plan

        return Plan(setting=setting)

    def prepare(self, plan: Any, configuration: Configuration, guess: Array | None = None) -> Any:
        """Look up each sphere's mobility and its load in the flow; there is nothing to start from a guess.

        Raises
        ------
        RefusedError
            For a number that is not finite, a radius that is not positive, and a sphere that touches the wall.
        """
        return plan.prepared(configuration)

    def solve(self, prepared: Any, loads: Array) -> Motion:
        """Give the velocities under loads (N, 6) or (N, 6, k).

        Raises
        ------
        RefusedError
            For loads that are not finite.
        """
        motion: Motion = prepared.solve(loads)
        return motion

    def root(self, prepared: Any, noise: Array) -> Array:
        """Multiply noise (N, 6) or (N, 6, k) with the Cholesky factors of the spheres' mobilities."""
        root: Array = prepared.root(noise)
        return root

    def drift(self, prepared: Any, noise: Array | None = None) -> Array:
        """Give the divergence of the mobility (N, 6), exactly, whatever the noise."""
        drift: Array = prepared.drift()
        return drift


@hookimpl
def mpad_mobility_solvers() -> list[type[MobilitySolver]]:
    """Give the solver."""
    return [Isolated]
