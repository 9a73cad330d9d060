"""The audit: solvers that are symmetric fore and aft come back to their height, one that is not is found out."""

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from attrs import evolve, frozen

from mpad_core import load_scene, solver
from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.values import Motion, SolverTraits
from mpad_core.scene.compose import compose
from mpad_core.studies.reversibility import Level, Meeting, Return, returned

EXAMPLE = Path(__file__).parents[2] / "examples" / "recruitment.toml"


@frozen(kw_only=True)
class Slanted:
    """Isolated cells, but for a fault: every cell moves a share of its speed along the flow away from the wall."""

    name: ClassVar[str] = "slanted"
    traits: ClassVar[SolverTraits] = SolverTraits(coupling=False)
    own: Any
    share: float

    def plan(self, setting: Any) -> Any:
        return self.own.plan(setting)

    def prepare(self, plan: Any, configuration: Any, guess: Any = None) -> Any:
        return self.own.prepare(plan, configuration, guess)

    def solve(self, prepared: Any, loads: Any) -> Motion:
        motion = self.own.solve(prepared, loads)
        velocity = motion.velocity.copy()
        velocity[1, 2] += self.share * velocity[1, 0]
        return evolve(motion, velocity=velocity)


@pytest.fixture(scope="module")
def meeting() -> Meeting:
    return Meeting.of(compose(load_scene(EXAMPLE)), "roller", "free")


def test_it_is_the_base_collision(meeting: Meeting) -> None:
    """The held cell at a height of 5.235 µm, the free one 10 µm to the side at 5.255 µm."""
    at = meeting.at(-60.0, meeting.problem.start[1, 1:])
    assert at.centres == pytest.approx(np.array([[0, 0, 5.235], [-60, 10, 5.255]]))
    assert at.radii == pytest.approx([5, 5])


def test_isolated_cells_keep_their_height(meeting: Meeting) -> None:
    found = returned(meeting, Level(name="isolated", solver=solver("isolated")))
    assert (found.drift, found.side, found.lowest, found.highest) == pytest.approx((0, 0, 0, 0), abs=1e-9)
    assert found.solves > 10


@pytest.mark.parametrize(
    ("name", "how", "highest"), [("rpb", {}, 400.6), ("sd", {}, 237.8), ("cdl-biem", {"accuracy": 1e-2}, 242.2)]
)
def test_symmetric_solvers_come_back(meeting: Meeting, name: str, how: dict[str, Any], highest: float) -> None:
    """However wrong the rise in between is: to what the integrator makes of the steps in a solver's degrees."""
    found = returned(meeting, Level(name=name, solver=solver(name, **how)))
    assert abs(found.drift) < 1e-3
    assert abs(found.side) < 5e-3
    assert found.lowest > -1e-3
    assert found.highest == pytest.approx(highest, abs=0.5)


@pytest.mark.slow
def test_the_reference_comes_back(meeting: Meeting) -> None:
    found = returned(meeting, Level(name="1e-6", solver=solver("cdl-biem", accuracy=1e-6), error=1e-7))
    assert abs(found.drift) < 0.01
    assert found.highest == pytest.approx(239.0, abs=0.2)


def test_a_fault_is_found_to_its_size(meeting: Meeting) -> None:
    """A slope of 1e-4 over 120 µm fakes 12 nm."""
    found: Return = returned(meeting, Level(name="slanted", solver=Slanted(own=solver("isolated"), share=1e-4)))
    assert found.drift == pytest.approx(12.0, rel=1e-6)
    assert found.highest == pytest.approx(12.0, rel=1e-6)


def test_a_cell_that_stops_is_refused(meeting: Meeting) -> None:
    setting = evolve(meeting.problem.setting, shear_rate=0.0)
    still = evolve(meeting, problem=evolve(meeting.problem, setting=setting))
    with pytest.raises(RefusedError, match="does not carry the free cell on at x = -60 um"):
        returned(still, Level(name="isolated", solver=solver("isolated")))
