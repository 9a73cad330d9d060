"""Keeps account of what each effect contributes to a run: its share of the velocity, and of the time.

It listens. What it works out from the states and couplings that it hears never goes back into the march, so a run has
the same bits with it and without. Steps are looked at by their number: every 128th, half as often whenever there are
more than sixty, so that those looked at are spread evenly over the run.
"""

import time
from typing import Any, cast

import attrs
import numpy as np
from attrs import define, evolve, field, frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import MpadError
from mpad_core.interfaces.values import Configuration
from mpad_core.physics.asking import one_line
from mpad_core.physics.couplers import Drift, coupler
from mpad_core.physics.coupling import NOT_WATCHED, Coupler, Coupling, Watch
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import State
from mpad_core.running.ablation import Ablation
from mpad_core.running.balance import OuterStep
from mpad_core.running.march import Machine
from mpad_core.running.shares import Shares, shares

EVERY, MOST = 128, 60  # outer steps between two that are looked at, to begin with; of these
RARER = 4  # of those looked at, how many go by until one is solved again without lubrication
TIMED_SHARE = 0.005  # of the run's time that timing bursts may take
BARE_SHARE = 0.005  # and solves without lubrication


@define(eq=False)
class Heard:
    """A coupler that is heard: how long it takes, and what it gave last."""

    coupler: Coupler
    seconds: float = 0.0
    last: tuple[Configuration, Coupling] | None = None

    @property
    def plan(self) -> Any:
        """The solver's plan, or None."""
        return self.coupler.plan

    def at(
        self, configuration: Configuration, mean_loads: Array, guess: Array | None, watch: Watch = NOT_WATCHED
    ) -> Coupling:
        """Give what the coupler gives."""
        began = time.perf_counter()
        coupling = self.coupler.at(configuration, mean_loads, guess, watch)
        self.seconds += time.perf_counter() - began
        self.last = configuration, coupling
        return coupling


@define(eq=False)
class HeardDrift:
    """A drift that is heard: how long it takes."""

    drift: Drift
    seconds: float = 0.0

    def added(self, coupling: Coupling, configuration: Configuration, step: int) -> Coupling:
        """Give what the drift gives."""
        began = time.perf_counter()
        coupling = self.drift.added(coupling, configuration, step)
        self.seconds += time.perf_counter() - began
        return coupling


@frozen(kw_only=True)
class Contribution:
    """What one effect did; None where it did nothing or cannot be told apart."""

    velocity: float | None = None  # over all free cells
    normal: float | None = None  # of the velocity normal to the wall
    time: float | None = None
    cells: tuple[tuple[float | None, float | None], ...] = ()  # the first two for each cell by itself


@frozen(kw_only=True)
class Account:
    """What came out: the effects' shares, and where the time went."""

    effects: dict[str, Contribution]
    time: dict[str, float]  # coupling, heat's drift, burst, recording: parts of one; what the account itself took
    steps: int  # outer steps heard
    looked_at: int
    fault: str = ""  # why it stopped looking


