"""Warnings: every rule fires where it should, and is silent where it should be."""

import math
import re
from pathlib import Path
from typing import Any

import pytest

from mpad_core.scene.compose import compose
from mpad_core.scene.estimates import Estimates
from mpad_core.scene.files import load_scene, parse_scene
from mpad_core.scene.plan import plan_lines
from mpad_core.scene.spec import Scene
from mpad_core.scene.warnings import _RULES, warnings_of
from mpad_core.units import thermal_energy

EXAMPLES = Path(__file__).parents[2] / "examples"
SITES = 'sites = { slex = { density = "90 1/um^2" } }'
BOND = """
[bonds.tether]
between = ["slex", "selectin"]
model = { name = "bell", off_rate = "2 1/s", reactive_compliance = "0.4 angstrom" }
on_rate = { value = "84 1/s", at_density = "180 1/um^2" }
length = "30 nm"
stiffness = "100 pN/nm"
"""
REPULSION = '[repulsion]\nstrength = "500 pN um"\ndecay = "565 1/um"'


def scene(
    cells: list[dict[str, Any]], *, solver: str = "sd", shear: float = 80.0, wall: bool = True, weight: bool = False,
    excess: float = 0.0, bond: bool = False, contact: bool = False, roughness: float = 0.0, time: float = 1.0,
    radius: float = 5.0, **effects: str,
) -> Scene:  # fmt: skip
    """Write a scene of beads; cells are x, y, height (µm) and more keys in TOML."""
    lines = [
        f'solver = "{solver}"\nstop = {{ time = "{time} s" }}',
        '[fluid]\nviscosity = "1 mPa s"\ndensity = "1000 kg/m^3"',
        f'[flow]\nkind = "shear"\nrate = "{shear} 1/s"' if shear else "",
        '[gravity]\nacceleration = ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"]' if weight else "",
        f'[wall]\nroughness = "{roughness} nm"' if wall else "",
        'sites = { selectin = { layout = "uniform", density = "180 1/um^2" } }' if bond else "",
        f'[kinds.bead]\nradius = "{radius} um"\nroughness = "{roughness} nm"\ndensity = "{1000 + excess} kg/m^3"',
        SITES if bond else "",
    ]
    for k, cell in enumerate(cells):
        keys = "\n".join(f'{key} = "{value} um"' for key, value in cell.items() if key != "more")
        lines.append(f'[cells.c{k}]\nkind = "bead"\n{keys}\n{cell.get("more", "")}')
    lines += [BOND if bond else "", REPULSION if contact else ""]
    lines += ["[effects]", *(f'{name} = "{switch}"' for name, switch in effects.items())]
    return parse_scene("\n".join(line for line in lines if line))


def said(asked: Scene) -> dict[str, str]:
    """Give the warnings by effect; one effect has one at most."""
    found = list(warnings_of(asked, compose(asked)))
    assert len({doubt.effect for doubt in found}) == len(found)
    return {doubt.effect: doubt.text for doubt in found}


NEAR, FAR = [{"height": 6}, {"x": 15, "height": 6}], [{"height": 6}, {"x": 0, "y": 5000, "height": 6}]
ONE = [{"height": 5.3}]
TOUCHING = [{"height": 6}, {"x": 11, "height": 6}]
CASES = {  # the rule; where it fires; where it does not
    ("wall", True): ({"cells": [{"height": 5000}]}, {"cells": [{"height": 500}]}),
    ("wall", False): ({"cells": ONE, "wall": False}, {"cells": [{"height": 200}], "wall": False}),
    ("gravity", True): (
        {"cells": ONE, "weight": True, "excess": 0.001, "bond": True},
        {"cells": ONE, "weight": True, "excess": 50, "bond": True},
    ),
    ("gravity", False): ({"cells": ONE, "excess": 50, "bond": True}, {"cells": ONE, "excess": 0.001, "bond": True}),
    ("repulsion", True): (
        {"cells": [{"height": 7}], "contact": True, "roughness": 100},
        {"cells": [{"height": 5.25}], "contact": True, "roughness": 100},
    ),
    ("repulsion", False): (
        {"cells": [{"height": 5.25}], "roughness": 100},
        {"cells": [{"height": 7}], "roughness": 100},
    ),
    ("bonds", True): ({"cells": [{"height": 5.2}], "bond": True}, {"cells": [{"height": 5.029}], "bond": True}),
    ("coupling", True): ({"cells": FAR}, {"cells": NEAR}),
    ("coupling", False): ({"cells": NEAR, "solver": "isolated"}, {"cells": FAR, "solver": "isolated"}),
    ("lubrication", False): ({"cells": TOUCHING, "solver": "rpb"}, {"cells": TOUCHING, "solver": "sd"}),
    ("thermal", True): (
        {"cells": [{"height": 100}], "thermal": "on", "time": 0.01},
        {"cells": ONE, "thermal": "on", "bond": True},
    ),
    ("thermal", False): ({"cells": ONE, "bond": True}, {"cells": [{"height": 100}]}),
    ("inertia", None): ({"cells": ONE, "shear": 10_000.0}, {"cells": ONE, "shear": 1000.0}),
}


