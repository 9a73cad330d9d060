"""A scene run from Python: what it gives, how it goes on, and what a passage with seeds is made of."""

import json
from pathlib import Path

import numpy as np
import pytest

from mpad_core import load_scene, read_trajectory, run, states
from mpad_core.interfaces.errors import InputError
from mpad_core.records.checkpoint import read_checkpoint
from mpad_core.records.log import read_log
from mpad_core.running.recorder import Recorder
from mpad_core.studies.report import summary_lines
from recorded import datasets

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parents[2] / "examples"
QUICK = ('cells.roller.start.rolling_alone="2 ms"',)


class DeathError(BaseException):
    """Stands for the death of the process: nobody handles it."""


@pytest.fixture
def recruitment():
    def load(*settings):
        return load_scene(EXAMPLES / "recruitment.toml", [*QUICK, 'stop.time="3 ms"', *settings])

    return load


def test_the_summary_is_that_of_the_file(recruitment, tmp_path):
    summary = run(recruitment(), tmp_path)
    assert summary == json.loads((tmp_path / "summary.json").read_text())
    assert [told["control"] for told in summary["runs"]] == [False, True]
    assert summary["passage"]["of"] == 1


def test_the_generator_gives_the_states_of_the_run(recruitment, tmp_path):
    scene = recruitment()
    run(scene, tmp_path)
    *_, last = states(scene)
    kept = read_checkpoint(tmp_path / "checkpoint.npz")
    for name in ("time", "centres", "wall_gaps", "orientations", "velocities", "mean_loads"):
        assert np.array_equal(getattr(last, name), kept[f"state.{name}"]), name
    assert np.array_equal(last.bonds.anchor, kept["bonds.anchor"])


def test_seeds_and_controls_have_their_folders(tmp_path):
    scene = load_scene(EXAMPLES / "capture.toml", [*QUICK, 'stop.time="3 ms"', "passage.seeds=2"])
    summary = run(scene, tmp_path)
    assert [told["folder"] for told in summary["runs"]] == [".", "control", "seed-2", "seed-2/control"]
    assert [told["seed"] for told in summary["runs"]] == [1, 1, 2, 2]
    first, second = (read_trajectory(tmp_path / folder / "trajectory.h5") for folder in ("", "seed-2"))
    assert not np.array_equal(first.bond_events, second.bond_events)
    assert summary["passage"]["of"] == 2


def test_a_second_seed_is_the_first_of_a_scene_with_that_seed(recruitment, tmp_path):
    run(recruitment("passage.seeds=2"), tmp_path / "both")
    run(recruitment("seed=2"), tmp_path / "second")
    one, other = (
        datasets(tmp_path / "both" / "seed-2" / "trajectory.h5"),
        datasets(tmp_path / "second" / "trajectory.h5"),
    )
    assert [name for name in one if one[name] != other[name]] == ["mpad/scene"]  # which says the seed asked for


@pytest.mark.parametrize("moment", ["keep", "finish", "last keep"])
@pytest.mark.parametrize("ends", ["free.dx > -99.7 um", "time"])
def test_death_in_the_last_step_changes_nothing(moment, ends, recruitment, tmp_path, monkeypatch):
    """The condition that ended the run holds for the state that was kept; going on must not take another step."""
    scene = recruitment() if ends == "time" else recruitment(f'stop.when=["{ends}"]', "passage.control=false")
    summary = run(scene, tmp_path / "whole", checkpoint_every=0.0)
    assert summary["runs"][0]["ended"].replace(".0", "") == ends
    keep = Recorder.keep

    def dying(self, state, ended=""):
        if ended and moment == "keep":
            raise DeathError
        keep(self, state, ended)
        if ended:
            raise DeathError

    def dying_before(self, state):
        raise DeathError

    with monkeypatch.context() as patch:
        if moment == "finish":
            patch.setattr(Recorder, "finish", dying_before)
        else:
            patch.setattr(Recorder, "keep", dying)
        with pytest.raises(DeathError):
            run(scene, tmp_path / "cut", checkpoint_every=0.0)
    run(scene, tmp_path / "cut", resume=True)
    whole, cut = (datasets(tmp_path / name / "trajectory.h5") for name in ("whole", "cut"))
    assert whole.keys() == cut.keys()
    assert not [name for name in whole if whole[name] != cut[name]]


