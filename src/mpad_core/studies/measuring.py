"""What a step of a scene costs: a few outer steps taken from the start, timed."""

import time
from collections.abc import Iterator

import numpy as np
from attrs import evolve

from mpad_core.physics.coupling import Watch
from mpad_core.running.choosing import settled
from mpad_core.running.initial import initial_state
from mpad_core.running.march import configuration_of, make_ready, step
from mpad_core.scene.compose import compose
from mpad_core.scene.spec import Scene

_STEPS = 20


def cost_lines(scene: Scene) -> Iterator[str]:
    """Yield what ``mpad check --measure`` adds: the medians over some outer steps, preparations left out."""
    chosen = settled(scene)
    problem = compose(chosen)
    machine = make_ready(evolve(problem, alone_for=np.zeros(len(problem.names))))
    state = step(machine, initial_state(machine), scene.stop.time)  # the first step compiles
    whole, solves, sub_steps = [], [], []
    for _ in range(_STEPS):
        began = time.perf_counter()
        watch = Watch(state.level, state.trust)
        machine.coupler.at(configuration_of(problem, state), state.mean_loads, state.guess, watch)
        solved = time.perf_counter()
        following = step(machine, state, state.time + scene.stop.time)
        whole.append(time.perf_counter() - solved)
        solves.append(solved - began)
        sub_steps.append(following.step - state.step)
        state = following
    lasting = float(np.median(sub_steps)) * machine.pace.grain
    yield "cost:"
    if chosen is not scene:
        yield f"  solver       {chosen.solver.parameters['reason']}"
    yield f"  sub-step     {machine.pace.sub_step:.3g} s, {np.median(sub_steps):g} of them in an outer step"
    yield f"  outer step   {1e3 * np.median(whole):.3g} ms, of which coupling {1e3 * np.median(solves):.3g} ms"
    yield f"  speed        {lasting / np.median(whole):.3g} simulated seconds a second"
