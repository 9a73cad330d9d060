"""Single solves: errors as worked out by hand, the reference's own error, refusals, solvers that nobody knows."""

import numpy as np
import pytest
from attrs import evolve

from mpad_core import solver, velocities
from mpad_core.interfaces.errors import InputError, RefusedError
from mpad_core.physics.levels import installed_levels
from mpad_core.scene.spec import Part
from mpad_core.studies.cost.reference import finer_than
from mpad_core.studies.cost.solves import solves
from mpad_core.studies.cost.study import Options, cost
from mpad_core.studies.cost.subject import own_level, subject_of

NUMBER = 4


def rows_of(scene, names):
    subject = subject_of(scene, NUMBER)
    *_, last = solves(subject, installed_levels(names))
    return subject, {row.label: row for row in last.rows(subject)}, last


def test_errors_are_those_worked_out_by_hand(two_cells):
    subject, rows, _ = rows_of(two_cells, ["isolated", "rpb"])
    found = {"whole": [], "normal": []}
    for at in subject.situations:
        own, reference = (
            velocities(solver(name), at.configuration.centres, at.configuration.radii, viscosity=1e-3, shear_rate=80.0)
            for name in ("isolated", "rpb")
        )
        wrong, size = (v * np.array([1, 1, 1, 5, 5, 5]) for v in (own - reference, reference))
        found["whole"].append(np.linalg.norm(wrong) / np.linalg.norm(size))
        found["normal"].append(np.linalg.norm(wrong[:, 2]) / np.linalg.norm(size[:, 2]))
    row = rows["isolated"]
    assert row.error == pytest.approx(np.median(found["whole"]), rel=1e-9)
    assert row.worst == pytest.approx(max(found["whole"]), rel=1e-9)
    assert row.normal == pytest.approx(np.median(found["normal"]), rel=1e-9)
    assert row.error > 1e-3
    assert rows["rpb lone_sphere=exact"].reference
    assert all(one.time > 0 and one.refresh > 0 and one.setup > 0 and one.memory > 0 for one in rows.values())


def test_a_finer_setting_tells_the_error_of_the_reference(two_cells, strangers):
    """Levels are wrong by 0.1 and 0.01; the solver takes 0.001, a factor of ten beyond, and no less."""
    _, rows, last = rows_of(two_cells, ["graded"])
    assert last.doubt.against == "graded accuracy=0.001"
    assert last.doubt.size == pytest.approx((1.01 - 1.001) / 1.001, rel=1e-9)
    reference, coarse = rows["graded accuracy=0.01"], rows["graded accuracy=0.1"]
    assert reference.reference
    assert reference.below
    assert reference.known_error == last.doubt.size
    assert coarse.error == pytest.approx((1.1 - 1.01) / 1.01, rel=1e-9)
    assert not coarse.below


def test_without_a_finer_setting_the_next_coarser_level_tells(two_cells):
    assert finer_than(installed_levels(["rpb"])[-1]) == []
    _, rows, last = rows_of(two_cells, ["rpb"])
    assert last.doubt.against == "rpb lone_sphere=blake"
    assert last.doubt.size == rows["rpb lone_sphere=blake"].error > 0


def test_a_level_that_refuses_is_shown_with_its_reason(two_cells, strangers):
    _, rows, last = rows_of(two_cells, strangers)
    assert rows["refusing"].note == "refused: solver 'refusing': sphere 0 is not to its taste"
    assert np.isnan(rows["refusing"].error)
    assert last.answered[-1].level.label == "graded accuracy=0.01"


def test_a_strangers_solver_is_there_without_being_known(strangers):
    assert {"graded", "isolated", "rpb", "sd", "cdl-biem"} <= {level.name for level in installed_levels()}


def test_if_all_refuse_there_is_no_study(two_cells, strangers, tmp_path):
    with pytest.raises(RefusedError, match=r"no level answers.*not to its taste"):
        cost(two_cells, tmp_path, Options(solvers=("refusing",)))
    assert "not to its taste" in (tmp_path / "cost.csv").read_text()


def test_a_solver_that_is_not_installed(two_cells, tmp_path):
    with pytest.raises(InputError, match="no solver 'nobody' is installed"):
        cost(two_cells, tmp_path / "new", Options(solvers=("nobody",)))
    assert not (tmp_path / "new").exists()


def test_the_scenes_own_solver_is_a_level_too(two_cells, strangers):
    part = Part(kind="solver", name="graded", parameters={"accuracy": 0.05})
    scene, levels = evolve(two_cells, solver=part), installed_levels(["graded"])
    assert own_level(scene, levels).label == "graded accuracy=0.05"
    assert own_level(two_cells, installed_levels(["isolated"])) is None
