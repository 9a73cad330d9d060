"""The coupling of the cells through the fluid, frozen at the level of resistance.

For a group of cells a solver's mobility M and its free velocities V give R = M⁻¹. What is kept for a while is
C = R − blockdiag(r_i) and k = R V − f, where r_i and f are a lone cell's exact resistance and ambient load: those are
followed at the current height. Held cells are struck from R, not from M. For what lies outside a group, g is the load
that makes the frozen equation give the full solve's velocities under the present mean loads. A frozen velocity could
push a cell through the wall; a frozen load cannot.
"""

from typing import Any, NamedTuple, Protocol

import numpy as np
from attrs import evolve, frozen
from scipy.linalg import block_diag, cho_factor, cho_solve

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.errors import PartError, RefusedError
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration, Motion, Setting
from mpad_core.numerics.wall_functions import wall_resistance, wall_shear_load
from mpad_core.physics import asking
from mpad_core.physics.problem import LARGEST_GROUP, Problem
from mpad_core.physics.questions import constrained_motion, unit_load

NOT_FELT = 1e12  # radii: the wall functions are those of an unbounded fluid to the last bit at this gap
_ROOM_TO_MOVE = 1.25  # of the reach of contact
_BOND_REACH = 30.0  # unstressed lengths: as far as tables of bonds go at most
_ASYMMETRY = 0.1  # of sqrt(M_ii M_jj): coarse boundary elements reach 0.03 (near contact), and are symmetrised
_REACHES = (2.0, 1.0, 0.5, 0.25)  # radii: gaps within which cells are put into one group, where they are many


class Watch(NamedTuple):
    """Where a run is on a ladder of solvers, and by how much it trusts the error that is reported there."""

    level: int = 0
    trust: float = 0.0  # true errors over those reported; 0: as the ladder has it


NOT_WATCHED = Watch()


@frozen(kw_only=True, eq=False)
class Coupling:
    """The frozen coupling of the free cells, group by group."""

    groups: tuple[Indices, ...]  # cells of each group
    matrices: tuple[Array, ...]  # (6n, 6n) each: C
    loads: Array  # (N, 6): k + g
    guess: Array | None = None
    felt: Motion | None = None  # the motion under the mean loads, where it was asked for
    watch: Watch = NOT_WATCHED


class Coupler(Protocol):
    """Gives the coupling at a configuration."""

    @property
    def plan(self) -> Any:
        """The solver's plan, or None."""
        ...

    def at(
        self, configuration: Configuration, mean_loads: Array, guess: Array | None, watch: Watch = NOT_WATCHED
    ) -> Coupling:
        """Give the coupling there; `mean_loads` (N, 6) are those under which distant cells are felt.

        `watch` is what is kept from the coupling before, where the solver stands for several.
        """
        ...


def lone_cell(setting: Setting, radius: float, height: float, gap: float) -> tuple[Array, Array]:
    """Give a lone cell's exact resistance (6, 6) and ambient load (6,)."""
    resistance, load = np.empty((6, 6)), np.empty(6)
    felt = gap if setting.wall else gap + NOT_FELT * radius
    wall_resistance(height, felt, radius, setting.viscosity, resistance)
    wall_shear_load(height, felt, radius, setting.viscosity, setting.shear_rate, load)
    return resistance, load


def lone_velocity(setting: Setting, radius: float, height: float, gap: float) -> float:
    """Give the speed at which the flow alone carries a lone cell along the wall, exactly."""
    resistance, load = lone_cell(setting, radius, height, gap)
    return float(np.linalg.solve(resistance, load)[0])


def free_motion(
    solver: MobilitySolver, prepared: Any, setting: Setting, radii: Array, speed: float
) -> tuple[Array, Array, Array | None]:
    """Ask a solver for mobility (6n, 6n), symmetrised, and free velocities (6n,), in one block of solves; and a guess.

    Loads are such as give velocities of about `speed` (µm/s), so that taking the free velocities away again loses no
    digits.
    """
    n = len(radii)
    size = np.tile(unit_load(setting.viscosity, float(radii.max()), speed), n)
    loads = np.zeros((6 * n, 6 * n + 1))
    loads[:, :-1] = np.diag(size)
    motion = asking.solve(solver, prepared, loads.reshape(n, 6, 6 * n + 1))
    answer = motion.velocity.reshape(6 * n, 6 * n + 1)
    mobility = (answer[:, :-1] - answer[:, -1:]) / size
    size_of = np.sqrt(np.abs(np.diag(mobility)))
    if (np.abs(mobility - mobility.T) > _ASYMMETRY * np.outer(size_of, size_of)).any():
        raise PartError(f"solver {solver.name!r} gave a mobility that is not symmetric, as reciprocity demands")
    return 0.5 * (mobility + mobility.T), answer[:, -1].copy(), motion.guess


