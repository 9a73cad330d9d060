"""What the three verbs promise: superposition, blocks, warm starts, honest reports, refusals."""

import numpy as np
import pytest
from hypothesis import given

from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration
from mpad_core.physics.questions import velocities
from mpad_core.testing.asking import AskedSolver, paired, relative
from mpad_core.testing.claims import check
from mpad_core.testing.invariance import WALLS
from mpad_core.testing.strategies import configurations, crowd, some_loads, tried

_EXAMPLES = 10
_MANY = 30  # spheres: enough that a solver which iterates for many does so
_PAIR = Configuration(centres=[[0.0, 0.0, 1.4], [3.1, 0.4, 2.2]], radii=[1.0, 1.0])


class SolvingContract(AskedSolver):
    """What holds of `plan`, `prepare` and `solve`, whatever the method behind them."""

    def test_is_a_mobility_solver(self) -> None:
        """It has all members, and a name."""
        assert isinstance(self.solver, MobilitySolver)
        assert self.solver.name

    @WALLS
    @given(at=configurations())
    @tried(_EXAMPLES)
    def test_superposes(self, wall: bool, at: Configuration) -> None:
        """Motion under two loads, less the free motion, is the sum of the two."""
        setting, at = self.setting(wall), self.fitting(at)
        n = len(at.radii)
        first, second = some_loads((n, 6), 1), some_loads((n, 6), 2)
        free = self.free(setting, at)
        one, two, both = (self.motion(setting, at, x).velocity for x in (first, second, first + second))
        check("loads superpose", "linearity", self.tolerance, relative(both, one + two - free, at.radii))

    @WALLS
    @given(at=configurations())
    @tried(_EXAMPLES)
    def test_block_is_its_columns(self, wall: bool, at: Configuration) -> None:
        """Several right-hand sides at once are each one alone, and keep the shape of the loads."""
        setting, at = self.setting(wall), self.fitting(at)
        loads = some_loads((len(at.radii), 6, 3))
        block = self.motion(setting, at, loads).velocity
        assert block.shape == loads.shape
        for k in range(3):
            single = self.motion(setting, at, np.ascontiguousarray(loads[:, :, k])).velocity
            check("a block is its columns", "interface", self.tolerance, relative(block[:, :, k], single, at.radii))

    @WALLS
    def test_warm_start_changes_nothing(self, wall: bool) -> None:
        """A guess may save work; the answer stays within the solver's tolerance, also if the guess is of no use."""
        setting, at = self.setting(wall), self.fitting(crowd(_MANY))
        loads = some_loads((len(at.radii), 6))
        cold = self.motion(setting, at, loads)
        if cold.guess is None:
            return
        useless = 3.0 * some_loads(cold.guess.shape, 5)
        for guess in (cold.guess, 1.01 * cold.guess, useless):
            warm = self.motion(setting, at, loads, guess).velocity
            check("a warm start changes nothing", "interface", 1e-6, relative(warm, cold.velocity, at.radii))

    @WALLS
    def test_many_spheres(self, wall: bool) -> None:
        """Symmetric and definite also where there are many spheres, which may be treated another way."""
        setting, at = self.setting(wall), self.fitting(crowd(_MANY, self.solver.traits.unequal_radii))
        matrix, scales = self.matrix(setting, at), self.scales(setting, at)
        found = self.apart(setting, at, matrix, matrix.T)
        check("mobility of many is symmetric", "reciprocal theorem", 100 * self.tolerance, found)
        assert np.linalg.eigvalsh(0.5 * (matrix + matrix.T) / np.outer(scales, scales))[0] > 0

    def test_held_spheres(self) -> None:
        """A held sphere stays, and what holds it moves the others as the mobility says."""
        setting, at = self.setting(), self.fitting(_PAIR, paired)
        forces = some_loads((2, 3))
        moved = velocities(
            self.solver, at.centres, at.radii, viscosity=setting.viscosity, shear_rate=setting.shear_rate,
            forces=forces, held=[1],
        )  # fmt: skip
        assert (moved[1] == 0).all()
        free = self.free(setting, at).ravel()
        matrix = self.motion(setting, at, np.eye(12).reshape(2, 6, 12)).velocity.reshape(12, 12) - free[:, None]
        load = np.zeros(12)
        load[:3] = forces[0]
        load[6:] = np.linalg.solve(matrix[6:, 6:], -(free[6:] + matrix[6:, :6] @ load[:6]))
        expected = (free + matrix @ load)[:6]
        error = relative(moved[:1], expected[None], at.radii[:1])
        check("held spheres are held by loads", "linearity", self.tolerance, error)

    @WALLS
    @given(at=configurations())
    @tried(_EXAMPLES)
    def test_report_and_purity(self, wall: bool, at: Configuration) -> None:
        """The claimed error is a number, nothing is written to the input, and asking again gives the same bits."""
        setting, at = self.setting(wall), self.fitting(at)
        loads = some_loads((len(at.radii), 6))
        for array in (loads, at.centres, at.radii, at.wall_gaps):
            array.flags.writeable = False
        first, second = self.motion(setting, at, loads), self.motion(setting, at, loads)
        assert np.isfinite(first.report.error)
        assert first.report.error >= 0
        assert np.isfinite(first.velocity).all()
        assert (first.velocity == second.velocity).all()
        assert first.guess is None or isinstance(first.guess, np.ndarray)

    def test_refuses_what_is_no_number(self) -> None:
        """A configuration or loads with NaN are refused, not answered."""
        setting, at = self.setting(), self.fitting(_PAIR)
        for column in (0, 2):
            centres = at.centres.copy()
            centres[0, column] = np.nan
            with pytest.raises(RefusedError):
                self.solver.prepare(self.solver.plan(setting), Configuration(centres=centres, radii=at.radii))
        loads = np.zeros((len(at.radii), 6))
        loads[0, 1] = np.nan
        with pytest.raises(RefusedError):
            self.motion(setting, at, loads)