def test_death_between_run_and_control(recruitment, tmp_path, monkeypatch):
    run(recruitment(), tmp_path / "whole")
    from mpad_core.studies import runs

    with monkeypatch.context() as patch:
        done = []
        own = runs.run_one

        def dying(*given, **options):
            if done:
                raise DeathError
            done.append(1)
            return own(*given, **options)

        patch.setattr(runs, "run_one", dying)
        with pytest.raises(DeathError):
            run(recruitment(), tmp_path / "cut")
    run(recruitment(), tmp_path / "cut", resume=True)
    for name in ("trajectory.h5", "control/trajectory.h5"):
        assert datasets(tmp_path / "whole" / name) == datasets(tmp_path / "cut" / name)


def test_a_directory_is_claimed_by_its_scene(recruitment, tmp_path):
    run(recruitment(), tmp_path)
    with pytest.raises(InputError, match="--resume"):
        run(recruitment(), tmp_path)
    with pytest.raises(InputError, match="very same scene"):
        run(recruitment("seed=5"), tmp_path, resume=True)


def test_the_summary_says_what_each_effect_contributed(recruitment, tmp_path, capsys):
    """Loads and coupling add up to one, of all and of each free cell; what is off says nothing."""
    summary = run(recruitment('stop.time="50 ms"'), tmp_path)
    for told in summary["runs"]:
        parts = ("shear", "gravity", "repulsion", "bonds", "coupling")
        for one in (told["effects"], *(cell["effects"] for cell in told["cells"].values())):
            for share in ("velocity_share", "normal_share"):
                found = [one[name][share] for name in parts if name in one and one[name][share] is not None]
                assert sum(found) == pytest.approx(1, abs=0.05)  # medians of what adds up, not a sum of one step
        assert told["effects"]["thermal"] == {
            "on": False, "why": 'switched "off" by the scene',
            "velocity_share": None, "normal_share": None, "time_share": None,
        }  # fmt: skip
        times = told["time_shares"]
        assert sum(times[name] for name in ("coupling", "drift", "burst", "recording")) == pytest.approx(1)
        assert times["looked_at"] >= 1
    assert summary["effects"] == summary["runs"][0]["effects"]
    free = summary["runs"][0]["cells"]["free"]["effects"]
    assert free["bonds"]["velocity_share"] == 0  # it is a probe
    assert free["shear"]["velocity_share"] > 0.5
    lines = list(summary_lines(summary, tmp_path))
    at = next(k for k, line in enumerate(lines) if line.startswith("effects"))
    assert [line.split()[0] for line in lines[at + 2 : at + 10]] == list(summary["effects"])


def test_a_run_warns_once(recruitment, tmp_path, capfd):
    """The run and its control are of one scene: one warning of each effect, in the log and on standard error."""
    run(recruitment(), tmp_path)
    said = [line for line in capfd.readouterr().err.splitlines() if '"warning"' in line]
    logged = [line for line in read_log(tmp_path / "run.jsonl") if line["event"] == "warning"]
    assert [json.loads(line) for line in said] == logged
    assert [line["data"]["effect"] for line in logged] == ["thermal"]  # in 3 ms the cells come nowhere near each other
    assert 'effects.thermal = "on"' in logged[0]["data"]["text"]


@pytest.mark.parametrize("settings", [
    ('flow={ kind = "none" }',), ("passage.control=false",), ('record.what=["overlap"]',), ("record.what=[]",),
    ("passage.also_on_rates=[]",), ('effects.bonds="off"', "cells.roller.start={}"), ('solver="isolated"',),
    ("cells.roller.held=true", "cells.roller.start={}"), ("gravity={}",), ('effects.wall="off"',),
    ('passage.past=["roller"]', "passage.seeds=2"),
])  # fmt: skip
def test_every_summary_can_be_told(settings, recruitment, tmp_path):
    quick = [word for word in QUICK if "cells.roller.start={}" not in settings]
    scene = load_scene(EXAMPLES / "recruitment.toml", [*quick, 'stop.time="3 ms"', *settings])
    summary = run(scene, tmp_path)
    lines = list(summary_lines(summary, tmp_path))
    assert lines[-1] == f"written to {tmp_path}"
    assert not any("nan" in line or "None" in line for line in lines)
    run(scene, tmp_path, resume=True)
