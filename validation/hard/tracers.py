"""Tracers on, just off and inside a sphere's surface; found is how far the fluid's velocity is from the surface's."""

from functools import partial
from typing import Any

import numpy as np

from hard.asking import FINEST, SHORTFALL, free_motion, level_of
from hard.cases import Case, Outcome, judged
from mpad_core import fluid_velocities, velocities
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration

PAIR = [[0, 0, 1.5], [2.5, 0, 1.6]]
CLOSE = [[0, 0, 1.01], [2.01, 0, 1.01]]
LONE = [[0, 0, 1.3]]
ON = "the surface's own velocity U + Omega x r, to rounding; a solver without flow is refused by name"
OFF = "the surface's velocity within the error that is claimed; a solver without flow is refused by name"


def directions(number: int) -> Any:
    """Spread points over the unit sphere."""
    k = np.arange(number) + 0.5
    z, angle = 1 - 2 * k / number, np.pi * (1 + 5**0.5) * k
    return np.column_stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z])


def _slip(centres: Any, away: float, chosen: MobilitySolver) -> tuple[float, float]:
    """Give how far the fluid at a distance from the first sphere differs from its surface, and the claimed error."""
    at = Configuration(centres=centres, radii=np.ones(len(centres)))
    loads = np.zeros((len(centres), 3))
    loads[:, 2] = -6 * np.pi
    arms = directions(40)
    given = {"viscosity": 1.0, "shear_rate": 1.0, "forces": loads}
    flow = fluid_velocities(chosen, centres, 1.0, at.centres[0] + (1 + away) * arms, **given)
    own = velocities(chosen, centres, 1.0, **given)
    surface = own[0, :3] + np.cross(own[0, 3:], arms)
    slip = np.linalg.norm(flow - surface, axis=1).max() / np.linalg.norm(own[:, :3], axis=1).max()
    return float(slip), free_motion(chosen, at, True).report.error


def _on(centres: Any, chosen: MobilitySolver) -> Outcome:
    slip, claimed = _slip(centres, 0.0, chosen)
    return judged([] if slip < 1e-12 else [f"moves by {slip:.1e} against the surface"], claimed=claimed, found=slip)


def _off(centres: Any, chosen: MobilitySolver) -> Outcome:
    slip, claimed = _slip(centres, 1e-9, chosen)
    within = max(SHORTFALL * claimed, level_of(chosen)) + FINEST
    return judged([] if slip <= within else [f"moves by {slip:.1e} against the surface"], claimed=claimed, found=slip)


def _inside(depth: float, chosen: MobilitySolver) -> Outcome:
    fluid_velocities(chosen, PAIR, 1.0, [[0, 0, 1.5 + 1 - depth]], viscosity=1.0, shear_rate=1.0)
    return judged(["there is no fluid in a sphere, and it gave its velocity"])


def _case(name: str, must: str, ask: Any) -> Case:
    return Case(name=name, must=must, ask=ask, dear=("elements 96",))


INSIDE = "refused: no fluid there"
TRACERS = [
    _case("tracer on a surface, two at gaps of half a radius", ON, partial(_on, PAIR)),
    _case("tracer 1e-9 a off it, a lone sphere", OFF, partial(_off, LONE)),
    _case("tracer 1e-9 a off it, two at gaps of half a radius", OFF, partial(_off, PAIR)),
    _case("tracer 1e-9 a off it, two at gaps of 0.01 a", OFF, partial(_off, CLOSE)),
    _case("tracer 1e-6 a inside", INSIDE, partial(_inside, 1e-6)),
    _case("tracer at the centre", INSIDE, partial(_inside, 1.0)),
]
