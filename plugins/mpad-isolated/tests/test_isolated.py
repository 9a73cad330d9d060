"""The solver `isolated`: exact alone, blind to others, and honest about that."""

import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.numerics.wall_functions import wall_mobility, wall_shear_load
from mpad_core.plugins.registry import load
from mpad_isolated import Isolated

SHEAR = Setting(viscosity=1.3, shear_rate=2.0)
SOLVER = Isolated()


def moved(setting: Setting, at: Configuration, loads: Any) -> Any:
    return SOLVER.solve(SOLVER.prepare(SOLVER.plan(setting), at), np.asarray(loads, float))


def test_comes_in_by_the_front_door() -> None:
    assert load("solver", "isolated") is Isolated
    assert isinstance(SOLVER, MobilitySolver)
    assert not SOLVER.traits.coupling


def test_importing_it_is_light() -> None:
    code = "import sys, mpad_isolated; print([m for m in ('numba', 'scipy', 'h5py') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("gap", [1e-6, 1e-2, 1.0, 50.0])
def test_each_is_exact(gap: float) -> None:
    radii = np.array([1.0, 2.5])
    at = Configuration(centres=[[0, 0, 1 + gap], [9, 0, 2.5 + 2 * gap]], radii=radii, wall_gaps=[gap, 2 * gap])
    loads = np.random.default_rng(1).normal(size=(2, 6, 4))
    velocity = moved(SHEAR, at, loads).velocity
    mobility, held = np.empty((6, 6)), np.empty(6)
    for i in range(2):
        where = (at.centres[i, 2], at.wall_gaps[i], radii[i], SHEAR.viscosity)
        wall_mobility(*where, mobility)
        wall_shear_load(*where, SHEAR.shear_rate, held)
        assert velocity[i] == pytest.approx(mobility @ (loads[i] + held[:, None]), rel=1e-12, abs=1e-14)


def test_known_speed_near_the_wall() -> None:
    """Goldman, Cox and Brenner, Chem. Eng. Sci. 22 (1967) 653: U/(γz) = 0.7669 and 2Ω/γ = 0.7792 at z/a = cosh 0.5."""
    height = float(np.cosh(0.5))
    velocity = moved(Setting(viscosity=1, shear_rate=1), Configuration(centres=[[0, 0, height]], radii=[1]), [[0] * 6])
    assert velocity.velocity[0, [0, 4]] == pytest.approx([0.7669 * height, 0.7792 / 2], rel=3e-4)


def test_unbounded_is_stokes() -> None:
    at = Configuration(centres=[[0, 0, -4.0], [3, 0, 5]], radii=[1, 2])
    setting = Setting(viscosity=1.3, shear_rate=2.0, wall=False)
    free = moved(setting, at, np.zeros((2, 6))).velocity
    assert free == pytest.approx(np.array([[-8, 0, 0, 0, 1, 0], [10, 0, 0, 0, 1, 0]]))
    pulled = moved(setting, at, np.ones((2, 6))).velocity - free
    for i, a in enumerate(at.radii):
        expected = [1 / (6 * np.pi * 1.3 * a)] * 3 + [1 / (8 * np.pi * 1.3 * a**3)] * 3
        assert pulled[i] == pytest.approx(expected)


def test_error_falls_with_distance_and_vanishes_alone() -> None:
    loads = np.zeros((2, 6, 1))
    loads[:, 2] = -1.0
    errors = [
        moved(SHEAR, Configuration(centres=[[0, 0, 1.5], [d, 0, 1.5]], radii=[1, 1]), loads).report.error
        for d in (2.1, 4.0, 20.0, 200.0)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] > 0.2
    assert errors[-1] < 1e-3
    assert moved(SHEAR, Configuration(centres=[[0, 0, 1.5]], radii=[1]), [[1.0] * 6]).report.error < 1e-11


def test_many() -> None:
    count = 300
    centres = np.column_stack([3.0 * np.arange(count), np.zeros(count), np.full(count, 1.2)])
    at = Configuration(centres=centres, radii=np.ones(count))
    motion = moved(SHEAR, at, np.zeros((count, 6)))
    assert motion.velocity.shape == (count, 6)
    assert np.ptp(motion.velocity, axis=0).max() == 0
    assert 0.01 < motion.report.error < 1


BAD = [
    ([[0, 0, 3], [5, 0, -0.5]], [1, 1], "sphere 1: height -0.5 µm"),
    ([[0, 0, 0.9], [5, 0, 2]], [1, 1], "sphere 0: gap -0.09"),
    ([[0, 0, 3], [float("nan"), 0, 2]], [1, 1], "sphere 1: centre"),
    ([[0, 0, 3]], [0], "sphere 0: radius 0"),
]


@pytest.mark.parametrize(("centres", "radii", "message"), BAD)
def test_refuses_by_name(centres: Any, radii: Any, message: str) -> None:
    with pytest.raises(RefusedError, match=message):
        SOLVER.prepare(SOLVER.plan(SHEAR), Configuration(centres=centres, radii=radii))


def test_refuses_loads_that_are_no_numbers() -> None:
    with pytest.raises(RefusedError, match="loads"):
        moved(SHEAR, Configuration(centres=[[0, 0, 3]], radii=[1]), np.full((1, 6), np.nan))