@define(eq=False)
class Accounts:
    """Listens to a march by a machine of its own, which is the one given with its coupler heard."""

    machine: Machine
    coupler: Heard
    drift: HeardDrift
    ablation: Ablation
    steps: int = 0
    every: int = field(factory=lambda: EVERY)
    samples: dict[int, Shares] = field(factory=dict)  # by the number of the outer step
    seconds: dict[str, float] = field(factory=lambda: dict.fromkeys(("coupling", "drift", "burst", "recording"), 0.0))
    spent: float = 0.0  # s, by the account itself
    unlubricated: Coupler | None = None
    fault: str = ""  # why it stopped looking
    spent_bare: float = 0.0  # s, by solves without lubrication

    @classmethod
    def of(cls, machine: Machine) -> "Accounts":
        """Begin."""
        heard, drift = Heard(machine.coupler), HeardDrift(machine.drift)
        listened = evolve(machine, coupler=heard, drift=drift)
        return cls(machine=listened, coupler=heard, drift=drift, ablation=Ablation.of(machine))

    def hear(self, before: State, after: State, marched: float, recorded: float) -> None:
        """Hear of an outer step: the seconds that it took, and those that recording it took."""
        began = time.perf_counter()
        parts = {"coupling": self.coupler.seconds, "drift": self.drift.seconds, "recording": recorded}
        parts["burst"] = marched - self.coupler.seconds - self.drift.seconds
        self.coupler.seconds = self.drift.seconds = 0.0
        if self.steps > 0:  # the first one compiles
            for name, seconds in parts.items():
                self.seconds[name] += seconds
        if self.steps % self.every == 0 and not self.fault:
            try:
                self._look(before, after)
            except Exception as error:  # an account is no reason to end a run
                self.fault = one_line(error)
        self.steps += 1
        self.spent += time.perf_counter() - began

    def _look(self, before: State, after: State) -> None:
        if self.coupler.last is None:
            return
        configuration, coupling = self.coupler.last
        step = OuterStep(problem=self.machine.problem, before=before, after=after, coupling=coupling)
        bare = self._without_lubrication(configuration, after)
        self.samples[self.steps] = shares(step, bare)
        if len(self.samples) > MOST:
            self.every *= 2
            self.samples = {number: found for number, found in self.samples.items() if number % self.every == 0}
        burst = self.seconds["burst"] / max(self.steps, 1)
        if self.ablation.spent + self.ablation.expected(burst) < TIMED_SHARE * sum(self.seconds.values()):
            self.ablation.time(after, coupling)

    def _without_lubrication(self, configuration: Configuration, state: State) -> Coupling | None:
        """Give the coupling by the same solver without lubrication, where it can leave it out; every few times."""
        problem = self.machine.problem
        expected = self.spent_bare + self.seconds["coupling"] / max(self.steps, 1)
        dear = expected > BARE_SHARE * sum(self.seconds.values())
        if dear or not _can_leave_out(problem) or len(self.samples) % RARER:
            return None
        began = time.perf_counter()
        try:
            if self.unlubricated is None:
                bare: Any = attrs.evolve(cast(Any, problem.solver), lubrication=False)
                self.unlubricated = coupler(evolve(problem, solver=bare))
            return self.unlubricated.at(configuration, state.mean_loads, None)
        except MpadError:  # bare, it may have no positive mobility
            return None
        finally:
            self.spent_bare += time.perf_counter() - began

    def closed(self) -> Account:
        """Give what came out."""
        whole = sum(self.seconds.values())
        spent = {name: seconds / whole if whole > 0 else 0.0 for name, seconds in self.seconds.items()}
        timed = self._timed(spent) if whole > 0 else {}
        effects = {
            effect.name: self._contribution(effect.name, timed.get(effect.name)) if effect.on else Contribution()
            for effect in self.machine.problem.effects
        }
        spent["accounting"] = self.spent / whole if whole > 0 else 0.0
        return Account(effects=effects, time=spent, steps=self.steps, looked_at=len(self.samples), fault=self.fault)

    def _timed(self, spent: dict[str, float]) -> dict[str, float | None]:
        """Give the shares of the time that can be told."""
        of_burst = self.ablation.shares()
        told = {name: None if share is None else share * spent["burst"] for name, share in of_burst.items()}
        return told | {"coupling": spent["coupling"], "thermal": spent["drift"]}

    def _contribution(self, name: str, timed: float | None) -> Contribution:
        found = [sample[name] for sample in self.samples.values() if name in sample]
        if not found:
            return Contribution(time=timed)
        of_all, *of_each = [(_number(row[:, 0]), _number(row[:, 1])) for row in np.stack(found, axis=1)]
        return Contribution(velocity=of_all[0], normal=of_all[1], time=timed, cells=tuple(of_each))


def _number(values: Array) -> float | None:
    """Give the median of what is known."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else None


def _can_leave_out(problem: Problem) -> bool:
    return problem.coupled and getattr(problem.solver, "lubrication", None) is True
