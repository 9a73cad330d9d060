"""Which coupler and which drift a problem calls for, and the coupler that climbs a ladder of solvers."""

from typing import Any, Protocol

from attrs import evolve, frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.mobility import Laddered
from mpad_core.interfaces.values import Configuration
from mpad_core.physics import asking
from mpad_core.physics.coupling import (
    NOT_WATCHED,
    Coupler,
    Coupling,
    NoCoupling,
    SolverCoupling,
    Watch,
    contact_range,
    typical_speed,
)
from mpad_core.physics.levels import relative_error
from mpad_core.physics.problem import Problem

_PATIENCE = 1.5  # by which an estimate that proved too large must grow before it is doubted again
_LEAST = 1e-300  # trust in an error that is reported as infinite


@frozen(kw_only=True, eq=False)
class LadderCoupling:
    """The coupling as the lowest rung has it whose error seems to meet the request; none lower than before.

    The error reported, times the trust in it, is watched. Where it is too large the next rung is asked: if the two
    differ by more than is allowed, the run climbs; if not, the estimate was too large, and is trusted less. A rung that
    refuses is passed over; the last one's answer is taken as it is.
    """

    rungs: tuple[SolverCoupling, ...]
    trusts: tuple[float, ...]  # true errors over those reported, to begin with
    accuracy: float

    @property
    def plan(self) -> Any:
        """The plans of all rungs."""
        return tuple(rung.plan for rung in self.rungs)

    def at(
        self, configuration: Configuration, mean_loads: Array, guess: Array | None, watch: Watch = NOT_WATCHED
    ) -> Coupling:
        """Ask the rung of before, and climb if need be; another rung's guess is of no use."""
        level, trust = watch.level, watch.trust or self.trusts[watch.level]
        found = self._asked(level, configuration, mean_loads, guess)
        while level < len(self.rungs) - 1 and not self._will_do(found, trust):
            higher = self._asked(level + 1, configuration, mean_loads, None)
            if found is not None and higher is not None and self._agree(found, higher):
                trust = max(self.accuracy / (_PATIENCE * _reported(found)), _LEAST)
                break
            level, found, trust = level + 1, higher, self.trusts[level + 1]
        assert found is not None  # the last rung raises if it refuses
        return evolve(found, watch=Watch(level, trust))

    def _asked(
        self, level: int, configuration: Configuration, mean_loads: Array, guess: Array | None
    ) -> Coupling | None:
        """Give one rung's answer, or nothing if it refuses and there are others."""
        try:
            return self.rungs[level].at(configuration, mean_loads, guess)
        except RefusedError:
            if level == len(self.rungs) - 1:
                raise
        return None

    def _will_do(self, found: Coupling | None, trust: float) -> bool:
        """Tell whether there is an answer, and its error seems small enough; where no cell is free, there is none."""
        return found is not None and (found.felt is None or trust * _reported(found) <= self.accuracy)

    def _agree(self, found: Coupling, higher: Coupling) -> bool:
        assert found.felt is not None
        assert higher.felt is not None
        radii = self.rungs[0].problem.radii
        return relative_error(found.felt.velocity, higher.felt.velocity, radii) <= self.accuracy


def _reported(coupling: Coupling) -> float:
    assert coupling.felt is not None  # rungs are watched
    return coupling.felt.report.error


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
        return self.rungs[coupling.watch.level].added(coupling, configuration, step)


def drift_of(problem: Problem, coupling: Coupler) -> Drift:
    """Give the drift that a coupling misses while it is frozen."""
    if isinstance(coupling, LadderCoupling):
        return LadderDrift(rungs=tuple(drift_of(rung.problem, rung) for rung in coupling.rungs))
    if problem.thermal_energy == 0 or not isinstance(coupling, SolverCoupling):
        return NoDrift()
    from mpad_core.physics.fluctuations import CouplingDrift

    return CouplingDrift(problem=problem, coupling=coupling)
