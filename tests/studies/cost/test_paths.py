"""Whole paths, places along them, and waiting times of bond events."""

from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

from mpad_core import load_scene
from mpad_core.interfaces.errors import InputError
from mpad_core.interfaces.values import BOND_EVENT
from mpad_core.running.march import make_ready
from mpad_core.scene.compose import compose
from mpad_core.studies.cost.paths import AtPlaces, AtTime, travel
from mpad_core.studies.cost.quiet import is_random, quiet
from mpad_core.studies.cost.replays import waiting_errors
from mpad_core.studies.cost.rows import RUN
from mpad_core.studies.cost.runs import judged, run_of
from mpad_core.studies.cost.subject import _places, subject_of
from mpad_core.studies.cost.tolerances import FACTORS, position_runs

RECRUITMENT = Path(__file__).parents[3] / "examples" / "recruitment.toml"


@pytest.fixture
def way(two_cells):
    return travel(make_ready(compose(two_cells)), two_cells.stop.time)


def test_a_path_is_kept_from_start_to_end(way, two_cells):
    assert way.times[0] == 0
    assert way.times[-1] == pytest.approx(two_cells.stop.time, rel=1e-3)
    assert (np.diff(way.times) > 0).all()
    assert np.array_equal(way.centres[-1], way.last.centres)
    assert way.steps > 1
    assert way.took > 0


def test_places_along_a_path(way):
    b = 1
    dx = way.dx(b)
    middle = len(dx) // 2
    found = AtPlaces(cell=b, dx=(dx[middle], dx.max() + 1)).of(way)
    assert found[0] == pytest.approx(way.centres[middle, b, 2], rel=1e-12)  # without bonds: the height
    assert np.isnan(found[1])
    ends = AtTime(cells=(0, 1), time=float(way.times[-1]), called=("a", "b")).of(way)
    assert ends == pytest.approx(way.centres[-1].ravel(), rel=1e-12)


def test_the_run_ends_when_it_is_told(two_cells):
    way = travel(make_ready(compose(two_cells)), two_cells.stop.time, lambda state: state.centres[0, 0] > 2.0)
    assert 2.0 < way.last.centres[0, 0] < 4.0


def test_differences_of_runs_by_hand(way):
    outcome = AtTime(cells=(0,), time=0.0, called=("a",))
    runs = [run_of(RUN, label, "s", outcome, way) for label in ("coarse", "fine", "finest")]
    found = [1.0, 2.0, 9.0], [1.1, 1.0, 1.0], [1.0, 1.0, 1.0]
    runs = [evolve(run, found=np.array(x)) for run, x in zip(runs, found, strict=True)]
    coarse, fine, finest = judged(runs)
    assert (coarse.error, coarse.worst) == (1.0, 8.0)
    assert finest.reference
    assert finest.bound == fine.bound == fine.error == 0.0  # the median of 0.1, 0, 0
    finer = evolve(runs[0], found=np.array([1.0, 1.5, 1.5]))
    assert judged(runs, finer)[2].known_error == 0.5


def test_without_bonds_those_that_bind_are_held():
    problem = compose(load_scene(RECRUITMENT))
    roller, free = problem.names.index("roller"), problem.names.index("free")
    assert is_random(problem)
    silent = quiet(problem, problem.start, free)
    assert not is_random(silent)
    assert silent.held.tolist() == [i == roller for i in range(2)]
    assert not problem.held.any()  # and the problem itself is as it was


def test_usual_places_are_those_that_the_cell_comes_to():
    dx = np.array([-100.0, -50.0, 40.0])
    assert _places(dx, ()) == (-75.0, -15.0, 0.0, 15.0, 30.0)
    assert _places(dx, (20.0, -20.0)) == (-20.0, 20.0)
    assert len(_places(np.array([-100.0, -80.0]), ())) == 6
    with pytest.raises(InputError, match=r"goes from dx = -100 to 40 um only, not by 60 um"):
        _places(dx, (60.0,))


def test_places_need_a_passage(two_cells):
    with pytest.raises(InputError, match="--at: is for scenes with a"):
        subject_of(two_cells, 2, (1.0,))


def events(*rows):
    made = np.zeros(len(rows), BOND_EVENT)
    for name, values in zip(("time", "cell", "receptor", "kind"), zip(*rows, strict=True), strict=True):
        made[name] = values
    return made


def test_waiting_times_by_hand():
    """Two cells with clocks of their own; after a different event nothing is compared."""
    expected = events((1.0, 0, 7, 0), (2.0, 1, 9, 0), (3.0, 0, 8, 0), (6.0, 0, 7, 1))
    found = events((1.1, 0, 7, 0), (1.9, 1, 9, 0), (3.4, 0, 8, 0), (6.2, 0, 8, 1))
    errors = waiting_errors([found], [expected])
    mean = 6.0 / 3  # of cell 0; that of cell 1 is 2.0
    assert np.sort(errors) == pytest.approx(np.sort([0.1 / mean, 0.3 / mean, 0.1 / 2.0]))
    assert waiting_errors([expected], [expected]).tolist() == [0.0] * 4
    assert len(waiting_errors([], [])) == 0


def test_what_takes_too_long_is_left_out_and_said_to_be(two_cells):
    subject = subject_of(two_cells, 2)
    *_, rows = position_runs(subject, budget=-1.0)
    assert len(rows) == len(FACTORS)
    assert all("add --long" in row.note and np.isnan(row.error) for row in rows)
