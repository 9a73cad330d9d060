"""Spheres where solvers come to grief: at contact, beyond it, a hundred times larger than their neighbours."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from clusters import overlapping, pair, triple
from hard.asking import at_configuration
from hard.cases import Case
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration

CLUSTER = "finite, symmetric, definite; error of free motion in shear and under weight within the claim; or refused"
DEAR = ("elements 24", "elements 96", "cdl-biem 1e-3")
UNEQUAL: dict[str, Any] = {"dear": (*DEAR, "sd")}

Geometry = Callable[[], tuple[Any, Any]]


def _asked(geometry: Geometry, wall: bool, chosen: MobilitySolver) -> Any:
    centres, radii = geometry()
    return at_configuration(chosen, Configuration(centres=centres, radii=radii), wall)


def _case(name: str, geometry: Geometry, wall: bool = True, **more: Any) -> Case:
    return Case(name=name, must=CLUSTER, ask=partial(_asked, geometry, wall), **({"dear": DEAR} | more))


def lone(gap: float) -> tuple[Any, Any]:
    """One above the wall, its gap as exact as a height can hold it."""
    return [[0, 0, 1 + gap]], [1.0]


def free_pair(gap: float) -> tuple[Any, Any]:
    """Two, any orientation, no wall."""
    along = np.array([0.48, 0.6, 0.64])
    return [np.zeros(3), (2 + gap) * along], [1.0, 1.0]


def free_triple(gap: float) -> tuple[Any, Any]:
    """Three that touch each other, no wall."""
    s = 2 + gap
    return [[0, 0, 0], [s, 0, 0], [s / 2, 0.6 * s * np.sqrt(0.75), 0.8 * s * np.sqrt(0.75)]], [1.0] * 3


def squeezed(gap: float) -> tuple[Any, Any]:
    """One on the wall between two larger cells that bear on it and on the wall."""
    return triple(gap, 4.0)


def corner(gap: float) -> tuple[Any, Any]:
    """A hundredth of the size in the corner between a cell and the wall, gaps in radii of the small."""
    small, reach = 0.01, 1.01 + 0.01 * gap
    drop = 1 - small
    return [[0, 0, 1 + small * gap], [np.sqrt(reach**2 - drop**2), 0, small * (1 + gap)]], [1.0, small]


def unequal() -> tuple[Any, Any]:
    """Two in unbounded fluid, one a hundredth of the other, their gap 1e-6 of the small."""
    return [[0, 0, 0], [1.01 + 1e-8, 0, 0]], [1.0, 0.01]


def crossed(depth: float) -> tuple[Any, Any]:
    """Two thrown into each other."""
    return [[0, 0, 2], [2 - depth, 0, 2]], [1.0, 1.0]


def cut(height: float) -> tuple[Any, Any]:
    """One that the wall cuts, and one above it."""
    return [[0, 0, height], [0, 2.5, 2]], [1.0, 1.0]


def crowd(above: bool) -> tuple[Any, Any]:
    """A thousand that overlap, a third of them at the wall or cut by it."""
    return overlapping(np.random.default_rng(7), 1000, above)


def _gap(gap: float) -> str:
    return f"{gap:g} a" if gap else "0"


_CROWD: dict[str, Any] = {"dear": ("rpb", "rpb blake")}
CONTACT = [
    *(_case(f"one sphere {_gap(g)} above the wall", partial(lone, g)) for g in (1e-6, 1e-9)),
    *(_case(f"two at the wall, all gaps {_gap(g)}", partial(pair, g, 1.0)) for g in (1e-6, 1e-9, 0.0)),
    *(_case(f"two without a wall, gap {_gap(g)}", partial(free_pair, g), False) for g in (1e-6, 1e-9, 0.0)),
    *(_case(f"three at the wall, all gaps {_gap(g)}", partial(triple, g, 1.0)) for g in (1e-6, 1e-9, 0.0)),
    *(_case(f"three without a wall, gaps {_gap(g)}", partial(free_triple, g), False) for g in (1e-6, 0.0)),
    *(_case(f"squeezed by two cells and wall, gaps {_gap(g)}", partial(squeezed, g)) for g in (1e-3, 1e-6)),
    *(
        _case(f"radii 100:1 at the wall, gaps {_gap(g)} of the small", partial(corner, g), **UNEQUAL)
        for g in (0.1, 1e-6)
    ),
    _case(
        "radii 100:1 without a wall, gap 1e-06 a",
        lambda: ([[0, 0, 0], [1.01 + 1e-8, 0, 0]], [1.0, 0.01]),
        False,
        **UNEQUAL,
    ),
]
BEYOND = [
    _case("two overlapping by 0.1 a", partial(crossed, 0.1)),
    _case("two overlapping by 1e-06 a", partial(crossed, 1e-6)),
    _case("cut by the wall by 0.1 a", partial(cut, 0.9)),
    _case("centre below the wall", partial(cut, -0.1)),
    _case("1000 overlapping above the wall", partial(crowd, True), **_CROWD),
    _case("1000 overlapping, some cut by the wall", partial(crowd, False), **_CROWD),
]
