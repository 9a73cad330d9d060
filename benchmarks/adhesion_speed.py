"""How fast cells roll in the computer: ``python benchmarks/adhesion_speed.py [WHAT …]``; all of them without WHAT.

Prints, for each case, seconds of CPU and of wall time for a simulated second. The march is made ready, compiled and
brought through its start before the clock runs. Cells are those of rolling.toml.
"""

import argparse
import resource
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from attrs import evolve, frozen

from mpad_core.arrays import Array
from mpad_core.physics.problem import Problem
from mpad_core.running.initial import at_rest
from mpad_core.running.march import make_ready, march
from mpad_core.scene.compose import compose
from mpad_core.scene.files import parse_scene

BASE = Path(__file__).with_name("rolling.toml").read_text()
HUNDRED = 'groups.cells={kind="bead",number=100,x=["0 um","886 um"],y=["0 um","886 um"],height="5.235 um"}'
BESIDE = 'cells.second={kind="bead",x="13 um",y="0 um",height="5.235 um"}'


@frozen(kw_only=True)
class Stranger:
    """Bell's bond in a stranger's plain numpy."""

    name: ClassVar[str] = "stranger"
    off: float = 2.0
    compliance: float = 4e-5
    stiffness: float = 1e5
    rest: float = 0.03
    thermal: float = 4.11e-3

    def tension(self, length: Array) -> Array:
        """Give the tension (pN)."""
        return self.stiffness * (length - self.rest)

    def off_rate(self, length: Array) -> Array:
        """Give the off-rate (1/s)."""
        return self.off * np.exp(self.compliance * np.abs(self.tension(length)) / self.thermal)

    def breakpoints(self) -> tuple[float, ...]:
        """Give the rest length."""
        return (self.rest,)


def problem_of(*overrides: str) -> Problem:
    """Give the problem of the base scene with some values replaced."""
    return compose(parse_scene(BASE, "rolling.toml", overrides))


def with_stranger() -> Problem:
    """Give the lone cell with a stranger's bonds."""
    problem = problem_of('flow.rate="100 1/s"')
    return evolve(problem, species=(evolve(problem.species[0], model=Stranger()),))


CASES: dict[str, tuple[Callable[[], Problem], float, float]] = {  # problem, s of start, s timed
    "lone-100": (lambda: problem_of('flow.rate="100 1/s"'), 1.0, 20.0),
    "lone-400": (lambda: problem_of('flow.rate="400 1/s"'), 0.5, 5.0),
    "stranger-100": (with_stranger, 1.0, 20.0),
    "two-isolated": (lambda: problem_of('flow.rate="100 1/s"', BESIDE, 'solver="isolated"'), 1.0, 10.0),
    "two-rpb": (lambda: problem_of('flow.rate="100 1/s"', BESIDE, 'solver="rpb"'), 1.0, 10.0),
    "two-cdl-biem": (
        lambda: problem_of('flow.rate="100 1/s"', BESIDE, 'solver={name="cdl-biem",accuracy=1e-3}'),
        1.0,
        10.0,
    ),
    "hundred-sd": (lambda: problem_of('flow.rate="100 1/s"', HUNDRED, 'solver="sd"'), 0.0, 10.0),
}


def timed(problem: Problem, start: float, seconds: float) -> tuple[float, float, Any]:
    """Give CPU and wall time (s) for a simulated second, and the last state."""
    machine = make_ready(problem)
    state = at_rest(machine)
    for following in march(machine, state, max(start, 1e-4)):  # compiles
        state = following
    cpu, wall, bursts = time.process_time(), time.perf_counter(), 0
    for following in march(machine, state, start + seconds):
        state, bursts = following, bursts + 1
    print(f"{bursts / seconds:8.1f} bursts/s", end=" ")
    return (time.process_time() - cpu) / seconds, (time.perf_counter() - wall) / seconds, state


def main() -> None:
    """Print a line for each case asked for."""
    asked = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    asked.add_argument("what", nargs="*", choices=[*CASES, []], help="cases; all without")
    asked.add_argument("--seconds", type=float, help="simulated seconds, instead of each case's own")
    given = asked.parse_args()
    for name in given.what or CASES:
        made, start, seconds = CASES[name]
        cpu, wall, state = timed(made(), start, given.seconds or seconds)
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        speed = state.centres[:, 0].mean() - made().start[:, 0].mean()
        mean = speed / state.time
        print(f"{name:14s} {cpu:7.3f} s CPU, {wall:7.3f} s wall a simulated second; {mean:8.2f} um/s; {memory:.2f} GB")


if __name__ == "__main__":
    main()
