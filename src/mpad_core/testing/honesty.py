"""Errors that a solver claims must say something: not so wide that any answer would do, not padded beside the truth."""

import numpy as np
import pytest

from mpad_core.arrays import Array
from mpad_core.interfaces.values import Configuration
from mpad_core.testing.asking import paired, relative
from mpad_core.testing.claims import check
from mpad_core.testing.exact import ExactContract, exact_pair, lone, tried_loads
from mpad_core.testing.invariance import WALLS

_PAIRS = 24  # gaps of the sample, in three directions
_FIVE = Configuration(centres=[[0.0, 0.0, 7.0], [7.0, 0.0, 7.0]], radii=[1.0, 1.0])


class HonestyContract(ExactContract):
    """What a solver claims about its error is worth something.

    Attributes
    ----------
    padding
        By how much errors reported may exceed the true ones in the median over a sample of pairs, as far as they are
        not below the solver's own claim: a solver that promises 1e-3 need not know that it is better than that.
    """

    padding: float = 20.0

    @WALLS
    @pytest.mark.parametrize("at", [lone(1.0), _FIVE], ids=["lone", "far"])
    def test_claims_something(self, wall: bool, at: Configuration) -> None:
        """Where it is easy, a sphere a radius from the wall or two spheres five radii apart, the answer is worth more.

        A solver that always says that it may be wrong by half could not be found wrong by any of these laws.
        """
        setting, at = (
            self.setting(wall),
            self.fitting(at, lambda other: _easy(other) and len(other.radii) == len(at.radii)),
        )
        loads = 100.0 * np.ones((len(at.radii), 6))  # as strong as the flow
        reported = max(self.motion(setting, at, load).report.error for load in (0 * loads, loads))
        check("the claim says something", "definition", np.nextafter(self.worthless, 0), reported)

    def test_claims_are_not_padded(self) -> None:
        """In the median over pairs of spheres, reported errors are not far above the true ones."""
        setting, shares = self.setting(wall=False), []
        promised = 1.0 if self.claimed is None else self.claimed
        floor = max(self.tolerance, promised if promised < self.worthless else 0.0)
        for at in self._sample():
            at = self.fitting(at, paired)
            for loads in tried_loads(2):
                answer = self.motion(setting, at, loads)
                error = relative(answer.velocity, exact_pair(setting, at, loads), at.radii)
                shares.append(answer.report.error / max(error, floor))
        check("claims are not padded", "median over pairs", self.padding, float(np.median(shares)))

    def _sample(self) -> list[Configuration]:
        """Give two spheres at gaps of a tenth to ten radii along each axis."""
        gaps, axes = np.geomspace(0.1, 10.0, _PAIRS // 3), np.eye(3)
        return [_apart(gap, axis) for axis in axes for gap in gaps]


def _apart(gap: float, axis: Array) -> Configuration:
    first = np.array([0.0, 0.0, 20.0])
    return Configuration(centres=[first, first + (2.0 + gap) * axis], radii=[1.0, 1.0])


def _easy(at: Configuration) -> bool:
    """Tell whether gaps to the wall are a radius at least, and gaps between spheres five."""
    apart = np.linalg.norm(at.centres[:, None] - at.centres[None], axis=2) - at.radii[:, None] - at.radii[None]
    np.fill_diagonal(apart, np.inf)
    return bool((at.wall_gaps >= 0.999 * at.radii).all() and apart.min() >= 4.999 * at.radii.max())
