"""How well `auto` chooses: random scenes, its errors on the way of its own run, its time beside that of every level.

    python benchmarks/auto_choice.py [--scenes 100] [--seed 1]

Two to four cells of radii 2 to 6 um in shear, under their weight, in random places, some held, some nearly touching;
accuracies of 0.1 to 1e-4. A scene is settled as a run settles it, and run. At places on that run, the chosen rung's
velocities are compared with `cdl-biem` at its finest level, and so are those of all levels that could have been chosen;
couplings are timed. The best choice is the cheapest level that is good enough at all these places. The same is asked of
`auto` without a run, one configuration at a time.
"""

import argparse
import time
from typing import Any

import numpy as np
from attrs import evolve

from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.values import Array
from mpad_core.physics.auto import Auto
from mpad_core.physics.couplers import coupler
from mpad_core.physics.coupling import typical_speed
from mpad_core.physics.levels import Level, Situation, answer, installed_levels, level_named, relative_error
from mpad_core.physics.problem import Problem
from mpad_core.running.choosing import settled
from mpad_core.running.initial import initial_state
from mpad_core.running.march import make_ready, march
from mpad_core.running.scouting import situation_of
from mpad_core.scene.compose import compose
from mpad_core.scene.files import parse_scene

HEAD = """\
solver = {{ name = "auto", accuracy = {accuracy!r} }}
stop = {{ time = "{time} s" }}
fluid = {{ viscosity = "1 mPa s", density = "1000 kg/m^3" }}
flow = {{ kind = "shear", rate = "{rate:.4g} 1/s" }}
gravity = {{ acceleration = ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"] }}
wall = {{ roughness = "50 nm" }}
repulsion = {{ strength = "500 pN um", decay = "565 1/um" }}
"""
CELL = """\
[kinds.k{i}]
radius = "{radius:.4g} um"
density = "1050 kg/m^3"
roughness = "50 nm"
[cells.c{i}]
kind = "k{i}"
x = "{x:.6g} um"
y = "{y:.6g} um"
height = "{z:.6g} um"
held = {held}
"""
PLACES = 4


def random_scene(rng: np.random.Generator) -> tuple[str, float]:
    """Write a scene; give also the accuracy that it asks for."""
    accuracy = float(rng.choice([0.1, 1e-2, 1e-3, 1e-4]))
    number, same = int(rng.integers(1, 5)), rng.random() < 0.6
    radii = np.full(number, 5.0) if same else rng.uniform(2.0, 6.0, number)
    centres: list[Array] = []
    while len(centres) < number:
        radius, near = radii[len(centres)], bool(centres) and rng.random() < 0.5
        height = radius * (1 + np.exp(rng.uniform(np.log(0.03), np.log(3.0))))
        if near:  # beside another one
            k, angle = int(rng.integers(len(centres))), rng.uniform(0, 2 * np.pi)
            reach = (radius + radii[k]) + min(radius, radii[k]) * np.exp(rng.uniform(np.log(0.04), 0.0))
            across = np.sqrt(max(reach**2 - (height - centres[k][2]) ** 2, 0.0))
            place = np.array([*(centres[k][:2] + across * np.array([np.cos(angle), np.sin(angle)])), height])
        else:
            place = np.array([*rng.uniform(-25, 25, 2), height])
        gaps = [np.linalg.norm(place - c) - radius - r for c, r in zip(centres, radii, strict=False)]
        if not gaps or min(gaps) > 0.03 * radii.min():
            centres.append(place)
    held = np.arange(number) == (0 if number > 1 and rng.random() < 0.3 else -1)
    text = HEAD.format(accuracy=accuracy, time=0.03, rate=rng.uniform(20, 200))
    for i, ((x, y, z), radius) in enumerate(zip(centres, radii, strict=True)):
        text += CELL.format(i=i, radius=radius, x=x, y=y, z=z, held=str(bool(held[i])).lower())
    return text, accuracy


def timed(problem: Problem, place: Situation) -> float:
    """Give the seconds of one coupling, the least of several."""
    asked = coupler(problem)
    guess, spent = asked.at(place.configuration, place.loads, None).guess, [time.perf_counter()]
    while len(spent) < 6 or spent[-1] < spent[0] + 0.05:
        asked.at(place.configuration, place.loads, guess)
        spent.append(time.perf_counter())
    return float(np.diff(spent).min())


