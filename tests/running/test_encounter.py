"""On-rates by slip: what a sliding cell's clock uses up is the rate without encounter, times the factor at its slip."""

from typing import Any

import numpy as np
import pytest

from mpad_core.physics.coupling import lone_cell
from mpad_core.physics.encounter import ChangHammer
from mpad_core.physics.reactions import SLOWEST

DISC = {"radius": 1e-3, "diffusivity": 0.05, "reaction_rate": 1e5}
ENCOUNTER = """\
[bonds.tether.encounter]
radius = "1e-3 um"
diffusivity = "0.05 um^2/s"
reaction_rate = "1e5 1/s"
"""


def spent(lab: Any, shear: float, *, more: str = "", held: bool = False) -> tuple[Any, Any]:
    """March 10 ms with bonds that hardly ever form; give what the clock has used up, and the end."""
    keys = 'height = "5.235 um"' + ("\nheld = true" if held else "")
    bond = {"on_rate": 1e-4, "off_rate": 1.0}
    problem = lab.problem({"a": keys}, shear=shear, bond=bond, more=more, sites=200.0)
    machine = lab.ready(problem, sub_step=1e-3, longest=1e-2)
    start = lab.start(machine)
    end = lab.last(machine, 0.01, start)
    assert end.draws[0] == start.draws[0]
    return start.clocks[0] - end.clocks[0], end


def factor(speed: float) -> float:
    return float(ChangHammer(**DISC).factor(np.array([speed]))[0])


def test_a_sliding_cell_binds_faster_the_faster_it_slides(lab: Any) -> None:
    """A free cell near the wall slides at about half the speed that it goes with; twice the shear, twice the slip."""
    slips, ratios = [], []
    for shear in (10.0, 20.0, 200.0):
        plain, end = spent(lab, shear)
        slipping, same_end = spent(lab, shear, more=ENCOUNTER)
        assert (end.centres == same_end.centres).all()
        resistance, ambient = lone_cell(
            lab.problem({"a": 'height = "5.235 um"'}, shear=shear).setting, 5.0, 5.235, 0.235
        )
        motion = np.linalg.solve(resistance, ambient)
        slip = motion[0] - 5.235 * motion[4]
        assert end.velocities[0, [0, 4]] == pytest.approx(motion[[0, 4]], rel=1e-6)
        assert slipping / plain == pytest.approx(factor(slip), rel=1e-4)
        slips.append(slip)
        ratios.append(slipping / plain)
    assert slips[1] == pytest.approx(2 * slips[0], rel=1e-9)
    assert (np.diff(ratios) > 0.02).all()
    assert ratios[0] > 1.2 * factor(SLOWEST)


def test_a_cell_that_rolls_without_slip_binds_as_at_the_slowest(lab: Any) -> None:
    plain, _ = spent(lab, 40.0, held=True)
    slipping, _ = spent(lab, 40.0, held=True, more=ENCOUNTER)
    assert slipping / plain == pytest.approx(factor(SLOWEST), rel=1e-4)
    assert plain > 0


def test_events_come_at_the_factors_rate(lab: Any) -> None:
    """Six runs of the same way, as long as it takes for some bonds of no strength to form."""
    expected, formed = 0.0, 0
    hazard, _ = spent(lab, 200.0, more=ENCOUNTER)
    for seed in range(6):
        bond = {"on_rate": 30.0, "off_rate": 1e-3, "stiffness": 1e-3, "compliance": 0}
        problem = lab.problem(
            {"a": 'height = "5.235 um"'}, shear=200.0, bond=bond, more=ENCOUNTER, sites=800.0, seed=seed
        )
        machine = lab.ready(problem, sub_step=1e-3, longest=1e-2)
        state = lab.last(machine, 1e-3, lab.start(machine))
        formed += len(state.bonds)
        tip = 5.235 + machine.fixed.molecules.arm[:, 2] - 0.05
        near = (tip < machine.fixed.species.reach[0]).sum()
        expected += near * -np.expm1(-30.0 * 1e-3 * factor(_slip(lab)))
    assert hazard > 0
    assert expected > 50
    # molecules come and go at the rim while the cell turns 0.1 rad/1 ms: as many come as go
    assert abs(formed - expected) < 5 * np.sqrt(expected) + 0.02 * expected


def _slip(lab: Any) -> float:
    resistance, ambient = lone_cell(lab.problem({"a": 'height = "5.235 um"'}, shear=200.0).setting, 5.0, 5.235, 0.235)
    motion = np.linalg.solve(resistance, ambient)
    return float(motion[0] - 5.235 * motion[4])
