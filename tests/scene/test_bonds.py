"""Bonds in a scene: between cells, and with an encounter under slip."""

import subprocess
import sys
from typing import Any, ClassVar

import numpy as np
import pytest
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import InputError
from mpad_core.physics.encounter import ChangHammer
from mpad_core.physics.problem import Problem
from mpad_core.scene.compose import compose
from mpad_core.scene.files import parse_scene, resolved_toml

CELLS = """\
solver = "isolated"
stop = { time = "1 s" }
fluid = { viscosity = "1 mPa s" }
[kinds.white]
radius = "4 um"
sites = { psgl = { density = "30 1/um^2" }, l-selectin = { density = "20 1/um^2" } }
[kinds.bead]
radius = "5 um"
sites = { slex = { density = "90 1/um^2" } }
[cells.a]
kind = "white"
height = "9 um"
[cells.b]
kind = "bead"
x = "20 um"
height = "9 um"
"""
DOUBLET = """\
[bonds.doublet]
between = ["slex", "l-selectin"]
model = { name = "bell", off_rate = "7 1/s", reactive_compliance = "0.24 angstrom" }
on_rate = { value = "3 1/s" }
length = "30 nm"
stiffness = "100 pN/nm"
"""
TETHER = (
    DOUBLET.replace("doublet", "tether")
    .replace("l-selectin", "p")
    .replace('"3 1/s"', '"84 1/s", at_density = "180 1/um^2"')
)
WALL = '[wall]\nsites = { p = { layout = "uniform", density = "180 1/um^2" } }\n'
SLIP = '[bonds.doublet.encounter]\nradius = "1 nm"\ndiffusivity = "0.05 um^2/s"\nreaction_rate = "1e6 1/s"\n'


def refused(text: str) -> tuple[str, ...]:
    with pytest.raises(InputError) as caught:
        parse_scene(text, "s.toml")
    return tuple(line.partition(": ")[2] for line in caught.value.lines)


def composed(text: str) -> Problem:
    return compose(parse_scene(text))


def test_cells_bind_each_other_without_a_wall() -> None:
    problem = composed(CELLS + DOUBLET)
    assert problem.site_kinds == ("slex", "l-selectin")
    assert problem.site_densities.tolist() == [[0, 20], [90, 0]]
    (species,) = problem.species
    assert (species.site_kind, species.partner_kind, species.reach, species.on_rate) == (0, 1, "pairs", 3.0)
    assert species.surface.densest() == 0
    assert species.surface.density(np.zeros(3), np.zeros(3)).tolist() == [0, 0, 0]
    (why,) = (effect.why for effect in problem.effects if effect.name == "bonds")
    assert why == "doublet between cells; a, b can bind"


def test_both_sorts_in_one_scene() -> None:
    problem = composed(CELLS + WALL + DOUBLET + TETHER)
    assert [(s.site_kind, s.partner_kind, s.reach) for s in problem.species] == [(0, 1, "pairs"), (0, -1, "overlap")]
    assert problem.site_kinds == ("slex", "l-selectin")
    assert problem.species[1].surface.densest() == 180


def test_only_bonds_with_the_wall_tell_where_overlap_is_zero() -> None:
    text = CELLS.replace('x = "20 um"\nheight = "9 um"', 'x = "20 um"\noverlap = "1 um"')
    assert refused(text + WALL + DOUBLET)[0].startswith("cells.b.overlap: needs a bond that cells of kind 'bead' can")
    assert parse_scene(text + WALL + DOUBLET + TETHER).height_of("b") == pytest.approx(6.03)


def test_scenes_of_both_sorts_read_the_same_when_resolved() -> None:
    scene = parse_scene(CELLS + WALL + DOUBLET + SLIP + TETHER)
    assert parse_scene(resolved_toml(scene)) == scene


FAULTS = [
    (DOUBLET + 'reach = "overlap"\n', "bonds.doublet.reach: between cells molecules bind one by one"),
    (DOUBLET + 'reach = "boltzmann_gap"\n', "bonds.doublet.reach: between cells molecules bind one by one"),
    (WALL.replace("p =", "l-selectin =") + DOUBLET, "bonds.doublet.between[1]: 'l-selectin' is a site of the wall and"),
    (DOUBLET.replace("l-selectin", "l-selectn"), "bonds: bonds need a wall"),
    (WALL + DOUBLET.replace("l-selectin", "l-selectn"), "bonds.doublet.between[1]: no site of the wall 'l-selectn'"),
    (WALL + TETHER.replace(', at_density = "180 1/um^2"', ""), "bonds.tether.on_rate.at_density: missing (the wall's"),
    (DOUBLET + SLIP.replace("1 nm", "0 nm"), "bonds.doublet.encounter.radius: must be above 0"),
    (DOUBLET + SLIP.replace('radius = "1 nm"\n', ""), "bonds.doublet.encounter.radius: missing"),
]


@pytest.mark.parametrize(("more", "line"), FAULTS)
def test_faults_of_bonds(more: str, line: str) -> None:
    lines = refused(CELLS + more)
    assert any(found.startswith(line) for found in lines), lines


def test_an_encounter_is_composed() -> None:
    assert composed(CELLS + DOUBLET).species[0].encounter is None
    expected = ChangHammer(radius=1e-3, diffusivity=0.05, reaction_rate=1e6)
    assert composed(CELLS + DOUBLET + SLIP).species[0].encounter == expected


@frozen(kw_only=True)
class Slipping:
    """A bond model with an encounter of its own."""

    name: ClassVar[str] = "bell"
    rest_length: float
    off: float
    compliance: float

    def tension(self, length: Array) -> Array:
        return length - self.rest_length

    def off_rate(self, length: Array) -> Array:
        return np.full(np.shape(length), self.off)

    def breakpoints(self) -> tuple[float, ...]:
        return (self.rest_length,)

    def factor(self, slip_speed: Array) -> Array:
        return 1 / (1 + slip_speed)


def test_a_models_own_encounter_is_used_and_not_doubled(monkeypatch: Any) -> None:
    from mpad_core.plugins import registry

    load = registry.load
    monkeypatch.setattr(registry, "load", lambda kind, name: Slipping if kind == "bond" else load(kind, name))
    text = CELLS + DOUBLET.replace("off_rate", "off").replace("reactive_compliance", "compliance").replace(
        '"7 1/s"', "7"
    )
    problem = composed(text)
    assert problem.species[0].encounter is problem.species[0].model
    assert refused(text + SLIP) == (
        "bonds.doublet.encounter: bond model 'bell' has an encounter of its own; leave this one out",
    )


def test_checking_an_encounter_compiles_nothing() -> None:
    code = (
        "import sys\nfrom mpad_core.scene.compose import compose\nfrom mpad_core.scene.files import parse_scene\n"
        "assert compose(parse_scene(sys.argv[1])).species[0].encounter is not None\nassert 'numba' not in sys.modules"
    )
    text = CELLS + DOUBLET + SLIP
    done = subprocess.run([sys.executable, "-c", code, text], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