def single_time(problem: Problem, solver: Any, place: Situation) -> float:
    """Give the seconds of one question, the least of several."""
    plan, spent = solver.plan(problem.setting), [time.perf_counter()]
    while len(spent) < 6 or spent[-1] < spent[0] + 0.05:
        solver.solve(solver.prepare(plan, place.configuration), place.loads)
        spent.append(time.perf_counter())
    return float(np.diff(spent).min())


def moved(problem: Problem, solver: Any, place: Situation) -> Array:
    """Give the velocities that a solver has."""
    return answer(solver, solver.plan(problem.setting), problem.setting, place, typical_speed(problem)).velocity


def tried(text: str, accuracy: float, levels: list[Level]) -> dict[str, Any]:
    """Settle, run, and compare."""
    scene = settled(parse_scene(text))
    problem = compose(scene)
    machine = make_ready(problem)
    seen = [(situation_of(problem, s), s.level) for s in march(machine, initial_state(machine), scene.stop.time)]
    seen = [seen[k] for k in np.unique(np.linspace(1, len(seen) - 1, PLACES).round().astype(int))]
    truths = [moved(problem, levels[-1].solver, place) for place, _ in seen]
    radii, middle = problem.radii, seen[len(seen) // 2]
    worst: dict[str, float] = {}
    for level in levels[:-1]:
        try:
            found = [moved(problem, level.solver, place) for place, _ in seen]
        except RefusedError:
            continue
        worst[level.label] = max(relative_error(u, v, radii) for u, v in zip(found, truths, strict=True))
    rungs = [level_named(label) for label in problem.solver.levels]
    own = [relative_error(moved(problem, rungs[k].solver, p), v, radii) for (p, k), v in zip(seen, truths, strict=True)]
    alone, place = Auto(accuracy=accuracy), seen[0][0]
    asked = relative_error(moved(problem, alone, place), truths[0], radii)
    good = [level for level in levels if worst.get(level.label, np.inf) <= accuracy] or [levels[-1]]
    spent = {level.label: timed(evolve(problem, solver=level.solver), middle[0]) for level in good}
    own_time = timed(evolve(problem, solver=rungs[middle[1]].solver), middle[0])
    above = evolve(problem.solver, levels=problem.solver.levels[middle[1] :], trust=(), accuracy=0.5)
    watched = timed(evolve(problem, solver=above), middle[0])
    return {
        "accuracy": accuracy, "cells": len(radii), "chose": rungs[0].label, "ended": rungs[seen[-1][1]].label,
        "best": min(spent, key=lambda label: spent[label]), "error": max(own), "asked": asked,
        "single": single_time(problem, alone, place) / min(single_time(problem, one.solver, place) for one in good),
        "slower": own_time / min(spent.values()), "watch": watched / own_time,
    }  # fmt: skip


def main() -> None:
    """Print a line for each scene, and the shares."""
    asked = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    asked.add_argument("--scenes", type=int, default=100)
    asked.add_argument("--seed", type=int, default=1)
    given = asked.parse_args()
    rng, levels, rows = np.random.default_rng(given.seed), list(installed_levels()), []
    for k in range(given.scenes):
        text, accuracy = random_scene(rng)
        rows.append(tried(text, accuracy, levels))
        row = rows[-1]
        print(
            f"{k:3d} {row['cells']} cells, {accuracy:7.0e}: error {row['error']:.1e} (single {row['asked']:.1e}), "
            f"{row['chose']} -> {row['ended']}, best {row['best']}: {row['slower']:.2f} times as slow",
            flush=True,
        )
    met = np.mean([row["error"] <= row["accuracy"] for row in rows])
    plain = np.mean([row["asked"] <= row["accuracy"] for row in rows])
    slower = np.array([row["slower"] for row in rows])
    print(f"within the accuracy asked for: {100 * met:.0f} % of runs, {100 * plain:.0f} % of single questions")
    print(f"time by that of the best choice: median {np.median(slower):.2f}, worst {slower.max():.2f}")
    single = np.array([row["single"] for row in rows])
    print(f"the same for single questions: median {np.median(single):.2f}, worst {single.max():.2f}")
    print(f"watching the error: {np.median([row['watch'] for row in rows]):.2f} times the coupling without")


if __name__ == "__main__":
    main()