@frozen(kw_only=True, eq=False)
class NoCoupling:
    """The null object: every cell alone with the fluid, which the wall functions treat exactly."""

    problem: Problem
    touching: float  # µm, smooth gap below which cells may be in contact, and so must be solved together
    plan: Any = None

    def at(
        self, configuration: Configuration, mean_loads: Array, guess: Array | None, watch: Watch = NOT_WATCHED
    ) -> Coupling:
        """Give zero; free cells share a group only where they may touch."""
        groups = linked(configuration, np.flatnonzero(~self.problem.held), self.touching)
        matrices = tuple(np.zeros((6 * len(group), 6 * len(group))) for group in groups)
        return Coupling(groups=groups, matrices=matrices, loads=np.zeros((len(self.problem.radii), 6)))


def joined(coupling: Coupling, pairs: Indices) -> Coupling:
    """Put the groups of cells that pairs (P, 2) link into one; what couples them through the fluid stays as it is.

    However far a bond has been drawn out, its load must be solved for on both cells together.
    """
    groups, matrices = list(coupling.groups), list(coupling.matrices)
    for pair in pairs:
        of = [k for k, group in enumerate(groups) if np.isin(pair, group).any()]
        if len(of) == 2:
            groups[of[0]] = np.concatenate([groups[of[0]], groups.pop(of[1])])
            matrices[of[0]] = block_diag(matrices[of[0]], matrices.pop(of[1]))
    return evolve(coupling, groups=tuple(groups), matrices=tuple(matrices))


def linked(configuration: Configuration, cells: Indices, within: float) -> tuple[Indices, ...]:
    """Put cells into groups linked by smooth gaps of at most `within` (µm)."""
    from scipy.sparse.csgraph import connected_components

    if len(cells) < 2:
        return (cells,) if len(cells) else ()
    between = configuration.centres[cells][:, None] - configuration.centres[cells][None]
    radii = configuration.radii[cells]
    gaps = np.linalg.norm(between, axis=2) - radii[:, None] - radii[None]
    labels = connected_components(gaps <= within, directed=False)[1]
    return tuple(cells[labels == label] for label in range(labels.max() + 1))


def group_cells(configuration: Configuration, held: Any, touching: float) -> tuple[Indices, ...]:
    """Put free cells into groups: all of them where they are few, else those linked by small gaps.

    Cells nearer than `touching` (µm) share a group whatever its size, since their contact must be solved together.
    """
    free = np.flatnonzero(~np.asarray(held))
    if len(free) <= LARGEST_GROUP:
        return (free,) if len(free) else ()
    groups: tuple[Indices, ...] = ()
    for reach in (*_REACHES, 0.0):
        groups = linked(configuration, free, max(reach * float(configuration.radii.max()), touching))
        if max(len(group) for group in groups) <= LARGEST_GROUP:
            break
    return groups


