"""From a configuration to the resistance of its spheres: equations, densities under all loads, lubrication."""

import numpy as np
from attrs import frozen

from mpad_cdlbiem.elements.friction import Friction, friction_of, velocities
from mpad_cdlbiem.elements.iteration import ITERATIONS, Solved
from mpad_cdlbiem.elements.lubrication import missing_at_wall, missing_between
from mpad_cdlbiem.elements.mesh import Mesh
from mpad_cdlbiem.elements.system import System, at_wall, unbounded
from mpad_core.arrays import Array
from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.values import Configuration, Setting


@frozen(kw_only=True)
class Iterating:
    """How to solve: the name of the iteration, its tolerance, and densities to start from, if any fit."""

    name: str
    tolerance: float
    guess: Array | None = None

    def solved(self, system: System) -> Solved:
        """Solve for all right-hand sides.

        Raises
        ------
        RefusedError
            If the iteration does not get there.
        """
        start, guess = np.zeros_like(system.right), self.guess
        if guess is not None and guess.shape == start.shape and np.isfinite(guess).all():
            start = guess
        solved = ITERATIONS[self.name](system.operator, system.right, start, self.tolerance)
        if not solved.residual <= self.tolerance:
            raise RefusedError(
                f"cdl-biem: {self.name} left a residual of {solved.residual:.1g} after {solved.iterations} iterations, "
                f"more than {self.tolerance:g}"
            )
        return solved


@frozen(kw_only=True, eq=False)
class Solution:
    """Spheres on one mesh: the densities under each load, and what they say of resistance."""

    mesh: Mesh
    radii: Array
    system: System
    solved: Solved
    raw: Friction  # by elements alone
    lubricated: Friction  # with what they miss near contact

    def moving(self, velocity: Array) -> tuple[Array, Array]:
        """Give the forces (N, 6) and densities (N, 3, n) on elements that move the spheres with `velocity` (6 N,)."""
        answers, density = velocities(self.solved.density, self.mesh, self.radii), self.solved.density
        forces = np.asarray(np.linalg.solve(answers[:, :-1], velocity - answers[:, -1]))
        count = len(self.radii)
        return forces.reshape(count, 6), (density[:, :-1] @ forces + density[:, -1]).reshape(count, 3, -1)


def solution(mesh: Mesh, at: Configuration, setting: Setting, iterating: Iterating) -> Solution:
    """Set the equations up, solve them for all loads, and add what elements miss."""
    free = unbounded(mesh, at, setting)
    system = at_wall(free, mesh, at, setting) if setting.wall else free
    solved = iterating.solved(system)
    raw = friction_of(solved.density, mesh, at.radii)
    lubricated = raw.plus(missing_between(free, mesh, at, setting))
    if setting.wall:
        lubricated = lubricated.plus(missing_at_wall(system, mesh, at, setting))
    return Solution(mesh=mesh, radii=at.radii, system=system, solved=solved, raw=raw, lubricated=lubricated)
