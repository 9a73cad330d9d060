"""Which coupler and which drift a problem calls for, and the coupler that climbs a ladder of solvers."""

from contextlib import suppress
from typing import Any, Protocol

from attrs import evolve, frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.mobility import Laddered
from mpad_core.interfaces.values import Configuration
from mpad_core.physics import asking
from mpad_core.physics.coupling import Coupler, Coupling, NoCoupling, SolverCoupling, contact_range, typical_speed
from mpad_core.physics.problem import Problem


@frozen(kw_only=True, eq=False)
class LadderCoupling:
    """The coupling as the lowest rung has it whose error, as it reports it, meets the request; none lower than before.

    A rung that refuses is passed over, too; the last one's answer is taken as it is.
    """

    rungs: tuple[SolverCoupling, ...]
    trusts: tuple[float, ...]  # true errors over those reported
    accuracy: float

    @property
    def plan(self) -> Any:
        """The plans of all rungs."""
        return tuple(rung.plan for rung in self.rungs)

    def at(self, configuration: Configuration, mean_loads: Array, guess: Array | None, level: int = 0) -> Coupling:
        """Ask rung by rung, from `level` on; another rung's guess is of no use."""
        last = len(self.rungs) - 1
        for climbed in range(level, last):
            with suppress(RefusedError):
                found = self.rungs[climbed].at(configuration, mean_loads, guess)
                if self.trusts[climbed] * found.error <= self.accuracy:
                    return evolve(found, level=climbed)
            guess = None
        return evolve(self.rungs[last].at(configuration, mean_loads, guess), level=last)


def coupler(problem: Problem, plan: Any = None) -> Coupler:
    """Give the coupler of a problem; the solver's plan is made here, once a run, unless there is one already."""
    touching = contact_range(problem)
    if not problem.coupled:
        return NoCoupling(problem=problem, touching=touching)
    if not isinstance(problem.solver, Laddered):
        return _coupling(problem, plan, touching)
    rungs = problem.solver.rungs()
    plans = [None] * len(rungs) if plan is None else plan
    couplings = [_coupling(evolve(problem, solver=r.solver), p, touching) for r, p in zip(rungs, plans, strict=True)]
    return LadderCoupling(
        rungs=tuple(evolve(coupling, watched=True) for coupling in couplings),
        trusts=tuple(rung.trust for rung in rungs), accuracy=problem.solver.accuracy,
    )  # fmt: skip


def _coupling(problem: Problem, plan: Any, touching: float) -> SolverCoupling:
    """Give a solver's coupling; its plan is made here unless there is one."""
    if plan is None:
        with asking.blamed(f"solver {problem.solver.name!r}"):
            plan = problem.solver.plan(problem.setting)
    return SolverCoupling(problem=problem, plan=plan, speed=typical_speed(problem), touching=touching)


class Drift(Protocol):
    """Adds to a coupling what thermal motion asks of it."""

    def added(self, coupling: Coupling, configuration: Configuration, step: int) -> Coupling:
        """Give the coupling with further loads; `step` is the sub-step's number, by which draws are keyed."""
        ...


class NoDrift:
    """The null object: no thermal motion, or a coupling that does not change."""

    def added(self, coupling: Coupling, configuration: Configuration, step: int) -> Coupling:
        """Give the coupling as it is."""
        return coupling


@frozen(kw_only=True)
class LadderDrift:
    """The drift of the rung that gave the coupling."""

    rungs: tuple[Drift, ...]

    def added(self, coupling: Coupling, configuration: Configuration, step: int) -> Coupling:
        """Ask the rung."""
        return self.rungs[coupling.level].added(coupling, configuration, step)


def drift_of(problem: Problem, coupling: Coupler) -> Drift:
    """Give the drift that a coupling misses while it is frozen."""
    if isinstance(coupling, LadderCoupling):
        return LadderDrift(rungs=tuple(drift_of(rung.problem, rung) for rung in coupling.rungs))
    if problem.thermal_energy == 0 or not isinstance(coupling, SolverCoupling):
        return NoDrift()
    from mpad_core.physics.fluctuations import CouplingDrift

    return CouplingDrift(problem=problem, coupling=coupling)
