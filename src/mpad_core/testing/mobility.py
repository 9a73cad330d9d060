"""What every mobility solver promises."""

import numpy as np
import pytest

from mpad_core.arrays import Array
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.numerics.wall_functions import wall_mobility, wall_shear_load
from mpad_core.testing.asking import relative
from mpad_core.testing.claims import check
from mpad_core.testing.invariance import WALLS, InvarianceContract
from mpad_core.testing.solving import SolvingContract
from mpad_core.testing.strategies import some_loads

_RADIUS = 1.7
_FAR = 1e4  # radii


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


class MobilitySolverContract(InvarianceContract, SolvingContract):
    """A mobility solver obeys the laws of Stokes flow, keeps to its interface, and is as good as it claims.

    Attributes
    ----------
    solver
        The solver; give it in the class that inherits.
    shortfall
        By how much an error claimed in a report may fall short of the true one.
    worthless
        A claimed error from which on an answer is not held to it: it says that it may be wrong by its own size.
    """

    shortfall: float = 2.0
    worthless: float = 0.5

    @WALLS
    @pytest.mark.parametrize("gap", [1e-4, 1e-2, 0.3, 3.0, 100.0])
    def test_lone_sphere_is_as_good_as_claimed(self, wall: bool, gap: float) -> None:
        """A sphere alone moves as the exact functions say, within the error that the solver reports."""
        setting = self.setting(wall)
        at = Configuration(centres=[[0.0, 0.0, _RADIUS * (1 + gap)]], radii=[_RADIUS], wall_gaps=[_RADIUS * gap])
        for loads in (np.zeros((1, 6)), some_loads((1, 6)), 50 * some_loads((1, 6), 1)):
            answer = self.motion(setting, at, loads)
            error = relative(answer.velocity, exact_alone(setting, at, loads), at.radii)
            if answer.report.error >= self.worthless:
                continue
            allowed = self.shortfall * answer.report.error + self.tolerance
            check("a lone sphere is as good as claimed", "bispherical series", allowed, error)

    @WALLS
    def test_alone_when_far_apart(self, wall: bool) -> None:
        """What spheres do to each other dies out with their distance."""
        setting = self.setting(wall, shear_rate=0.0)
        if self.solver.traits.largest_number == 1:
            pytest.skip(f"{self.solver.name} treats one sphere only")
        loads, changes = some_loads((2, 6)), []
        for distance in (6.0, 60.0, _FAR):
            at = Configuration(centres=[[0.0, 0.0, 1.5], [distance, 0.0, 1.5]], radii=[1.0, 1.0])
            singly = [self.motion(setting, at.part(np.array([i])), loads[i : i + 1]).velocity[0] for i in range(2)]
            both = self.motion(setting, at, loads).velocity
            changes.append(relative(both, np.array(singly), at.radii))
        assert sorted(changes, reverse=True) == changes
        check("far apart, spheres are alone", "decay of the Stokeslet", 2.0 / _FAR, changes[-1])
        if self.solver.traits.coupling:
            assert changes[0] > 1e-4

    @WALLS
    def test_carried_by_the_flow(self, wall: bool) -> None:
        """Far from the wall and from each other, spheres move and turn with the flow."""
        setting = self.setting(wall)
        if setting.shear_rate == 0:
            pytest.skip(f"{self.solver.name} knows no ambient flow")
        height = _FAR * _RADIUS
        at = Configuration(centres=[[0.0, 0.0, height]], radii=[_RADIUS])
        free = self.free(setting, at)[0]
        expected = np.array([setting.shear_rate * height, 0, 0, 0, setting.shear_rate / 2, 0])
        check("a free sphere turns at half the shear rate", "Faxén", 1e-3, abs(free[4] / expected[4] - 1))
        check("a free sphere keeps up with the flow", "Faxén", 1e-3, relative(free, expected, at.radii))
