"""Climbing a ladder of solvers: when the reported error is too large, when it only seems so, when a rung refuses."""

from typing import Any, ClassVar

import numpy as np
import pytest
from attrs import evolve, frozen

from mpad_core import InputError, RefusedError, mobility_matrix, solver, velocities
from mpad_core.interfaces.values import Configuration, Motion, Rung, SolverTraits
from mpad_core.physics.auto import Auto
from mpad_core.physics.couplers import coupler
from mpad_core.physics.coupling import Watch
from mpad_core.physics.levels import relative_error

CENTRES = [[0, 0, 5.3], [10.8, 1, 6.0]]
RPB = solver("rpb")


@frozen(kw_only=True)
class Off:
    """rpb, faster by a share, with an error that it reports as a multiple of that share."""

    name: ClassVar[str] = "off"
    traits: ClassVar[SolverTraits] = SolverTraits()
    share: float
    says: float = 1.0
    refuses: bool = False

    def plan(self, setting: Any) -> Any:
        return RPB.plan(setting)

    def prepare(self, plan: Any, configuration: Any, guess: Any = None) -> Any:
        assert guess is None or guess.shape == (1,), "another rung's guess"
        if self.refuses:
            raise RefusedError("not today")
        return RPB.prepare(plan, configuration)

    def solve(self, prepared: Any, loads: Any) -> Motion:
        motion = RPB.solve(prepared, loads)
        report = evolve(motion.report, error=self.says * self.share)
        return Motion(velocity=(1 + self.share) * motion.velocity, report=report, guess=np.array([self.share]))


@frozen(kw_only=True)
class Ladder:
    """Stands for several."""

    name: ClassVar[str] = "ladder"
    traits: ClassVar[SolverTraits] = SolverTraits()
    accuracy: float
    steps: tuple[Off, ...]
    trust: float = 1.0

    def rungs(self) -> tuple[Rung, ...]:
        return tuple(Rung(label=f"off {s.share}", solver=s, claim=s.share, trust=self.trust) for s in self.steps)


def laddered(problem: Any, accuracy: float, *steps: Off, **more: Any) -> Any:
    return coupler(evolve(problem(CENTRES), solver=Ladder(accuracy=accuracy, steps=steps, **more)))


def at(asked: Any) -> Configuration:
    return Configuration(centres=asked.start, radii=asked.radii)


def level(found: Any) -> int:
    return int(found.watch.level)


@pytest.mark.parametrize(("accuracy", "expected"), [(0.2, 0), (0.05, 1), (1e-3, 2), (1e-9, 2)])
def test_the_first_rung_that_is_good_enough_gives_the_coupling(problem: Any, accuracy: float, expected: int) -> None:
    shares = (0.1, 0.01, 1e-5)
    asked = laddered(problem, accuracy, *(Off(share=share) for share in shares))
    found = asked.at(at(problem(CENTRES)), np.zeros((2, 6)), None)
    alone = asked.rungs[expected].at(at(problem(CENTRES)), np.zeros((2, 6)), None)
    assert level(found) == expected
    assert (found.loads == alone.loads).all()
    assert (found.matrices[0] == alone.matrices[0]).all()
    assert found.guess == [shares[expected]]


def test_no_rung_below_the_one_of_before_is_asked(problem: Any) -> None:
    asked = laddered(problem, 0.2, Off(share=0.1), Off(share=0.01), Off(share=1e-5))
    found = asked.at(at(problem(CENTRES)), np.zeros((2, 6)), np.array([0.01]), Watch(1, 1.0))
    assert level(found) == 1


def test_an_estimate_that_is_too_large_is_trusted_less_and_the_run_stays(problem: Any) -> None:
    asked, place = laddered(problem, 0.05, Off(share=0.01, says=10.0), Off(share=1e-5)), at(problem(CENTRES))
    found = asked.at(place, np.zeros((2, 6)), None)
    assert level(found) == 0
    assert found.watch.trust * 0.1 < 0.05
    calls = []
    counted = evolve(asked, rungs=(asked.rungs[0], Counting(asked.rungs[1], calls)))
    again = counted.at(place, np.zeros((2, 6)), found.guess, found.watch)
    assert again.watch == found.watch
    assert not calls


