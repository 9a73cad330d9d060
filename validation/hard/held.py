"""Spheres held where their constraint is nearly singular; found is what the held ones still move under its loads."""

from functools import partial
from typing import Any

import numpy as np

from hard.cases import Case, Outcome, judged
from mpad_core import velocities
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.physics import asking
from mpad_core.physics.questions import constrained_motion, unit_load

MUST = "free spheres finite; held ones, under the loads that hold them, move by less than 1e-5 of the flow; or refused"
LEFT = 1e-5
HELD_FIRM = ("elements 96", "cdl-biem 1e-3")
Posed = tuple[Any, list[int]]


def pair_and_free(gap: float) -> Posed:
    """Two held that almost touch, and a free one beside them."""
    return [[0, 0, 1.2], [2 + gap, 0, 1.2], [1, 2.2, 1.3]], [0, 1]


def walls_and_free(gap: float) -> Posed:
    """Two held at the wall, and a free one between them."""
    return [[0, 0, 1 + gap], [2.3, 0, 1.3], [4.6, 0, 1 + gap]], [0, 2]


def all_held(gap: float) -> Posed:
    """Two held, at the wall and against each other, and no other."""
    return [[0, 0, 1 + gap], [2 + gap, 0, 1 + gap]], [0, 1]


def in_one_place(apart: float) -> Posed:
    """Two held all but in one place, and a free one."""
    return [[0, 0, 1.5], [apart, 0, 1.5], [2.5, 0, 1.5]], [0, 1]


def _asked(posed: Any, chosen: MobilitySolver) -> Outcome:
    centres, held = posed()
    at, loads = Configuration(centres=centres, radii=np.ones(len(centres))), np.zeros((len(centres), 6))
    loads[:, 2] = -1.0
    asked = velocities(chosen, centres, 1.0, viscosity=1.0, shear_rate=1.0, forces=loads[:, :3], held=held)
    prepared = asking.prepare(chosen, chosen.plan(Setting(viscosity=1.0, shear_rate=1.0)), at)
    again, report = loads_that_hold(chosen, prepared, loads, np.array(held))
    motion = asking.solve(chosen, prepared, again)
    left = float(np.abs(motion.velocity[held]).max())
    faults = [] if np.isfinite(asked).all() else ["velocities are not finite"]
    if not left <= LEFT:
        faults.append(f"held spheres move by {left:.1e} under their loads")
    if not (asked[held] == 0).all():
        faults.append("held spheres have a velocity")
    return judged(faults, iterations=report.iterations, claimed=report.error, found=left)


def loads_that_hold(chosen: MobilitySolver, prepared: Any, loads: Any, held: Any) -> tuple[Any, Any]:
    """Give the loads that hold the held ones, found on their own by least squares, and the report of the block.

    The same velocities as `constrained_motion`'s are asked of them when they are put on all spheres, held ones free.
    """
    unit, m = unit_load(1.0, 1.0, 1.0), 6 * len(held)
    block = np.zeros((*loads.shape, m + 1))
    block[..., :] = loads[..., None]
    block[held] = 0.0
    for i, cell in enumerate(held):
        block[cell, :, 6 * i : 6 * i + 6] = np.diag(unit)
    answer = asking.solve(chosen, prepared, block)
    columns = (answer.velocity[..., :-1] - answer.velocity[..., -1:])[held].reshape(m, m)
    constraint = np.linalg.lstsq(columns, -answer.velocity[held][..., -1].ravel(), rcond=None)[0]
    again = block[..., -1].copy()
    again[held] = constraint.reshape(-1, 6) * unit
    free = np.setdiff1d(np.arange(len(loads)), held)
    moved = constrained_motion(chosen, prepared, loads, held, unit).velocity
    assert np.allclose(moved[free], asking.solve(chosen, prepared, again).velocity[free], atol=LEFT)
    return again, answer.report


def _case(name: str, posed: Any, **more: Any) -> Case:
    return Case(name=name, must=MUST, ask=partial(_asked, posed), dear=HELD_FIRM, **more)


HELD = [
    *(_case(f"two held at a gap of {g:g} a, one free", partial(pair_and_free, g)) for g in (1e-6, 1e-9, 0.0)),
    *(_case(f"two held {g:g} a above the wall, one free between", partial(walls_and_free, g)) for g in (1e-6, 1e-9)),
    *(_case(f"all held, gaps {g:g} a", partial(all_held, g)) for g in (1e-6, 1e-9)),
    *(_case(f"two held {g:g} a from one place, one free", partial(in_one_place, g)) for g in (1e-3, 1e-9, 0.0)),
]
