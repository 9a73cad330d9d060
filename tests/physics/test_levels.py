"""Installed levels, situations, and the error of an answer."""

from typing import Any

import numpy as np
import pytest

from mpad_core import InputError, solver, velocities
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.physics.levels import Situation, answer, installed_levels, level_named, relative_error

AT = Configuration(centres=[[0, 0, 5.3], [11, 1, 6.0], [-4, 12, 7.5]], radii=[5.0, 5.0, 4.0])
FLUID = Setting(viscosity=1e-3, shear_rate=80.0)


def loads() -> Any:
    return np.random.default_rng(1).normal(size=(3, 6))


def test_levels_go_from_the_coarsest_claim_to_the_finest_and_leave_out_who_stands_for_others() -> None:
    levels = installed_levels()
    claims = [level.claim for level in levels]
    assert claims == sorted(claims, reverse=True)
    assert {"isolated", "rpb", "sd", "cdl-biem"} <= {level.name for level in levels}
    assert "auto" not in {level.name for level in levels}
    for level in levels:
        assert level_named(level.label) == level


@pytest.mark.parametrize("label", ["rpb lone_sphere=never", "sdd", ""])
def test_a_level_that_is_not_installed_is_refused_with_those_that_are(label: str) -> None:
    with pytest.raises(InputError, match="installed"):
        level_named(label)


def test_an_answer_is_that_of_the_plain_question_held_spheres_included() -> None:
    rpb = solver("rpb")
    for held in ([], [1], [0, 2]):
        place = Situation(configuration=AT, loads=loads(), held=np.array(held, np.int64))
        found = answer(rpb, rpb.plan(FLUID), FLUID, place, 400.0).velocity
        expected = velocities(
            rpb, AT.centres, AT.radii, viscosity=1e-3, shear_rate=80.0, forces=place.loads[:, :3],
            torques=place.loads[:, 3:], held=held,
        )  # fmt: skip
        assert relative_error(found, expected, AT.radii) < 1e-10
        assert (found[held] == 0).all()


def test_a_part_keeps_who_is_held_and_the_closest_pair_is_found() -> None:
    place = Situation(configuration=AT, loads=loads(), held=np.array([2]))
    part = place.part(np.array([2, 0]))
    assert part.held.tolist() == [0]
    assert (part.loads == place.loads[[2, 0]]).all()
    gap, pair = place.closest()
    assert pair.tolist() == [0, 1]
    assert gap == pytest.approx(np.sqrt(11**2 + 1 + 0.7**2) - 10)
    assert place.part(np.array([1])).closest()[0] == np.inf


def test_the_error_weighs_spins_by_the_radius() -> None:
    expected = np.zeros((2, 6))
    expected[0, 0], expected[1, 4] = 3.0, 2.0  # 2 * 2 um
    found = expected.copy()
    found[1, 5] = 0.25
    assert relative_error(found, expected, np.array([1.0, 2.0])) == pytest.approx(0.5 / 5)
