"""Every chosen solver, at each of its levels, keeps the contracts; beside others it agrees with them."""

from typing import Any

import pytest

from mpad_core.interfaces.mobility import Fluctuating
from mpad_core.testing import FluctuatingContract, MobilitySolverContract
from mpad_core.testing.between import BesideContract, LevelContract
from mpad_core.testing.suite.plugin import only_place


class TestSolver(MobilitySolverContract):
    """What every solver promises."""

    @pytest.fixture(autouse=True)
    def _part(self, solver_case: Any, pytestconfig: pytest.Config) -> None:
        self.solver, self.claimed, self.only = solver_case.made(), solver_case.claimed, only_place(pytestconfig)


class TestFluctuating(FluctuatingContract):
    """What those promise besides that can drive thermal motion."""

    @pytest.fixture(autouse=True)
    def _part(self, solver_case: Any, pytestconfig: pytest.Config) -> None:
        self.solver, self.only = solver_case.made(), only_place(pytestconfig)
        if not isinstance(self.solver, Fluctuating):
            pytest.skip(f"{self.solver.name} gives no roots of its mobility")


class TestBeside(BesideContract):
    """Two solvers differ by no more than they claim."""

    @pytest.fixture(autouse=True)
    def _pair(self, solver_pair: Any, pytestconfig: pytest.Config) -> None:
        mine, theirs = solver_pair
        self.solver, self.claimed, self.only = mine.made(), mine.claimed, only_place(pytestconfig)
        self.other, self.other_claimed = theirs.made(), theirs.claimed


class TestLevel(LevelContract):
    """A level is as good as it claims."""

    @pytest.fixture(autouse=True)
    def _pair(self, solver_level: Any, pytestconfig: pytest.Config) -> None:
        mine, judge = solver_level
        self.solver, self.claimed, self.only = mine.made(), mine.claimed, only_place(pytestconfig)
        self.other, self.other_claimed = judge.made(), judge.claimed
