"""What a solver that can drive thermal motion promises besides."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from scipy.linalg import hadamard

from mpad_core.arrays import Array
from mpad_core.interfaces.mobility import Fluctuating
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.numerics.fluctuations import room_to_move
from mpad_core.testing.asking import AskedSolver
from mpad_core.testing.claims import check
from mpad_core.testing.invariance import WALLS
from mpad_core.testing.strategies import configurations, crowd, some_loads, tried

_EXAMPLES = 5
_COLUMNS = 5
_SHARE = 0.02  # of the room to move: the differences that drifts are compared with
_DRIFT = 1e-4  # relative: what is left out by differences of fourth order, and digits lost by smaller ones
_LONE = Configuration(centres=[[0.0, 0.0, 1.27]], radii=[1.2])
_PAIR = Configuration(centres=[[0.0, 0.0, 1.6], [2.7, 0.5, 1.3]], radii=[1.1, 1.0])


class FluctuatingContract(AskedSolver):
    """Roots and divergences belong to the very mobility that the solver answers with.

    Attributes
    ----------
    solver
        The solver; give it in the class that inherits.
    many
        Spheres, so many that a solver which treats many in another way does so.
    """

    solver: Any
    many: int = 27

    def root(self, setting: Setting, at: Configuration, noise: Array) -> Array:
        """Ask for a root times noise."""
        root: Array = self.solver.root(self.solver.prepare(self.solver.plan(setting), at), noise)
        return root

    def drift(self, setting: Setting, at: Configuration, noise: Array | None = None) -> Array:
        """Ask for the divergence of the mobility."""
        drift: Array = self.solver.drift(self.solver.prepare(self.solver.plan(setting), at), noise)
        return drift

    def test_is_fluctuating(self) -> None:
        """It has both members."""
        assert isinstance(self.solver, Fluctuating)

    @WALLS
    @given(at=configurations())
    @tried(_EXAMPLES)
    def test_root_is_one_of_the_mobility(self, wall: bool, at: Configuration) -> None:
        """B·Bᵀ is the mobility, whatever the flow."""
        setting, at = self.setting(wall), self.fitting(at)
        size = 6 * len(at.radii)
        root = self.root(setting, at, np.eye(size).reshape(-1, 6, size)).reshape(size, size)
        found = self.apart(setting, at, root @ root.T, self.matrix(setting, at))
        check("the root is one of the mobility", "definition", self.tolerance, found)

    @WALLS
    def test_root_of_many(self, wall: bool) -> None:
        """Bᵀ·M⁻¹·B is one, also where there are many spheres, which may be treated another way."""
        setting, at = self.setting(wall), self.fitting(crowd(self.many))
        noise = some_loads((len(at.radii), 6, _COLUMNS))
        made = self.root(setting, at, noise).reshape(-1, _COLUMNS)
        scales = self.scales(setting, at)
        matrix = self.matrix(setting, at) / np.outer(scales, scales)
        made /= scales[:, None]
        flat = noise.reshape(-1, _COLUMNS)
        found = np.abs(made.T @ np.linalg.solve(matrix, made) - flat.T @ flat).max() / (flat.T @ flat).max()
        check("the root of many is one of the mobility", "definition", 10 * self.tolerance, float(found))

    @WALLS
    def test_root_is_linear(self, wall: bool) -> None:
        """One B for all noises, alone or in a block; the same bits when asked again."""
        setting, at = self.setting(wall), self.fitting(crowd(self.many))
        prepared = self.solver.prepare(self.solver.plan(setting), at)
        noise = some_loads((len(at.radii), 6, 2))
        made = self.solver.root(prepared, noise)
        both = self.solver.root(prepared, noise[:, :, 0] - 0.5 * noise[:, :, 1])
        scales = self.scales(setting, at).reshape(-1, 6)
        found = float(np.abs((both - made[:, :, 0] + 0.5 * made[:, :, 1]) / scales).max())
        check("the root is linear", "definition", 10 * self.tolerance, found)
        assert (self.solver.root(prepared, noise) == made).all()

    @WALLS
    @pytest.mark.parametrize("at", [_LONE, _PAIR], ids=["lone", "pair"])
    def test_drift_is_the_divergence(self, wall: bool, at: Configuration) -> None:
        """The drift is the divergence of the solver's own mobility."""
        setting, at = self.setting(wall), self.fitting(at)
        expected = self._divergence(setting, at)
        found = self.drift(setting, at)
        assert found.shape == expected.shape
        change = np.abs((found - expected) / self._drift_scales(setting, at)).max()
        check("drift is the divergence of the mobility", "definition", _DRIFT, float(change))
        assert (self.drift(setting, at) == found).all()

    @WALLS
    @pytest.mark.parametrize("at", [_LONE, _PAIR], ids=["lone", "pair"])
    def test_random_drift_is_right_in_the_mean(self, wall: bool, at: Configuration) -> None:
        """Over signs that are orthogonal the mean of what noise gives is the drift, up to differences' own error."""
        setting, at = self.setting(wall), self.fitting(at)
        n = len(at.radii)
        signs = hadamard(8).astype(float)[:, 1 : 3 * n + 1].reshape(8, n, 3)
        mean = np.mean([self.drift(setting, at, noise) for noise in signs], axis=0)
        change = np.abs((mean - self.drift(setting, at)) / self._drift_scales(setting, at)).max()
        check("random differences give the drift in the mean", "Delong et al. 2014", _DRIFT, float(change))

    def _drift_scales(self, setting: Setting, at: Configuration) -> Array:
        """Give what drifts (N, 6) are compared with: Stokes' mobility over the radius."""
        radii = at.radii[:, None]
        return np.repeat(np.hstack([1 / radii**2, 1 / radii**3]), 3, axis=1) / (6 * np.pi * setting.viscosity)

    def _divergence(self, setting: Setting, at: Configuration) -> Array:
        """Give ∇·M (N, 6) by fourth-order differences of whole matrices."""
        n = len(at.radii)
        step = _SHARE * float(room_to_move(at.centres, at.radii, at.wall_gaps if setting.wall else None).min())
        total = np.zeros(6 * n)
        for i in range(n):
            for k in range(3):
                shift = np.zeros((n, 3))
                shift[i, k] = step
                for times, weight in ((1, 8 / 12), (-1, -8 / 12), (2, -1 / 12), (-2, 1 / 12)):
                    total += weight / step * self.matrix(setting, at.moved(times * shift))[:, 6 * i + k]
        return total.reshape(n, 6)
