"""CDL-BIEM on elements: the plan of a run, and what is ready to solve at one configuration."""

import math

import numpy as np
from attrs import evolve, field, frozen, validators

from mpad_cdlbiem.elements.flow import Moving
from mpad_cdlbiem.elements.friction import Friction
from mpad_cdlbiem.elements.iteration import ITERATIONS
from mpad_cdlbiem.elements.memory import refuse_many
from mpad_cdlbiem.elements.mesh import mesh_of
from mpad_cdlbiem.elements.resolved import refuse_unresolved
from mpad_cdlbiem.elements.solution import Iterating, Solution, solution
from mpad_cdlbiem.refusing import refuse_bad, refuse_loads
from mpad_core.arrays import Array
from mpad_core.interfaces.values import Configuration, Motion, Report, Setting
from mpad_core.numerics.fluctuations import dense_root, divergence, room_to_move

INNER = 4  # Gauss points each way on an element seen from other surfaces
SHARE = 0.5  # of the difference from half as fine a mesh that is left as error
LEAST = 1e-9  # error that rounding and the exact functions may leave where elements cancel


@frozen(kw_only=True)
class ElementsPlan:
    """Completed double layer boundary integral equations by constant elements, collocated at their centroids.

    Kim and Karrila, Microhydrodynamics (1991), ch. 14 to 17; King and Hammer, PNAS 98 (2001) 14919, with 96 elements a
    sphere. One sphere at the wall, and two near each other in unbounded fluid, are exact. For two free spheres in shear
    at the wall, radii 1 to 0.3, gaps 1e-3 to 1, the error of 96 elements is 4e-3 in the median and 1e-2 in 95 % of
    cases, 2e-2 at most; of 24 elements 1.5e-2, 3e-2 and 6e-2; of 294 below 5e-3. One sphere a tenth of the other's
    size: up to 3e-2. The reported error is half the difference from half as fine a mesh: not below a third of the truth
    in 99 % of 890 cases under flow and loads (two to four spheres), 1.3 times the truth in the median.

    Parameters
    ----------
    setting
        Viscosity, shear rate, wall or none.
    elements
        Elements on each sphere, 6 k² with k at least 2.
    iteration
        ``"gmres"``; ``"picard"``, which converges slowly near contact; or ``"direct"``, by elimination.
    lubrication
        Whether what elements miss near contact is added (see `lubrication`). Without it, velocities are wrong by their
        own size for gaps below some 0.05 radii.
    tolerance
        On the residual of each right-hand side, relative; of iterations.
    """

    setting: Setting
    elements: int = 96
    iteration: str = field(default="gmres", validator=validators.in_(tuple(ITERATIONS)))
    lubrication: bool = True
    tolerance: float = 1e-10

    def prepared(self, configuration: Configuration, guess: Array | None = None) -> "Prepared":
        """Solve for the resistance of the spheres where they are.

        Parameters
        ----------
        configuration
            Centres, radii, and gaps to the wall.
        guess
            `Motion.guess` of a solve nearby; of another shape, it is not used.

        Raises
        ------
        RefusedError
            For numbers that are not finite, spheres that touch, more than fit in memory, some too small for the
            elements beside them, an iteration that fails.
        """
        refuse_bad(configuration, self.setting)
        refuse_many(len(configuration.radii), self.elements)
        refuse_unresolved(configuration, self.elements, self.setting.wall)
        side = math.isqrt(self.elements // 6)
        iterating = Iterating(name=self.iteration, tolerance=self.tolerance, guess=guess)
        fine = self._fine(configuration, iterating)
        other = self._coarse(side, configuration).lubricated if self.lubrication else fine.lubricated
        return Prepared(
            plan=self,
            configuration=configuration,
            solution=fine,
            friction=self._chosen(fine),
            other=other,
            share=SHARE if self.lubrication else 1.0,
        )

    def _fine(self, configuration: Configuration, iterating: Iterating) -> Solution:
        return solution(mesh_of(math.isqrt(self.elements // 6), INNER), configuration, self.setting, iterating)

    def _chosen(self, fine: Solution) -> Friction:
        return fine.lubricated if self.lubrication else fine.raw

    def friction(self, configuration: Configuration) -> Friction:
        """Give the resistance alone, without the means to tell its error."""
        return self._chosen(self._fine(configuration, Iterating(name=self.iteration, tolerance=self.tolerance)))

    def _coarse(self, side: int, configuration: Configuration) -> Solution:
        mesh = mesh_of((side + 1) // 2, INNER)
        return solution(mesh, configuration, self.setting, Iterating(name="direct", tolerance=self.tolerance))


@frozen(kw_only=True, eq=False)
class Prepared:
    """The spheres' resistance and load, by elements and lubrication, and others by which to tell the error."""

    plan: ElementsPlan
    configuration: Configuration
    solution: Solution
    friction: Friction
    other: Friction  # by half as fine a mesh; for elements alone by the same mesh with lubrication
    share: float  # of the difference between the two that is error

    def solve(self, loads: Array) -> Motion:
        """Give the velocities under loads (N, 6) or (N, 6, k): force, torque about the centre.

        Raises
        ------
        RefusedError
            For loads that are not finite.
        """
        loads = np.ascontiguousarray(loads, dtype=np.float64)
        refuse_loads(loads)
        columns = loads.reshape(6 * len(self.configuration.radii), -1)
        velocity, solved = self.friction.velocity(columns), self.solution.solved
        error = self._error(velocity, self.other.velocity(columns))
        report = Report(error=error, iterations=solved.iterations, residual=solved.residual)
        return Motion(velocity=velocity.reshape(loads.shape), report=report, guess=solved.density)

    def flow(self, motion: Motion, points: Array) -> Array:
        """Give the fluid's velocity (n, 3) at points (n, 3); in a sphere, the sphere's own.

        Parameters
        ----------
        motion
            An answer to one right-hand side, velocities (N, 6).
        points : (n, 3)
        """
        forces, density = self.solution.moving(motion.velocity.ravel())
        return Moving(
            at=self.configuration, setting=self.plan.setting, velocity=motion.velocity, forces=forces, density=density
        ).flow(points)

    def root(self, noise: Array) -> Array:
        """Multiply noise (N, 6) or (N, 6, k) with the Cholesky factor of the mobility."""
        mobility = np.linalg.inv(self.friction.resistance)
        return dense_root((mobility + mobility.T) / 2, noise)

    def drift(self, noise: Array | None) -> Array:
        """Give ∇·M (N, 6), by differences over all coordinates or by one random difference."""
        still = evolve(self.plan, setting=evolve(self.plan.setting, shear_rate=0.0))
        at = self.configuration

        def product_at(shift: Array, loads: Array) -> Array:
            return still.friction(at.moved(shift)).velocity(loads.reshape(-1, 1)).reshape(-1, 6)

        gaps = at.wall_gaps if still.setting.wall else None
        return divergence(product_at, room_to_move(at.centres, at.radii, gaps), noise)

    def spectral_radius(self) -> float:
        """Give the largest |eigenvalue| of the deflated operator, which is how fast Picard's iteration converges."""
        operator = self.solution.system.operator
        return float(np.abs(np.linalg.eigvals(operator - np.eye(len(operator)))).max())

    def _error(self, velocity: Array, other: Array) -> float:
        """Estimate the relative error of (U, aΩ), the largest over the right-hand sides."""
        radii = self.configuration.radii
        weighed = np.column_stack([np.ones_like(radii), radii]).repeat(3, axis=1).reshape(-1, 1)
        whole = np.linalg.norm(weighed * other, axis=0)
        apart = np.linalg.norm(weighed * (velocity - other), axis=0)
        share = float((apart / np.where(whole > 0, whole, 1.0)).max(initial=0.0))
        return self.share * share + self.solution.solved.residual + LEAST
