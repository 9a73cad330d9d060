"""Runs that engines come to grief with: found is the least gap on the way (µm), the growth of energy, or an error."""

import math
from typing import Any

import numpy as np
from attrs import evolve

from hard.cases import Case, Outcome, judged
from hard.laboratory import Seen, problem_of, ready, run, started
from mpad_core import velocities
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.physics.state import State

GROWTH = 1e-9  # of the largest energy: rounding, and the tables' 1e-6 of small changes
APART = "spheres never overlap; or stopped by name"
STEADY = "finite, spheres never overlap, energy does not grow"
STRONG = {"off": 0.0, "on": 2000.0, "compliance": 0.0}
INERT = {"off": 0.0, "on": 0.0, "compliance": 0.0}
BRITTLE = {"off": 1e6, "on": 0.0, "compliance": 0.0}
MEETING = [[-10.5, 0, 8], [0, 0, 7]]  # the higher one is faster and runs into the lower one
BESIDE = [[0, 0, 6], [10.6, 0, 6.3]]


def _seen(seen: Seen, faults: list[str], found: float) -> Outcome:
    if not seen.least > 0:
        faults.append(f"surfaces overlap by {-seen.least:.2e} um")
    return judged(faults, iterations=seen.steps, found=found)


def _steady(seen: Seen) -> Outcome:
    faults = [] if seen.growth <= GROWTH else [f"energy grows by {seen.growth:.1e} of itself"]
    return _seen(seen, faults, seen.growth)


def meeting(chosen: MobilitySolver, position: float = 1e-4, repulsion: bool = False) -> Outcome:
    """Drive one cell into another."""
    problem = problem_of(chosen, MEETING, shear=80.0, repulsion=repulsion, position=position)
    seen = run(ready(problem), 0.008)
    return _seen(seen, [], seen.least)


def pressed(chosen: MobilitySolver) -> Outcome:
    """Let a heavy cell fall on the wall in sub-steps of a hundred times those chosen, without repulsion."""
    problem = problem_of(chosen, [[0, 0, 5.2]], excess=5000.0, repulsion=False)
    longer = 100 * ready(problem).pace.sub_step
    seen = run(ready(problem, sub_step=longer, longest=longer), 2.0)
    return _steady(seen)


def _watched(problem: Any) -> Any:
    """Make a machine whose outer steps are short, so that energy is looked at often."""
    sub_step = ready(problem).pace.sub_step
    return ready(problem, longest=2 * sub_step)


def thrown(chosen: MobilitySolver) -> Outcome:
    """Start two cells with their rough layers in each other, and one in the wall's."""
    seen = run(_watched(problem_of(chosen, [[0, 0, 5.2], [10.25, 0, 5.3]])), 0.02)
    outcome = _steady(seen)
    pushed = seen.least > 0.2
    return outcome if pushed else evolve(outcome, verdict="fails", why="not pushed apart")


def overlapping(chosen: MobilitySolver) -> Outcome:
    """Ask for cells whose smooth spheres overlap."""
    seen = run(ready(problem_of(chosen, [[0, 0, 6], [9.9, 0, 6]])), 1e-3)
    return _seen(seen, ["cells that overlap were let run"], seen.least)


def _bound(chosen: MobilitySolver) -> Any:
    """Give a problem and a state with bonds by the hundred."""
    problem = problem_of(chosen, [[0, 0, 5.24]], shear=80.0, excess=50.0, bond=STRONG, sites=900.0)
    return problem, run(ready(problem), 0.02)


def many_bonds(chosen: MobilitySolver) -> Outcome:
    """Roll on bonds of 100 pN/nm that form and never break."""
    _, seen = _bound(chosen)
    faults = [] if len(seen.last.bonds) >= 100 else [f"{len(seen.last.bonds)} bonds only"]
    return _seen(seen, faults, seen.least)


def let_go(chosen: MobilitySolver) -> Outcome:
    """Take flow away from a cell on hundreds of bonds."""
    problem, seen = _bound(chosen)
    still = evolve(problem, setting=evolve(problem.setting, shear_rate=0.0))
    machine = _watched(_with_bonds(still, INERT, chosen))
    return _steady(run(machine, 0.02, _anew(seen.last)))


def _anew(state: State) -> State:
    """Give a state for another machine, whose steps are counted in another unit: its clock shows zero."""
    return evolve(state, step=0, zero=0, time=0.0)


def _with_bonds(problem: Any, bond: dict[str, float], chosen: MobilitySolver) -> Any:
    other = problem_of(chosen, [[0, 0, 5.24]], excess=50.0, bond=bond, sites=900.0)
    return evolve(problem, species=other.species)


