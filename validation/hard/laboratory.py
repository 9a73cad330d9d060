"""Runs of a few beads made from few words, and what is looked at on their way."""

import math
from collections.abc import Iterator
from typing import Any

import attrs
import numpy as np
from attrs import evolve, frozen

from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import State
from mpad_core.running.initial import initial_state
from mpad_core.running.march import Machine, make_ready, march
from mpad_core.scene.compose import compose
from mpad_core.scene.files import parse_scene

STRENGTH, DECAY = 500.0, 565.0  # pN µm, 1/µm: the contact of decision 4
LINEAR_BELOW = 1e-3  # µm: the law goes on by its tangent
RADIUS, ROUGH, WALL_ROUGH = 5.0, 0.175, 0.05  # µm
_BOND = """
[bonds.tether]
between = ["slex", "selectin"]
model = {{ name = "bell", off_rate = "{off} 1/s", reactive_compliance = "{compliance} um" }}
on_rate = {{ value = "{on} 1/s", at_density = "180 1/um^2" }}
length = "30 nm"
stiffness = "100 pN/nm"
"""


def _part(chosen: MobilitySolver) -> str:
    """Write a solver as scenes have it."""
    given = {a.name: getattr(chosen, a.name) for a in attrs.fields(type(chosen))}
    changed = {a.name: given[a.name] for a in attrs.fields(type(chosen)) if given[a.name] != a.default}
    words = [f'name = "{chosen.name}"', *(f"{k} = {v!r}".replace("'", '"') for k, v in changed.items())]
    return "{ " + ", ".join(words) + " }"


def problem_of(
    chosen: MobilitySolver, places: Any, *, shear: float = 0.0, excess: float = 0.0, repulsion: bool = True,
    bond: dict[str, float] | None = None, position: float = 1e-4, sites: float = 90.0,
) -> Problem:  # fmt: skip
    """Make a problem of beads of 5 µm at places (µm); `excess` (kg/m³) makes them heavier than water."""
    wall_sites = 'sites = { selectin = { layout = "uniform", density = "180 1/um^2" } }' if bond else ""
    lines = [
        f'solver = {_part(chosen)}\nstop = {{ time = "1 s" }}\naccuracy = {{ position = "{position!r} um" }}',
        '[fluid]\nviscosity = "1 mPa s"\ndensity = "1000 kg/m^3"',
        f'[flow]\nkind = "shear"\nrate = "{shear!r} 1/s"' if shear else "",
        '[gravity]\nacceleration = ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"]' if excess else "",
        f'[wall]\nroughness = "50 nm"\n{wall_sites}',
        f'[kinds.bead]\nradius = "5 um"\nroughness = "175 nm"\ndensity = "{1000 + excess!r} kg/m^3"',
        f'sites = {{ slex = {{ density = "{sites!r} 1/um^2" }} }}' if bond else "",
        *(
            f'[cells.c{i}]\nkind = "bead"\nx = "{x!r} um"\ny = "{y!r} um"\nheight = "{z!r} um"'
            for i, (x, y, z) in enumerate(np.asarray(places, float).tolist())
        ),
        _BOND.format(**bond) if bond else "",
        f'[repulsion]\nstrength = "{STRENGTH} pN um"\ndecay = "{DECAY} 1/um"' if repulsion else "",
        '[effects]\nthermal = "off"',
    ]
    return compose(parse_scene("\n".join(line for line in lines if line)))


@frozen(kw_only=True)
class Seen:
    """What was seen of a run."""

    steps: int
    sub_steps: float
    least: float  # µm, the least gap between smooth spheres or to the wall
    growth: float  # of the energy, relative to the largest there was
    broken: int  # bonds, on the way
    last: State


def run(machine: Machine, until: float, state: State | None = None) -> Seen:
    """March; look at every place on the way, and at the energy of every state.

    Raises
    ------
    AssertionError
        If a number is not finite, a quaternion not of length one, or a gap not the height less the radius.
    """
    problem, least, energies, steps, broken = machine.problem, math.inf, [], -1, 0
    begun = initial_state(machine) if state is None else state
    last = begun
    for last in march(machine, begun, until):
        least = min(least, _least_gap(problem, last))
        energies.append(energy(machine, last))
        _check(problem, last)
        broken += int((last.events["kind"] == 1).sum()) if steps >= 0 else 0
        steps += 1
    rises = np.diff(energies)
    growth = float(max(rises.max(initial=0.0), 0.0) / max(np.abs(energies).max(), 1e-300))
    sub_steps = (last.time - begun.time) / machine.pace.sub_step
    return Seen(steps=steps, sub_steps=sub_steps, least=least, growth=growth, broken=broken, last=last)


def started(machine: Machine) -> State:
    """Give the state at time zero."""
    return initial_state(machine)


def _places(state: State) -> Iterator[Any]:
    yield state.centres
    if state.way is not None:
        yield from state.way.centres


def _least_gap(problem: Problem, state: State) -> float:
    least = float(state.wall_gaps.min())
    i, j = np.triu_indices(len(problem.radii), 1)
    for centres in _places(state) if len(i) else ():
        apart = np.linalg.norm(centres[i] - centres[j], axis=1) - problem.radii[i] - problem.radii[j]
        least = min(least, float(apart.min()))
    return least


def _check(problem: Problem, state: State) -> None:
    numbers = (state.centres, state.wall_gaps, state.orientations, state.velocities, state.drift, state.mean_loads)
    assert all(np.isfinite(x).all() for x in numbers), "a number is not finite"
    assert np.abs(np.linalg.norm(state.orientations, axis=1) - 1).max() < 1e-12, "a quaternion is not of length one"
    apart = np.abs(state.centres[:, 2] - problem.radii - state.wall_gaps).max()
    assert apart < 1e-9, f"a gap differs from the height less the radius by {apart:.1e} um"


def energy(machine: Machine, state: State) -> float:
    """Give the energy (pN µm) of weight, contact and bonds."""
    problem = machine.problem
    total = -float((problem.external[:, :3] * state.centres).sum())
    if problem.contact is not None:
        total += sum(_contact_energy(g - ROUGH - WALL_ROUGH) for g in state.wall_gaps)
        i, j = np.triu_indices(len(problem.radii), 1)
        apart = np.linalg.norm(state.centres[i] - state.centres[j], axis=1) - problem.radii[i] - problem.radii[j]
        total += sum(_contact_energy(g - 2 * ROUGH) for g in apart)
    if len(state.bonds):
        species = problem.species[0]
        lengths, _ = machine.lengths_and_tensions(state)
        total += 0.5 * 1e5 * float((np.maximum(lengths - species.rest_length, 0.0) ** 2).sum())
    return total


def _contact_energy(tip_gap: float) -> float:
    """Give −S ln(1 − e^(−g/ℓ)), and by the tangent of the force below 1 nm."""
    if tip_gap > 40 / DECAY:
        return 0.0
    held = max(tip_gap, LINEAR_BELOW)
    deep = held - tip_gap
    force = STRENGTH * DECAY / math.expm1(DECAY * held)
    slope = STRENGTH * DECAY**2 * math.exp(DECAY * held) / math.expm1(DECAY * held) ** 2
    return -STRENGTH * math.log(-math.expm1(-DECAY * held)) + force * deep + 0.5 * slope * deep**2


def ready(problem: Problem, **pace: Any) -> Machine:
    """Make a machine, with steps other than those it would choose if they are given."""
    machine = make_ready(problem)
    return evolve(machine, pace=evolve(machine.pace, **pace)) if pace else machine
