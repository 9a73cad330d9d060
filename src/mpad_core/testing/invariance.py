"""What Stokes flow asks of a mobility: symmetry, definiteness, invariance, scaling."""

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given
from hypothesis import strategies as st

from mpad_core.arrays import Array
from mpad_core.interfaces.values import Configuration
from mpad_core.testing.asking import AskedSolver, relative, several
from mpad_core.testing.claims import check
from mpad_core.testing.strategies import configurations, numbers, tried

WALLS = pytest.mark.parametrize("wall", [True, False], ids=["wall", "unbounded"])
_EXAMPLES = 10


def _blocks(turn: Array, count: int, axial: float = 1.0) -> Array:
    """Give the matrix (6N, 6N) that turns velocities and loads; axial vectors take the sign `axial`."""
    return np.kron(np.eye(count), np.block([[turn, np.zeros((3, 3))], [np.zeros((3, 3)), axial * turn]]))


def _moved(at: Configuration, centres: Array, scale: float = 1.0) -> Configuration:
    return Configuration(centres=centres, radii=scale * at.radii, wall_gaps=scale * at.wall_gaps)


class InvarianceContract(AskedSolver):
    """The laws that hold for any configuration, tried on many."""

    @WALLS
    @given(at=configurations())
    @tried(_EXAMPLES)
    def test_symmetric(self, wall: bool, at: Configuration) -> None:
        """The mobility is symmetric."""
        setting, at = self.setting(wall), self.fitting(at)
        matrix = self.matrix(setting, at)
        found = self.apart(setting, at, matrix, matrix.T)
        check("mobility is symmetric", "reciprocal theorem, Lorentz 1896", self.tolerance, found)

    @WALLS
    @given(at=configurations())
    @tried(_EXAMPLES)
    def test_positive_definite(self, wall: bool, at: Configuration) -> None:
        """Every load does work on the fluid."""
        setting, at = self.setting(wall), self.fitting(at)
        scales = self.scales(setting, at)
        matrix = self.matrix(setting, at) / np.outer(scales, scales)
        lowest = float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0])
        check("mobility is positive definite", "dissipation", 0.0, -lowest)
        assert lowest > 0

    @WALLS
    @given(at=configurations(), x=numbers(-50, 50), y=numbers(-50, 50))
    @tried(_EXAMPLES)
    def test_same_anywhere_along_the_wall(self, wall: bool, at: Configuration, x: float, y: float) -> None:
        """A shift along the wall changes nothing, with or without flow."""
        setting, at = self.setting(wall), self.fitting(at)
        shifted = _moved(at, at.centres + np.array([x, y, 0.0]))
        found = self.apart(setting, at, self.matrix(setting, shifted), self.matrix(setting, at))
        check("mobility is the same anywhere along the wall", "symmetry", self.tolerance, found)
        found = relative(self.free(setting, shifted), self.free(setting, at), at.radii)
        check("free motion is the same anywhere along the wall", "symmetry", self.tolerance, found)

    @WALLS
    @given(at=configurations(), angle=numbers(-np.pi, np.pi))
    @tried(_EXAMPLES)
    def test_turns_with_the_configuration(self, wall: bool, at: Configuration, angle: float) -> None:
        """A turn about the wall's normal turns the answer."""
        setting, at = self.setting(wall), self.fitting(at)
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        whole = _blocks(turn, len(at.radii))
        found = self.matrix(setting, _moved(at, at.centres @ turn.T))
        expected = whole @ self.matrix(setting, at) @ whole.T
        check("mobility turns about z", "symmetry", self.tolerance, self.apart(setting, at, found, expected))

    @WALLS
    @given(at=configurations())
    @tried(_EXAMPLES)
    def test_mirrored(self, wall: bool, at: Configuration) -> None:
        """A mirror that leaves the flow alone, y to -y, mirrors the answer."""
        setting, at = self.setting(wall), self.fitting(at)
        mirror = np.diag([1.0, -1.0, 1.0])
        whole = _blocks(mirror, len(at.radii), axial=-1.0)
        image = _moved(at, at.centres @ mirror)
        found, expected = self.matrix(setting, image), whole @ self.matrix(setting, at) @ whole
        check("mobility is mirrored", "symmetry", self.tolerance, self.apart(setting, at, found, expected))
        expected_free = (whole @ self.free(setting, at).ravel()).reshape(-1, 6)
        found_free = relative(self.free(setting, image), expected_free, at.radii)
        check("free motion is mirrored", "symmetry", self.tolerance, found_free)

    @WALLS
    @given(at=configurations(fewest=2), seed=st.integers(0, 100))
    @tried(_EXAMPLES)
    def test_names_of_spheres_do_not_matter(self, wall: bool, at: Configuration, seed: int) -> None:
        """Spheres in another order move as before."""
        setting, at = self.setting(wall), self.fitting(at, several)
        order = np.random.Generator(np.random.Philox(seed)).permutation(len(at.radii))
        rows = (6 * order[:, None] + np.arange(6)).ravel()
        found, expected = self.matrix(setting, at.part(order)), self.matrix(setting, at)[np.ix_(rows, rows)]
        check("order does not matter", "symmetry", self.tolerance, self.apart(setting, at.part(order), found, expected))
        found_free = relative(self.free(setting, at.part(order)), self.free(setting, at)[order], at.radii[order])
        check("order does not matter for free motion", "symmetry", self.tolerance, found_free)

    @WALLS
    @given(at=configurations(), length=numbers(0.01, 100), viscosity=numbers(0.01, 100), rate=numbers(-100, 100))
    @tried(_EXAMPLES)
    def test_scales(self, wall: bool, at: Configuration, length: float, viscosity: float, rate: float) -> None:
        """Mobility goes as 1/(ηa), 1/(ηa²) and 1/(ηa³), free motion as the shear rate, free of the viscosity."""
        setting, at = self.setting(wall), self.fitting(at)
        larger = _moved(at, length * at.centres, length)
        other = evolve(setting, viscosity=viscosity, shear_rate=rate if setting.shear_rate else 0.0)
        powers = np.tile(np.repeat([length**-0.5, length**-1.5], 3), len(at.radii))
        expected = self.matrix(setting, at) * np.outer(powers, powers) * setting.viscosity / viscosity
        found = self.apart(other, larger, self.matrix(other, larger), expected)
        check("mobility scales with size and viscosity", "dimensions", self.tolerance, found)
        if setting.shear_rate != 0 and other.shear_rate != 0:
            grown = self.free(setting, at) * other.shear_rate / setting.shear_rate
            grown[:, :3] *= length
            error = relative(self.free(other, larger), grown, larger.radii)
            check("free motion scales with shear and size", "linearity", self.tolerance, error)
