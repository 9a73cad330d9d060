"""Scenes that reproduce a failure: from the place at which a solver was asked to a scene file, and back."""

from typing import TYPE_CHECKING

import tomli_w

from mpad_core.interfaces.values import Configuration
from mpad_core.scene.compose import compose
from mpad_core.scene.spec import Scene
from mpad_core.testing.asking import Place

if TYPE_CHECKING:
    from mpad_core.testing.suite.cases import Case

_HEAD = """\
# {law}
# {says}
# Spheres as the law's smallest example has them; its loads are not part of a scene.
# mpad validate --at <this file> asks all laws of this solver here.
"""


def scene_text(case: "Case", place: Place, law: str, says: str) -> str:
    """Write a scene whose solver, fluid, wall, flow and cells are those at which a law has failed.

    Parameters
    ----------
    case, place
        The solver, and where it was asked.
    law, says
        What was asked, and what was found: comments at the top.
    """
    setting, at = place.setting, place.at
    numbers = range(1, len(at.radii) + 1)
    places = zip(numbers, (at.centres + 0.0).tolist(), strict=True)
    body = {
        "solver": {"name": case.name, **case.parameters},
        "stop": {"time": "1 ms"},
        "fluid": {"viscosity": f"{setting.viscosity!r} pN s/um^2"},
        **({"flow": {"kind": "shear", "rate": f"{setting.shear_rate!r} 1/s"}} if setting.shear_rate > 0 else {}),
        **({"wall": {}} if setting.wall else {}),
        "kinds": {f"size-{i}": {"radius": f"{a!r} um"} for i, a in zip(numbers, at.radii.tolist(), strict=True)},
        "cells": {
            f"sphere-{i}": {"kind": f"size-{i}", "x": f"{x!r} um", "y": f"{y!r} um", "height": f"{z!r} um"}
            for i, (x, y, z) in places
        },
    }
    head = _HEAD.format(law=" ".join(law.split()), says=" ".join(says.split()))
    return head + tomli_w.dumps(body)


def place_of(scene: Scene) -> Place:
    """Give the fluid and the cells of a scene as a place to ask a solver at."""
    problem = compose(scene)
    return Place(setting=problem.setting, at=Configuration(centres=problem.start, radii=problem.radii))