@frozen(kw_only=True, eq=False)
class SolverCoupling:
    """The coupling as the scene's solver has it."""

    problem: Problem
    plan: Any
    speed: float  # µm/s, typical of the problem
    touching: float  # µm, smooth gap below which cells may be in contact
    watched: bool = False  # whether to ask for the motion under the mean loads, to see how good it is

    def at(
        self, configuration: Configuration, mean_loads: Array, guess: Array | None, watch: Watch = NOT_WATCHED
    ) -> Coupling:
        """Solve each group with the held cells; account for all that lies outside by one full solve.

        Raises
        ------
        RefusedError
            If the solver's mobility is not positive definite, or not finite.
        """
        problem = self.problem
        held = np.flatnonzero(problem.held)
        groups = group_cells(configuration, problem.held, self.touching)
        loads = np.zeros((len(problem.radii), 6))
        matrices, felt = [], None
        few = len(problem.radii) - len(held) <= LARGEST_GROUP  # then the guess is of the one group's block
        for group in groups:
            members = np.concatenate([group, held])
            if len(members) == 1 and len(groups) > 1:  # alone it is as the wall functions have it; g holds the others
                matrices.append(np.zeros((6, 6)))
                continue
            prepared = self._prepared(configuration.part(members), guess if few else None)
            mobility, free, found = self._free_motion(prepared, configuration.radii[members])
            resistance = self._inverse(mobility, members)
            guess = found if few else guess
            if self.watched and len(groups) == 1:
                felt = self._felt(prepared, mobility, free, mean_loads, members)
            own = 6 * len(group)
            for place, cell in enumerate(group):
                lone, ambient = self._lone(configuration, cell)
                o = 6 * place
                loads[cell] = resistance[o : o + 6] @ free - ambient
                resistance[o : o + 6, o : o + 6] -= lone
            matrices.append(np.ascontiguousarray(resistance[:own, :own]))
        if len(groups) > 1:
            felt = self._add_outside(configuration, groups, matrices, loads, mean_loads, guess)
            guess = felt.guess
        return Coupling(groups=groups, matrices=tuple(matrices), loads=loads, guess=guess, felt=felt)

    def _lone(self, configuration: Configuration, cell: int) -> tuple[Array, Array]:
        height = float(configuration.centres[cell, 2])
        gap = float(configuration.wall_gaps[cell])
        return lone_cell(self.problem.setting, float(configuration.radii[cell]), height, gap)

    def _prepared(self, configuration: Configuration, guess: Array | None) -> Any:
        return asking.prepare(self.problem.solver, self.plan, configuration, guess)

    def _free_motion(self, prepared: Any, radii: Array) -> tuple[Array, Array, Array | None]:
        return free_motion(self.problem.solver, prepared, self.problem.setting, radii, self.speed)

    def _inverse(self, mobility: Array, members: Indices) -> Array:
        try:
            resistance = cho_solve(cho_factor(mobility), np.eye(len(mobility)))
        except (np.linalg.LinAlgError, ValueError) as error:
            names = ", ".join(self.problem.names[i] for i in members)
            raise RefusedError(
                f"solver {self.problem.solver.name!r}: mobility of {names} is not positive definite ({error})"
            ) from error
        return np.asarray(0.5 * (resistance + resistance.T))

    def _felt(self, prepared: Any, mobility: Array, free: Array, mean_loads: Array, members: Indices) -> Motion:
        """Give the motion of members, all there are, under the mean loads, and under those that keep the held ones."""
        held = self.problem.held[members]
        rows, loads = np.repeat(held, 6), mean_loads[members]
        loads[held] = 0.0
        if held.any():
            passed = free[rows] + mobility[rows] @ loads.ravel()
            loads[held] = np.linalg.solve(mobility[np.ix_(rows, rows)], -passed).reshape(-1, 6)
        motion = asking.solve(self.problem.solver, prepared, loads)
        return evolve(motion, velocity=motion.velocity[np.argsort(members)])

    def _add_outside(
        self, configuration: Configuration, groups: tuple[Indices, ...], matrices: list[Array], loads: Array,
        mean_loads: Array, guess: Array | None,
    ) -> Motion:  # fmt: skip
        """Add g to the loads of every group; give the full solve's motion."""
        prepared = self._prepared(configuration, guess)
        held = np.flatnonzero(self.problem.held)
        unit = unit_load(self.problem.setting.viscosity, float(configuration.radii.max()), self.speed)
        motion = constrained_motion(self.problem.solver, prepared, mean_loads, held, unit)
        for group, matrix in zip(groups, matrices, strict=True):
            coupled = (matrix @ motion.velocity[group].ravel()).reshape(-1, 6)
            for place, cell in enumerate(group):
                lone, ambient = self._lone(configuration, cell)
                wanted = lone @ motion.velocity[cell] + coupled[place]
                loads[cell] = wanted - mean_loads[cell] - ambient
        return motion


def contact_reach(problem: Problem) -> float:
    """Give the smooth gap (µm) below which two cells may repel each other, or bind to each other."""
    bumps = 2 * float(problem.roughness.max())
    repelling = 0.0 if problem.contact is None else bumps + problem.contact.gaps()[1]
    binding = [bumps + _BOND_REACH * s.rest_length for s in problem.species if s.partner_kind >= 0]
    return max([repelling, *binding])


def contact_range(problem: Problem) -> float:
    """Give the smooth gap (µm) below which two cells may come to repel each other within a burst."""
    return _ROOM_TO_MOVE * contact_reach(problem)


def typical_speed(problem: Problem) -> float:
    """Give a speed (µm/s) typical of the problem: of the flow past a cell or of settling, whichever is larger."""
    radius = float(problem.radii.max())
    settling = np.linalg.norm(problem.external[:, :3], axis=1) / (6 * np.pi * problem.setting.viscosity * problem.radii)
    return float(max(abs(problem.setting.shear_rate) * radius, settling.max(), 1e-6 * radius))
