"""How much of a burst's time goes to bonds and to repulsion: the same short burst with and without, timed."""

import time

import numpy as np
from attrs import define, evolve, field

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import MpadError
from mpad_core.interfaces.values import Configuration
from mpad_core.physics.couplers import NoDrift
from mpad_core.physics.coupling import NOT_WATCHED, Coupling, Watch
from mpad_core.physics.state import State, no_bonds
from mpad_core.running.march import Machine, step

SUB_STEPS = 20  # in a burst that is timed
TIMES = 2  # of which the shorter one counts
_SHORTER = 0.5  # than bursts usually are, in time


@define(eq=False)
class Given:
    """A coupler that gives what it was given."""

    coupling: Coupling
    plan: None = None

    def at(
        self, configuration: Configuration, mean_loads: Array, guess: Array | None, watch: Watch = NOT_WATCHED
    ) -> Coupling:
        """Give it."""
        return self.coupling


@define(eq=False)
class Ablation:
    """Times short bursts; an effect is taken out by data that never comes into play, so that no code changes.

    Without molecules nothing binds; a repulsion that ends far inside the wall is never reached.
    """

    machine: Machine
    without: dict[str, Machine]
    seconds: dict[str, list[float]] = field(factory=dict)  # of each burst: with everything, "", and without an effect
    spent: float = 0.0

    @classmethod
    def of(cls, machine: Machine) -> "Ablation":
        """Make machines that lack one effect each, as far as there are such."""
        fixed, problem, without = machine.fixed, machine.problem, {}
        if problem.species:
            own = fixed.molecules
            none = own._replace(arm=own.arm[:0].copy(), first=np.zeros_like(own.first), kind=own.kind[:0].copy())
            without["bonds"] = evolve(machine, fixed=evolve(fixed, molecules=none))
        if problem.contact is not None:
            without["repulsion"] = evolve(machine, fixed=evolve(fixed, contact_reach=-1e300))
        return cls(machine=machine, without=without)

    def expected(self, burst: float) -> float:
        """Give about how long (s) `time` takes, where a burst takes so long (s)."""
        return _SHORTER * burst * TIMES * (1 + len(self.without))

    def time(self, state: State, coupling: Coupling) -> None:
        """Time a few sub-steps from a state, with everything and without each effect."""
        if not self.without:
            return
        began = time.perf_counter()
        found = {"": self._shortest(self.machine, state, coupling)}
        for name, machine in self.without.items():
            start = evolve(state, bonds=no_bonds()) if name == "bonds" else state
            found[name] = self._shortest(machine, start, coupling)
        if all(np.isfinite(list(found.values()))):
            for name, seconds in found.items():
                self.seconds.setdefault(name, []).append(seconds)
        self.spent += time.perf_counter() - began

    def _shortest(self, machine: Machine, state: State, coupling: Coupling) -> float:
        """Give the shortest time (s) of some equal bursts; NaN if the numerics refuse one."""
        still = evolve(machine, coupler=Given(coupling), drift=NoDrift())
        until, shortest = state.time + SUB_STEPS * machine.pace.sub_step, np.inf
        try:
            for _ in range(TIMES):
                began = time.perf_counter()
                step(still, state, until)
                shortest = min(shortest, time.perf_counter() - began)
        except MpadError:
            return float("nan")
        return shortest

    def shares(self) -> dict[str, float | None]:
        """Give each effect's share of a burst's time; None where none was timed."""
        whole = sum(self.seconds.get("", []))
        return {name: max(1 - sum(self.seconds[name]) / whole, 0.0) if whole > 0 else None for name in self.without}