def all_break(chosen: MobilitySolver) -> Outcome:
    """Let hundreds of bonds break within microseconds, all of them, each once."""
    problem, seen = _bound(chosen)
    number = len(seen.last.bonds)
    still = evolve(problem, setting=evolve(problem.setting, shear_rate=0.0))
    machine = ready(_with_bonds(still, BRITTLE, chosen))
    after = run(machine, 2e-3, _anew(seen.last))
    faults = [] if after.broken == number and len(after.last.bonds) == 0 else [f"{after.broken} of {number} broke"]
    return _seen(after, faults, float(len(after.last.bonds)))


def fast(chosen: MobilitySolver) -> Outcome:
    """Carry two cells at 10 000 1/s past each other."""
    problem = problem_of(chosen, [[-11, 2, 8], [0, 0, 6]], shear=1e4)
    seen = run(ready(problem), 3e-4)
    return _seen(seen, [], seen.least)


def settling(chosen: MobilitySolver) -> Outcome:
    """Let two cells settle side by side, without flow."""
    return _steady(run(_watched(problem_of(chosen, BESIDE, excess=200.0)), 0.1))


def long_steps(chosen: MobilitySolver) -> Outcome:
    """Run two cells into each other with a position to ten thousand times the usual error."""
    return meeting(chosen, position=1.0, repulsion=True)


def very_many(chosen: MobilitySolver, number: int = 10_000_000) -> Outcome:
    """Carry one cell for so many sub-steps; it goes where the solver's own speed takes it."""
    problem = problem_of(chosen, [[0, 0, 6.0]], shear=0.8)
    machine = ready(problem, longest=1000 * ready(problem).pace.sub_step)
    seen = run(machine, number * machine.pace.sub_step)
    faults = [] if seen.sub_steps >= number * (1 - 1e-6) else [f"{seen.sub_steps:.0f} sub-steps only"]
    own = velocities(chosen, problem.start, 5.0, viscosity=1e-3, shear_rate=0.8)[0, 0]
    along = float(own) * seen.last.time
    error = abs(float(seen.last.centres[0, 0]) / along - 1)
    drift = max(abs(float(seen.last.centres[0, 1])), abs(float(seen.last.centres[0, 2]) - 6.0))
    if not (error < 1e-6 and drift < 1e-6):
        faults.append(f"x is off by {error:.1e} of itself, y or z by {drift:.1e} um")
    return _seen(seen, faults, max(error, drift))


def started_through(chosen: MobilitySolver) -> Outcome:
    """Start a run from a problem, not a scene, whose spheres overlap."""
    problem = problem_of(chosen, [[0, 0, 6], [11, 0, 6]])
    through = evolve(problem, start=np.array([[0, 0, 6], [9.9, 0, 6.0]]))
    state = started(ready(through))
    return judged(["cells that overlap were let start"], found=math.dist(*state.centres) - 10)


LUBRICATED = ("cdl-biem 1e-3",)
RUNS = [
    Case(name="head-on in shear, no repulsion", must=APART, ask=meeting, dear=("sd", "cdl-biem 1e-2", *LUBRICATED)),
    Case(name="head-on with repulsion", must=APART, ask=lambda s: meeting(s, repulsion=True), dear=LUBRICATED),
    Case(name="head-on with repulsion, steps 100 times too long", must=APART, ask=long_steps, dear=LUBRICATED),
    Case(name="head-on, no repulsion, steps 100 times too long", must=APART,
         ask=lambda s: meeting(s, position=1.0), dear=LUBRICATED),
    Case(name="heavy cell on the wall, no repulsion, sub-steps 100 times too long", must=STEADY, ask=pressed),
    Case(name="rough layers started in each other", must=STEADY, ask=thrown, dear=LUBRICATED),
    Case(name="smooth spheres started in each other", must="refused before step one", ask=overlapping),
    Case(name="the same, not by a scene", must="refused before step one", ask=started_through),
    Case(name="bonds of 100 pN/nm by the hundred", must="finite, off the wall, at least 100 bonds", ask=many_bonds),
    Case(name="flow taken away from them", must=STEADY, ask=let_go),
    Case(name="all of them breaking at once", must="none left, finite", ask=all_break),
    Case(name="shear 10 000 1/s", must=APART, ask=fast, dear=("sd", *LUBRICATED)),
    Case(name="no shear: two settle", must=STEADY, ask=settling, dear=LUBRICATED),
    Case(name="10 000 000 sub-steps of one cell", must="nothing drifts; x by its own speed to 1e-6",
         ask=very_many, dear=("isolated", "rpb", "rpb blake", "sd", "cdl-biem 1e-2", *LUBRICATED)),
]  # fmt: skip
