"""Solvers beside each other: they differ by no more than both of them claim to be wrong."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpad_core.arrays import Array
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration, Motion, Setting
from mpad_core.testing.asking import AskedSolver, relative
from mpad_core.testing.claims import check, withhold
from mpad_core.testing.invariance import WALLS
from mpad_core.testing.strategies import chains, some_chains, some_loads, tried

_EXAMPLES = 10
_SAMPLE = 20


def _weighed(setting: Setting, at: Configuration, seed: int) -> list[Array]:
    """Give no loads, a weight as strong as the shear, and forces in any direction of that size."""
    size = 6 * np.pi * setting.viscosity * at.radii[:, None] * max(setting.shear_rate, 1.0) * at.radii[:, None]
    none, down, any_way = np.zeros((3, len(at.radii), 6))
    down[:, 2:3], any_way[:, :3] = -size, size * some_loads((len(at.radii), 3), seed)
    return [none, down, any_way]


class Beside(AskedSolver):
    """Two solvers that are asked the same.

    Attributes
    ----------
    solver, claimed
        One solver and the error that it claims for its parameters.
    other, other_claimed
        The other.
    usual, farthest
        By how much the truth may exceed reported errors in nine of ten cases, and in any.
    worthless
        A reported error from which on an answer is not held to it.
    """

    other: MobilitySolver
    other_claimed: float | None = None
    usual: float = 3.0
    farthest: float = 10.0
    worthless: float = 0.5

    def _answers(self, wall: bool, at: Configuration, seed: int) -> list[tuple[Motion, Motion, Array]]:
        """Ask both the same, within what both can treat."""
        beside = AskedSolver()
        beside.solver, beside.only = self.other, self.only
        setting, at = self.setting(wall), beside.fitting(self.fitting(at))
        if beside.setting(wall) != setting:
            pytest.skip(f"{self.solver.name} and {self.other.name} treat different flows")
        every = _weighed(setting, at, seed)
        return [(self.motion(setting, at, loads), beside.motion(setting, at, loads), at.radii) for loads in every]

    def _rounding(self) -> float:
        """Give what iterations leave."""
        return max(self.tolerance, 10 * float(getattr(self.other, "tolerance", 0.0)))

    def _reported(self, mine: Motion, theirs: Motion, times: float) -> float | None:
        """Give so many times the sum of what both report; None if that is as large as the answer, or one report is."""
        errors = mine.report.error, theirs.report.error
        allowed = times * sum(errors) + self._rounding()
        if max(errors) < self.worthless and allowed < 1:
            return allowed
        withhold("what they report leaves room for any answer")
        return None


class BesideContract(Beside):
    """Two solvers asked the same differ by no more than the sum of the errors that they claim."""

    @WALLS
    @given(at=chains(), seed=st.integers(0, 1000))
    @tried(_EXAMPLES, shrink=False)  # there are many pairs, and a solver that is wrong fails beside each other one
    def test_agree_as_they_report(self, wall: bool, at: Configuration, seed: int) -> None:
        """Reports are estimates, not bounds; but two solvers never differ by ten times the sum of what they report."""
        for mine, theirs, radii in self._answers(wall, at, seed):
            allowed = self._reported(mine, theirs, self.farthest)
            if allowed is not None:
                check(
                    "solvers never differ by far more than reported",
                    "cross-check",
                    allowed,
                    _apart(mine, theirs, radii),
                )

    @WALLS
    def test_agree_in_nine_of_ten_as_they_report(self, wall: bool) -> None:
        """In nine of ten cases of a sample they differ by no more than three times the sum of what both report."""
        kept = []
        for i, at in enumerate(some_chains(_SAMPLE)):
            for mine, theirs, radii in self._answers(wall, at, i):
                allowed = self._reported(mine, theirs, self.usual)
                kept += [] if allowed is None else [_apart(mine, theirs, radii) <= allowed]
        if kept:
            check("solvers differ as reported in nine of ten cases", "cross-check", 0.1, 1 - float(np.mean(kept)))

    @WALLS
    @given(at=chains(), seed=st.integers(0, 1000))
    @tried(_EXAMPLES, shrink=False)  # there are many pairs, and a solver that is wrong fails beside each other one
    def test_agree_as_their_levels_claim(self, wall: bool, at: Configuration, seed: int) -> None:
        """In shear, under weights and under forces they differ by no more than the sum of their levels' errors."""
        if self.claimed is None or self.other_claimed is None:
            pytest.skip("parameters without a claim")
        if self.claimed + self.other_claimed >= 1:
            pytest.skip("one of them claims no accuracy")
        for mine, theirs, radii in self._answers(wall, at, seed):
            allowed = self.claimed + self.other_claimed + self._rounding()
            check("solvers agree as their levels claim", "cross-check", allowed, _apart(mine, theirs, radii))


def _apart(mine: Motion, theirs: Motion, radii: Array) -> float:
    """Give the difference relative to the larger of the two answers."""
    return min(relative(mine.velocity, theirs.velocity, radii), relative(theirs.velocity, mine.velocity, radii))


class LevelContract(Beside):
    """A level of a solver is as good as it claims, judged by the finest solver that is installed.

    Attributes
    ----------
    other, other_claimed
        The finest solver and its claim.
    """

    @WALLS
    @given(at=chains(), seed=st.integers(0, 1000))
    @tried(4 * _EXAMPLES)
    def test_level_is_as_good_as_claimed(self, wall: bool, at: Configuration, seed: int) -> None:
        """In shear, free and under weights as strong, spheres at gaps from a twentieth of a radius move as claimed."""
        if self.claimed is None:
            pytest.skip("parameters without a claim")
        for mine, theirs, radii in self._answers(wall, at, seed)[:2]:
            allowed = self.claimed + (self.other_claimed or 0.0)
            check(
                "a level is as good as claimed",
                "the finest solver",
                allowed,
                relative(mine.velocity, theirs.velocity, radii),
            )
