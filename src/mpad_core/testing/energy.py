"""What work and dissipation ask of a mobility: no load gains energy, loads are reciprocal, squeezing gets harder."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mpad_core.arrays import Array
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.testing.asking import AskedSolver, paired, single
from mpad_core.testing.claims import check
from mpad_core.testing.invariance import WALLS
from mpad_core.testing.strategies import configurations, numbers, some_loads, tried

_EXAMPLES = 10
_FEW = 5
_LOADS = 8
_GAPS = np.array([10.0, 3.0, 1.0, 0.3, 0.1, 0.03, 0.01, 1e-3, 1e-4])  # over the reduced radius
_CLOSED = 1.1  # times gap over reduced radius: Reynolds' film, to which all that is left out adds resistance


class EnergyContract(AskedSolver):
    """Laws of the work that loads do, which need no mobility matrix to be asked."""

    @WALLS
    @given(at=configurations(), seed=st.integers(0, 1000))
    @tried(_EXAMPLES)
    def test_loads_do_work(self, wall: bool, at: Configuration, seed: int) -> None:
        """Whatever the loads, in fluid at rest they do work on it: F·U, the dissipation, is not negative."""
        setting, at = self.setting(wall, shear_rate=0.0), self.fitting(at)
        loads = some_loads((len(at.radii), 6, _LOADS), seed) * self._units(setting, at)[..., None]
        moved = self.motion(setting, at, loads).velocity
        work, size = (loads * moved).sum(axis=(0, 1)), _norms(loads) * _norms(moved)
        check("loads do work on the fluid", "dissipation", 0.0, float((-work / size).max()))

    @WALLS
    @given(at=configurations(), seed=st.integers(0, 1000))
    @tried(_EXAMPLES)
    def test_reciprocal(self, wall: bool, at: Configuration, seed: int) -> None:
        """Of two sets of loads, each does as much work in the motion by the other."""
        setting, at = self.setting(wall, shear_rate=0.0), self.fitting(at)
        units = self._units(setting, at)
        first, second = (some_loads((len(at.radii), 6), seed + k) * units for k in (0, 1))
        one, two = (self.motion(setting, at, loads).velocity for loads in (first, second))
        # in units in which a lone sphere answers unit loads with unit velocities, as `apart` compares matrices
        size = np.linalg.norm(first / units) * np.linalg.norm(second / units)
        found = float(abs((second * one).sum() - (first * two).sum()) / size)
        check("two loads are reciprocal", "reciprocal theorem, Lorentz 1896", self.tolerance, found)

    @WALLS
    @given(ratio=numbers(0.3, 1.0), angle=numbers(-np.pi, np.pi))
    @tried(_FEW)
    def test_squeezing_spheres_gets_harder(self, wall: bool, ratio: float, angle: float) -> None:
        """Two spheres pushed together approach the more slowly the closer they are; with lubrication, not at all."""
        setting = self.setting(wall, shear_rate=0.0)
        spot = self.fitting(_side_by_side(ratio, angle), paired)
        reduced, line = float(1 / (1 / spot.radii).sum()), spot.centres[1] - spot.centres[0]
        line /= np.linalg.norm(line)
        push = np.zeros((2, 6))
        push[:, :3] = [line, -line]
        speeds = []
        for gap in _GAPS * reduced:
            second = spot.centres[0] + line * (spot.radii.sum() + gap)
            at = spot.moved(np.array([np.zeros(3), second - spot.centres[1]]))
            speeds.append(float((self.motion(setting, at, push).velocity * push).sum()))
        unit = 1 / (6 * np.pi * setting.viscosity * reduced)
        self._check_slower("spheres", "Jeffrey & Onishi 1984", np.array(speeds) / unit)

    def test_squeezing_at_the_wall_gets_harder(self) -> None:
        """A sphere pushed to the wall approaches it the more slowly the closer it is."""
        setting = self.setting(shear_rate=0.0)
        spot = self.fitting(Configuration(centres=[[0.0, 0.0, 2.6]], radii=[1.3]), single)
        radius, push = float(spot.radii[0]), np.array([[0.0, 0, -1, 0, 0, 0]])
        speeds = []
        for gap in _GAPS * radius:
            at = Configuration(centres=spot.centres * [1, 1, 0] + [0, 0, radius + gap], radii=[radius], wall_gaps=[gap])
            speeds.append(-float(self.motion(setting, at, push).velocity[0, 2]))
        unit = 1 / (6 * np.pi * setting.viscosity * radius)
        self._check_slower("a sphere and the wall", "Brenner 1961", np.array(speeds) / unit)

    def _check_slower(self, who: str, source: str, speeds: Array) -> None:
        """Check speeds of approach, in units of those without interaction, over the gaps from wide to narrow."""
        check(f"squeezing {who} gets harder", source, self.tolerance, float(np.diff(speeds).max()))
        if self.solver.traits.lubrication:
            check(f"{who} in contact do not approach", "Reynolds 1886", _CLOSED * _GAPS[-1], float(speeds[-1]))

    def _units(self, setting: Setting, at: Configuration) -> Array:
        """Give loads (N, 6) of which each alone does unit work on a lone sphere."""
        return 1 / self.scales(setting, at).reshape(-1, 6)


def _side_by_side(ratio: float, angle: float) -> Configuration:
    """Give two spheres at one height, near the wall."""
    radii = np.array([1.0, ratio])
    return Configuration(centres=[[0.0, 0.0, 1.4], [4.0 * np.cos(angle), 4.0 * np.sin(angle), 1.4]], radii=radii)


def _norms(block: Array) -> Array:
    """Give the norms of the columns of a block (N, 6, k)."""
    norms: Array = np.sqrt((block * block).sum(axis=(0, 1)))
    return norms