def test_every_rule_is_tested() -> None:
    assert set(CASES) == {(name, when) for name, when, _ in _RULES}


@pytest.mark.parametrize("rule", CASES, ids=str)
def test_a_rule_fires_and_does_not(rule: tuple[str, bool | None]) -> None:
    """It names a number and what to write; the scene on the other side of the limit is not warned of."""
    name, when = rule
    fires, silent = (scene(**words) for words in CASES[rule])
    text = said(fires)[name]
    assert text.startswith({True: "on, but", False: "off, but", None: "never simulated"}[when])
    assert re.search(r"\d|one cell", text)
    assert re.search(r"write |lower |leave |effects\.\w+ = ", text)
    assert name not in said(silent)


def test_one_cell_needs_no_coupling() -> None:
    assert "there is one cell" in said(scene(ONE))["coupling"]
    assert "coupling" not in said(scene(ONE, solver="isolated"))


def test_what_a_warning_says_to_write_silences_it() -> None:
    """Switching an effect as told leaves no warning of it: the rules do not send anybody round in circles."""
    for words, switch in (
        ({"cells": FAR}, {"coupling": "off"}),
        ({"cells": ONE, "bond": True}, {"thermal": "on"}),
        ({"cells": [{"height": 100}], "thermal": "on", "time": 0.01}, {"thermal": "off"}),
        ({"cells": ONE, "weight": True, "excess": 0.001, "bond": True}, {"gravity": "off"}),
        ({"cells": [{"height": 7}], "contact": True, "roughness": 100}, {"repulsion": "off"}),
    ):
        (name,) = switch
        assert name in said(scene(**words))
        assert name not in said(scene(**(words | switch)))


def test_cells_5_um_apart_need_coupling() -> None:
    """The gap is 5 µm where they are nearest: side by side, at the same height."""
    pair = [{"height": 5.3}, {"y": 15, "height": 5.3}]
    assert "within 5 um" in said(scene(pair, solver="isolated"))["coupling"]
    assert "coupling" not in said(scene(pair, solver="sd"))


def test_cells_that_meet_later_are_near() -> None:
    """A cell far upstream of a held one reaches it in the run's time, or does not."""
    apart = [{"height": 6, "more": "held = true"}, {"x": -300, "y": 11, "height": 6}]
    assert "coupling" in said(scene(apart, solver="isolated", time=2))
    assert "coupling" not in said(scene(apart, solver="isolated", time=0.01))


def test_heat_on_the_recruitment_scene() -> None:
    """About 28 nm over the approach, more than a dip of 16 nm: kT over the drag, for ten radii."""
    asked = load_scene(EXAMPLES / "recruitment.toml")
    of = Estimates(scene=asked, problem=compose(asked))
    assert of.name == "free"
    assert of.approach == pytest.approx(50 / (0.67 * 80 * 5))
    drag = 6 * math.pi * 1e-3 * 5 * 21.05  # Brenner's squeeze at a gap of 0.051 radii
    assert of.spread(of.approach) == pytest.approx(math.sqrt(2 * thermal_energy(298.0) * of.approach / drag), rel=0.01)
    assert of.spread(of.approach) == pytest.approx(0.028, rel=0.02)
    assert "27.8 nm" in said(asked)["thermal"]
    assert 'effects.thermal = "on"' in said(asked)["thermal"]


def test_the_drag_is_the_walls() -> None:
    from mpad_core.physics.coupling import lone_cell

    asked = scene([{"height": 5.255}, {"x": 50, "height": 8}], bond=True)
    problem = compose(asked)
    found = Estimates(scene=asked, problem=problem).drags
    for height, drag in zip(problem.start[:, 2], found, strict=True):
        exact = lone_cell(problem.setting, 5.0, float(height), float(height) - 5.0)[0][2, 2]
        assert drag == pytest.approx(exact, rel=0.02)


def test_inertia_at_ten_thousand() -> None:
    """Re = ρ γ a²/μ = 0.25 at 10 000 1/s; 4000 1/s is where it reaches 0.1."""
    text = said(scene(ONE, shear=10_000.0))["inertia"]
    assert "Reynolds number 0.25" in text
    assert '"4e+03 1/s"' in text


@pytest.mark.parametrize("name", ["recruitment", "capture"])
def test_examples_are_warned_of_what_is_true(name: str) -> None:
    """Pair lubrication, which `rpb` lacks where the cells come near; and heat, which the paper leaves out."""
    assert set(said(load_scene(EXAMPLES / f"{name}.toml"))) == {"lubrication", "thermal"}


def test_check_prints_them() -> None:
    lines = list(plan_lines(scene(ONE, shear=10_000.0, solver="isolated", bond=True, thermal="on")))
    at = lines.index("warnings:")
    assert [line.split()[0] for line in lines[at + 1 :]] == ["bonds", "inertia"]
    quiet = scene([{"height": 5.02}], shear=1.0, solver="isolated", bond=True)
    assert list(plan_lines(quiet))[-2:] == ["warnings:", "  none"]
