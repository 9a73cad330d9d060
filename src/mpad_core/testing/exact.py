"""Where exact solutions are known: one sphere above the wall or alone, two spheres in unbounded fluid."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpad_core.arrays import Array
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.numerics.pair_functions import PairFunctions, pair_resistance, pair_strain_load
from mpad_core.numerics.wall_functions import wall_mobility, wall_shear_load
from mpad_core.testing.asking import AskedSolver, paired, relative, several, single
from mpad_core.testing.claims import check, withhold
from mpad_core.testing.invariance import WALLS
from mpad_core.testing.strategies import numbers, some_loads, tried

_RADIUS = 1.7
_FAR = 1e4  # radii
_SERIES = "two spheres, Jeffrey & Onishi 1984"


def exact_alone(setting: Setting, at: Configuration, loads: Array) -> Array:
    """Give the exact velocities (N, 6) of spheres that do not feel each other."""
    found = np.empty_like(loads)
    eta = setting.viscosity
    for i, (a, h) in enumerate(zip(at.radii, at.centres[:, 2], strict=True)):
        mobility, ambient = np.zeros((6, 6)), np.zeros(6)
        if setting.wall:
            wall_mobility(h, at.wall_gaps[i], a, eta, mobility)
            wall_shear_load(h, at.wall_gaps[i], a, eta, setting.shear_rate, ambient)
            found[i] = mobility @ (loads[i] + ambient)
        else:
            mobility[range(6), range(6)] = np.repeat([1 / (6 * np.pi * eta * a), 1 / (8 * np.pi * eta * a**3)], 3)
            found[i] = mobility @ loads[i] + [setting.shear_rate * h, 0, 0, 0, 0.5 * setting.shear_rate, 0]
    return found


def exact_pair(setting: Setting, at: Configuration, loads: Array) -> Array:
    """Give the exact velocities (2, 6) of two spheres in unbounded fluid.

    Their resistance and their load in the ambient strain, by the functions of `mpad_core.numerics.pair_functions`.
    """
    order = np.argsort(-at.radii, kind="stable")
    (a, b), (one, two) = at.radii[order], at.centres[order]
    distance = float(np.linalg.norm(two - one))
    functions = PairFunctions.of(float(b / a))(float((distance - a - b) * (a + b) / (2 * a * b)))
    resistance, load, strain = np.empty((12, 12)), np.empty(12), np.zeros((3, 3))
    strain[0, 2] = strain[2, 0] = setting.shear_rate / 2
    pair_resistance(functions, (two - one) / distance, a, b, setting.viscosity, resistance)
    pair_strain_load(functions, (two - one) / distance, a, setting.viscosity, strain, load)
    answer = np.linalg.solve(resistance, loads[order].ravel() + load)
    moved: Array = np.asarray(answer, dtype=np.float64).reshape(2, 6)
    moved[:, 0] += setting.shear_rate * at.centres[order, 2]
    moved[:, 4] += setting.shear_rate / 2
    return np.asarray(moved[np.argsort(order)], dtype=np.float64)


@st.composite
def pairs(draw: st.DrawFn, closest: float = 1e-3, farthest: float = 10.0) -> Configuration:
    """Draw two spheres in any direction from each other, gaps in radii of the larger; the wall is out of their way."""
    ratio, gap = draw(numbers(0.3, 1.0)), closest * (farthest / closest) ** draw(numbers(0.0, 1.0))
    polar, azimuth = draw(numbers(0.0, np.pi)), draw(numbers(-np.pi, np.pi))
    radii, up = np.array([_RADIUS, ratio * _RADIUS]), 3.0 + _RADIUS * (2.0 + farthest)
    along = np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
    first = np.array([0.0, 0.0, up])
    return Configuration(centres=[first, first + (radii.sum() + gap * _RADIUS) * along], radii=radii)


def lone(gap: float) -> Configuration:
    """Give one sphere, its gap to the wall in radii."""
    return Configuration(centres=[[0.0, 0.0, _RADIUS * (1 + gap)]], radii=[_RADIUS], wall_gaps=[_RADIUS * gap])


def tried_loads(count: int) -> list[Array]:
    """Give no loads, some, and loads fifty times as large."""
    return [np.zeros((count, 6)), some_loads((count, 6)), 50 * some_loads((count, 6), 1)]


class ExactContract(AskedSolver):
    """Where the exact answer is known, the error is not larger than what the solver reports.

    Attributes
    ----------
    shortfall
        By how much an error claimed in a report may fall short of the true one.
    worthless
        A claimed error from which on an answer is not held to it: it says that it may be wrong by its own size.
    """

    shortfall: float = 2.0
    worthless: float = 0.5

    def _as_claimed(self, claim: str, source: str, error: float, reported: float) -> None:
        """Check an error against the one that the solver has reported."""
        if reported < self.worthless:
            check(claim, source, self.shortfall * reported + self.tolerance, error)
        else:
            withhold(f"reports that it may be wrong by {reported:.2g}")

    @WALLS
    @pytest.mark.parametrize("gap", [1e-4, 1e-2, 0.3, 3.0, 100.0])
    def test_lone_sphere_is_as_good_as_claimed(self, wall: bool, gap: float) -> None:
        """A sphere alone moves as the exact functions say, within the error that the solver reports."""
        setting, at = self.setting(wall), self.fitting(lone(gap), single)
        for loads in tried_loads(1):
            answer = self.motion(setting, at, loads)
            error = relative(answer.velocity, exact_alone(setting, at, loads), at.radii)
            self._as_claimed("a lone sphere is as good as claimed", "bispherical series", error, answer.report.error)

    @given(at=pairs())
    @tried(20)
    def test_two_spheres_are_as_good_as_claimed(self, at: Configuration) -> None:
        """Two spheres in unbounded fluid move as the exact solution says, within the error that the solver reports."""
        setting, at = self.setting(wall=False), self.fitting(at, paired)
        for loads in tried_loads(2):
            answer = self.motion(setting, at, loads)
            error = relative(answer.velocity, exact_pair(setting, at, loads), at.radii)
            self._as_claimed("two spheres are as good as claimed", _SERIES, error, answer.report.error)

    @WALLS
    def test_alone_when_far_apart(self, wall: bool) -> None:
        """What spheres do to each other dies out with their distance."""
        setting = self.setting(wall, shear_rate=0.0)
        spot = self.fitting(Configuration(centres=[[0.0, 0.0, 1.5], [6.0, 0.0, 1.5]], radii=[1.0, 1.0]), several)
        spot, loads, changes = spot.part(np.arange(2)), some_loads((2, 6)), []
        for times in (1.0, 10.0, _FAR / 6.0):
            at = _spread(spot, times)
            singly = [self.motion(setting, at.part(np.array([i])), loads[i : i + 1]).velocity[0] for i in range(2)]
            both = self.motion(setting, at, loads).velocity
            changes.append(relative(both, np.array(singly), at.radii))
        assert sorted(changes, reverse=True) == changes
        check("far apart, spheres are alone", "decay of the Stokeslet", 2.0 / _FAR, changes[-1])
        if self.solver.traits.coupling and self.only is None:
            assert changes[0] > 1e-4

    @WALLS
    def test_carried_by_the_flow(self, wall: bool) -> None:
        """Far from the wall and from each other, spheres move and turn with the flow."""
        setting = self.setting(wall)
        if setting.shear_rate == 0:
            pytest.skip("no ambient flow here" if self.only else f"{self.solver.name} knows no ambient flow")
        at = self.fitting(lone(_FAR - 1), _lost)
        free, height = self.free(setting, at)[0], at.centres[0, 2]
        expected = np.array([setting.shear_rate * height, 0, 0, 0, setting.shear_rate / 2, 0])
        check("a free sphere turns at half the shear rate", "Faxén", 1e-3, abs(free[4] / expected[4] - 1))
        check("a free sphere keeps up with the flow", "Faxén", 1e-3, relative(free, expected, at.radii))


def _spread(at: Configuration, times: float) -> Configuration:
    """Give two spheres that many times as far from each other along the wall."""
    away: Any = (times - 1) * (at.centres[1] - at.centres[0]) * [1.0, 1.0, 0.0]
    return at.moved(np.array([np.zeros(3), away]))


def _lost(at: Configuration) -> bool:
    """Tell whether there is one sphere, so high that no wall is felt."""
    return single(at) and bool(at.centres[0, 2] > 0.5 * _FAR * at.radii[0])