class Counting:
    def __init__(self, inner: Any, calls: list[int]) -> None:
        self.inner, self.calls = inner, calls

    def at(self, *given: Any) -> Any:
        self.calls.append(1)
        return self.inner.at(*given)


def test_a_rung_that_refuses_is_passed_over_and_the_last_one_speaks_for_itself(problem: Any) -> None:
    asked, place = laddered(problem, 0.05, Off(share=0.01, refuses=True), Off(share=1e-5)), at(problem(CENTRES))
    assert level(asked.at(place, np.zeros((2, 6)), None)) == 1
    with pytest.raises(RefusedError, match="not today"):
        laddered(problem, 0.05, Off(share=0.1), Off(share=1e-5, refuses=True)).at(place, np.zeros((2, 6)), None)


def test_trust_multiplies_what_is_reported(problem: Any) -> None:
    """Reported is ten times the truth; a trust of a tenth says so from the start."""
    asked = laddered(problem, 0.05, Off(share=0.01, says=10.0), Off(share=1e-5), trust=0.1)
    found = asked.at(at(problem(CENTRES)), np.zeros((2, 6)), None)
    assert (level(found), found.watch.trust) == (0, 0.1)


def test_what_is_watched_is_the_motion_under_the_mean_loads_held_cells_at_rest(problem: Any) -> None:
    asked = evolve(problem(CENTRES), held=np.array([True, False]))
    loads = np.random.default_rng(0).normal(size=(2, 6))
    ladder = Ladder(accuracy=1e-3, steps=(Off(share=1e-12), Off(share=1e-13)))
    felt = coupler(evolve(asked, solver=ladder)).at(at(asked), loads, None).felt
    fluid = asked.setting
    expected = velocities(
        RPB, asked.start, asked.radii, viscosity=fluid.viscosity, shear_rate=fluid.shear_rate, forces=loads[:, :3],
        torques=loads[:, 3:], held=[0],
    )  # fmt: skip
    assert relative_error(felt.velocity, expected, asked.radii) < 1e-9


PAIR = [[0.0, 0.0, 1.2], [2.3, 0.2, 1.6]]


@pytest.mark.parametrize("accuracy", [0.3, 1e-2, 1e-3])
def test_a_single_question_is_answered_as_exactly_as_asked(accuracy: float) -> None:
    given: dict[str, Any] = {"viscosity": 1.0, "shear_rate": 1.0, "forces": [[0, 0, -6.0], [0, 0, -6.0]]}
    truth = velocities(solver("cdl-biem", accuracy=1e-5), PAIR, 1.0, **given)
    found = velocities(solver("auto", accuracy=accuracy), PAIR, 1.0, **given)
    assert relative_error(found, truth, np.ones(2)) <= accuracy


def test_coarse_requests_get_a_coarse_solver_and_one_sphere_gets_it_alone() -> None:
    found = mobility_matrix(solver("auto", accuracy=0.5), [[0, 0, 1.5], [40, 0, 1.5]], 1.0, viscosity=1.0)
    assert (found[:6, 6:] == 0).all()
    alone = mobility_matrix(solver("auto", accuracy=1e-6), [[0, 0, 1.001]], 1.0, viscosity=1.0)
    assert (alone == mobility_matrix(solver("isolated"), [[0, 0, 1.001]], 1.0, viscosity=1.0)).all()


def test_what_nobody_can_treat_is_refused() -> None:
    with pytest.raises(RefusedError, match="gap"):
        mobility_matrix(solver("auto", levels=("isolated", "cdl-biem accuracy=0.01")), [[0, 0, 1]], 1.0, viscosity=1.0)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"accuracy": 0.0}, "accuracy"),
        ({"levels": ("rpb",), "trust": (1.0, 2.0)}, "trust"),
        ({"trust": (0.5,)}, "trust"),
    ],
)
def test_bad_parameters_are_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        solver("auto", **given)


def test_a_level_that_is_not_there_is_named() -> None:
    with pytest.raises(InputError, match=r"no level 'rpb accuracy=2' is installed \(there are: rpb lone_sphere"):
        Auto(levels=("rpb accuracy=2",)).rungs()
