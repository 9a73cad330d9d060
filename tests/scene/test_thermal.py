"""When thermal motion is on, why, and what the problem then says."""

import pytest

from mpad_core.scene.compose import compose
from mpad_core.scene.files import parse_scene
from mpad_core.scene.plan import plan_lines
from mpad_core.units import thermal_energy

FLOW = 'flow = {{ kind = "shear", rate = "{rate} 1/s" }}\n'


def thermal(text: str) -> tuple[bool, str, float]:
    problem = compose(parse_scene(text))
    effect = next(effect for effect in problem.effects if effect.name == "thermal")
    return effect.on, effect.why, problem.thermal_energy


def test_without_flow_heat_moves_cells(small: str) -> None:
    on, why, energy = thermal(small)
    assert (on, why) == (True, "no flow to outdo it")
    assert energy == pytest.approx(1.380649e-23 * 298 * 1e18, rel=1e-12)


@pytest.mark.parametrize(("rate", "expected"), [(80.0, False), (1.75, False), (1.73, True), (0.01, True)])
def test_the_peclet_number_decides(small: str, rate: float, expected: bool) -> None:
    """6π 1e-3 · 125 γ/kT is 1000 at γ = 1.746 1/s for beads of 5 µm."""
    on, why, energy = thermal(FLOW.format(rate=rate) + small)
    assert on == expected
    assert energy == (thermal_energy(298.0) if expected else 0.0)
    assert why.startswith("Peclet number 6 pi mu a^3 gamma / kT = ")
    assert ("`spread`" in why) != expected


def test_the_smallest_cell_counts(small: str) -> None:
    tiny = '[kinds.dust]\nradius = "0.5 um"\n[cells.b]\nkind = "dust"\nx = "20 um"\nheight = "0 um"\n'
    assert not thermal(FLOW.format(rate=10) + small)[0]
    assert thermal(FLOW.format(rate=10) + small + tiny)[0]


@pytest.mark.parametrize(("switch", "rate", "expected"), [("on", 80.0, True), ("off", 0.01, False)])
def test_the_scene_has_the_last_word(small: str, switch: str, rate: float, expected: bool) -> None:
    on, why, energy = thermal(FLOW.format(rate=rate) + small + f'[effects]\nthermal = "{switch}"\n')
    assert on == expected == (energy > 0)
    assert why == f'switched "{switch}" by the scene'


def test_the_energy_follows_the_temperature(small: str) -> None:
    warm = small.replace('viscosity = "1 mPa s"', 'viscosity = "1 mPa s", temperature = "310 K"')
    assert thermal(warm)[2] == pytest.approx(thermal(small)[2] * 310 / 298, rel=1e-12)


def test_what_many_cells_leave_out_is_said(small: str) -> None:
    crowd = """\
[groups.crowd]
kind = "bead"
number = 9
x = ["20 um", "200 um"]
y = ["0 um", "200 um"]
height = "0 um"
"""
    lines = list(plan_lines(parse_scene((small + crowd).replace('"isolated"', '"rpb"'))))
    assert any(line.strip().startswith("thermal") and "independently" in line for line in lines)
    alone = list(plan_lines(parse_scene(small + crowd)))
    assert not any("independently" in line for line in alone)
