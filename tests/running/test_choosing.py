"""Choosing a solver for a scene: what is chosen, that the choice is kept, and that a run climbs and goes on."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mpad_core import InputError, load_scene, run, states
from mpad_core.physics.levels import answer, installed_levels, relative_error
from mpad_core.records.checkpoint import read_checkpoint
from mpad_core.running.choosing import settled
from mpad_core.running.scouting import situation_of, situations
from mpad_core.scene.compose import compose
from mpad_core.scene.files import parse_scene
from mpad_core.scene.writing import resolved_toml

TEXT = """
solver = {{ name = "auto", accuracy = {accuracy!r} }}
stop = {{ time = "15 ms" }}
fluid = {{ viscosity = "1 mPa s" }}
flow = {{ kind = "shear", rate = "80 1/s" }}
wall = {{}}
[kinds.bead]
radius = "5 um"
density = "1000 kg/m^3"
[cells.low]
kind = "bead"
height = "5.3 um"
held = {held}
[cells.high]
kind = "bead"
x = "-14 um"
y = "9 um"
height = "7 um"
"""


def asked(accuracy: float, held: bool = False) -> Any:
    return parse_scene(TEXT.format(accuracy=accuracy, held=str(held).lower()))


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("accuracy", [0.3, 3e-3])
def test_the_choice_meets_the_request_on_the_way_and_nothing_much_coarser_does(accuracy: float, held: bool) -> None:
    scene = settled(asked(accuracy, held))
    problem = compose(scene)
    finest, rungs = installed_levels()[-1].solver, problem.solver.rungs()
    for state in list(states(scene))[1::5]:
        place, fluid = situation_of(problem, state), problem.setting
        truth, found = (
            answer(s, s.plan(fluid), fluid, place, 400.0).velocity for s in (finest, rungs[state.level].solver)
        )
        assert relative_error(found, truth, problem.radii) <= accuracy
    assert rungs[0].label.split()[0] in ({"isolated", "rpb"} if accuracy > 0.1 else {"sd", "cdl-biem"})


def test_a_settled_scene_stays_settled_and_reads_back() -> None:
    scene = settled(asked(1e-2))
    assert settled(scene) is scene
    again = parse_scene(resolved_toml(scene))
    assert again.solver == scene.solver
    assert "within 0.01" in again.solver.parameters["reason"]


def test_a_scene_that_names_its_solver_is_left_alone() -> None:
    scene = parse_scene(TEXT.format(accuracy=1e-2, held="false").replace('"auto", accuracy = 0.01', '"rpb"'))
    assert settled(scene) is scene


def test_situations_are_of_the_run_and_hold_its_closest_pair(lab: Any) -> None:
    machine = lab.machine({"a": 'height = "6 um"', "b": 'height = "9 um"\nx = "-14 um"'}, shear=80.0)
    found = situations(machine, 0.3, 5)
    assert 3 <= len(found) <= 5
    first = found[0].configuration
    assert (first.centres == machine.problem.start).all()
    gaps = [place.closest()[0] for place in found]
    assert min(gaps) < gaps[0]
    assert len(situations(machine, 0.3, 5, most_steps=2)) == 2


@pytest.mark.slow
def test_a_resumed_run_keeps_the_choice_and_another_accuracy_is_another_scene(tmp_path: Path) -> None:
    summary = run(asked(1e-2), tmp_path)
    kept = (tmp_path / "scene.toml").read_text()
    assert summary["solver_choice"]["chose"] == load_scene(tmp_path / "scene.toml").solver.parameters["levels"][0]
    started = json.loads((tmp_path / "run.jsonl").read_text().splitlines()[0])
    assert started["data"]["solver"]["reason"] == summary["solver_choice"]["reason"]
    again = run(asked(1e-2), tmp_path, resume=True)
    assert again["solver_choice"] == summary["solver_choice"]
    assert (tmp_path / "scene.toml").read_text() == kept
    with pytest.raises(InputError, match="another scene"):
        run(asked(2e-2), tmp_path, resume=True)
    with pytest.raises(InputError, match="holds a run already"):
        run(asked(1e-2), tmp_path)


@pytest.mark.slow
def test_a_run_climbs_and_its_level_is_part_of_the_state(tmp_path: Path) -> None:
    """The free cell overtakes the held one; rpb does while they are far apart, not when they are near."""
    text = (
        TEXT.format(accuracy=3e-3, held="true")
        .replace('"15 ms"', '"150 ms"')
        .replace('"-14 um"', '"-40 um"')
        .replace('"9 um"', '"11 um"')
    )
    levels = '"auto", levels = ["rpb lone_sphere=exact", "cdl-biem accuracy=0.01"], accuracy'
    scene = parse_scene(text.replace('"auto", accuracy', levels))
    seen = [state.level for state in states(scene)]
    assert (seen[0], seen[-1]) == (0, 1)
    assert (np.diff(seen) >= 0).all()
    run(scene, tmp_path)
    assert read_checkpoint(tmp_path / "checkpoint.npz")["state.level"] == 1
