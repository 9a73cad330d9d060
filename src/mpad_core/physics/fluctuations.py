r"""The part of the drift kT ∇·M that a burst with a frozen coupling does not make by itself, as a load.

A burst moves a group of cells under M_b = (r(h) + C)⁻¹ with C frozen, and its scheme gives kT ∇·M_b. The solver's
mobility M of the group, held cells struck from its inverse, has another divergence, since C changes with the
configuration. The load

    k_d = kT R (∇·M − ∇·M_b),    R = M⁻¹,

makes up for it. Both divergences are estimated by the same random finite difference (see
`mpad_core.numerics.fluctuations`), so that what they have in common, the steep change of r(h) near the wall, drops out
and adds nothing to the estimate's variance: M_b is a control variate.
"""

import numpy as np
from attrs import evolve, frozen

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.values import Configuration
from mpad_core.numerics.fluctuations import divergence, room_to_move
from mpad_core.numerics.streams import Stream, key_of, mixed, uniform
from mpad_core.physics import asking
from mpad_core.physics.coupling import Coupling, SolverCoupling, lone_cell
from mpad_core.physics.molecules import identity_of
from mpad_core.physics.problem import Problem
from mpad_core.physics.questions import unit_load

_SHARE = 0.01  # of the room to move: coarser than for a bare mobility, since solvers change their degrees with the gap
_NEGLIGIBLE = 1e-9  # of the lone resistances: a coupling that is rounding
_SIGNS = 3  # names the draws of signs beside those of a cell's paths, which are 0 to 2


@frozen(kw_only=True, eq=False)
class CouplingDrift:
    """Adds k_d to the loads of a coupling."""

    problem: Problem
    coupling: SolverCoupling

    def added(self, coupling: Coupling, configuration: Configuration, step: int) -> Coupling:
        """Give the coupling at a configuration with k_d among its loads; `step` keys the random directions."""
        loads = coupling.loads.copy()
        for group, matrix in zip(coupling.groups, coupling.matrices, strict=True):
            frozen_part = self._resistance(configuration, group, np.zeros_like(matrix))
            size = np.sqrt(np.diag(frozen_part))
            if (np.abs(matrix) > _NEGLIGIBLE * np.outer(size, size)).any():
                missing = self._missing(configuration, group, matrix, self._signs(group, step))
                resistance = frozen_part + matrix
                loads[group] += self.problem.thermal_energy * (resistance @ missing.ravel()).reshape(-1, 6)
        return evolve(coupling, loads=loads)

    def _signs(self, group: Indices, step: int) -> Array:
        """Draw random signs (n, 3) by cell and step: three binary digits of one number."""
        key, stream = key_of(self.problem.seed), int(Stream.THERMAL)
        who = [np.uint64(mixed(identity_of(self.problem.names[cell]), _SIGNS)) for cell in group]
        digits = np.array([int(8 * uniform(key, stream, name, step)) for name in who])
        return np.where(digits[:, None] & [1, 2, 4], 1.0, -1.0)

    def _missing(self, configuration: Configuration, group: Indices, matrix: Array, signs: Array) -> Array:
        """Give one estimate of ∇·M − ∇·M_b (n, 6)."""
        held = np.flatnonzero(self.problem.held)
        members = np.concatenate([group, held])
        n, at = len(group), configuration.part(members)

        def product_at(shift: Array, loads: Array) -> Array:
            there = at.moved(np.concatenate([shift, np.zeros((len(held), 3))]))
            own = self._resistance(there, np.arange(n), matrix)
            return self._product(there, loads) - np.linalg.solve(own, loads.ravel()).reshape(n, 6)

        gaps = at.wall_gaps if self.problem.setting.wall else None
        return divergence(product_at, room_to_move(at.centres, at.radii, gaps)[:n], signs, share=_SHARE)

    def _resistance(self, at: Configuration, cells: Indices, matrix: Array) -> Array:
        """Give r(h) + C (6n, 6n) of some cells of a configuration."""
        total = matrix.copy()
        for place, i in enumerate(cells):
            o, height, gap = 6 * place, float(at.centres[i, 2]), float(at.wall_gaps[i])
            total[o : o + 6, o : o + 6] += lone_cell(self.problem.setting, float(at.radii[i]), height, gap)[0]
        return total

    def _product(self, at: Configuration, loads: Array) -> Array:
        """Multiply the solver's mobility of the first n spheres, all others held, with loads (n, 6)."""
        solver, plan, fluid = self.problem.solver, self.coupling.plan, self.problem.setting
        n, m = len(loads), 6 * (len(at.radii) - len(loads))
        unit = unit_load(fluid.viscosity, float(at.radii.max()), self.coupling.speed)
        scale = np.abs(loads / unit).max()
        block = np.zeros((len(at.radii), 6, m + 2))  # no load at all; the loads; unit loads on the held
        block[:n, :, 1] = loads / scale
        block[n:, :, 2:] = np.diag(np.tile(unit, m // 6)).reshape(m // 6, 6, m)
        answer = asking.solve(solver, asking.prepare(solver, plan, at), block).velocity
        columns = answer[:, :, 1:] - answer[:, :, :1]
        moved, by_held = columns[:, :, 0], columns[:, :, 1:]
        if m:
            constraint = np.linalg.solve(by_held[n:].reshape(m, m), -moved[n:].ravel())
            moved = moved + by_held @ constraint
        return np.asarray(moved[:n] * scale)
