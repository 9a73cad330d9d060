"""The solver `rpb`: exact when alone, definite always, one answer by either way, and honest about what it misses."""

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from attrs import evolve

from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.numerics.stokeslets import grand_mobility
from mpad_core.numerics.wall_functions import wall_mobility, wall_shear_load
from mpad_core.plugins.registry import load
from mpad_rpb import RotnePragerBlake
from mpad_rpb.dense import invert
from mpad_rpb.lone import lone_corrections

Array = np.ndarray[Any, np.dtype[np.float64]]
SHEAR = Setting(viscosity=1.3, shear_rate=2.0)
EXACT, BLAKE = RotnePragerBlake(), RotnePragerBlake(lone_sphere="blake")


def solved(
    solver: RotnePragerBlake, setting: Setting, at: Configuration, few: int | None = None
) -> tuple[Array, Array]:
    """Give mobility (6N, 6N) and load-free velocities (6N,); `few` forces one of the two ways."""
    size = 6 * len(at.radii)
    velocities = []
    for flow, loads in ((evolve(setting, shear_rate=0.0), np.eye(size)), (setting, np.zeros((size, 1)))):
        plan = solver.plan(flow)
        prepared = solver.prepare(plan if few is None else evolve(plan, few=few), at)
        velocities.append(solver.solve(prepared, loads.reshape(-1, 6, loads.shape[1])).velocity.reshape(size, -1))
    return velocities[0], velocities[1][:, 0]


def scattered(count: int, seed: int, gap: float = 0.05) -> Configuration:
    """Give spheres of radii 0.5 to 2 on a jittered lattice, the lowest as near to the wall as `gap`."""
    rng = np.random.default_rng(seed)
    side = int(np.ceil(count ** (1 / 3)))
    lattice = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)[:count]
    radii = rng.uniform(0.5, 2.0, count)
    centres = 4.6 * lattice + rng.uniform(-0.2, 0.2, (count, 3))
    centres[:, 2] = np.where(lattice[:, 2] == 0, radii * (1 + gap), centres[:, 2] + 2)
    return Configuration(centres=centres, radii=radii)


def relative(found: Array, expected: Array) -> float:
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


def test_comes_in_by_the_front_door() -> None:
    assert load("solver", "rpb") is RotnePragerBlake
    assert isinstance(EXACT, MobilitySolver)
    with pytest.raises(ValueError, match="lone_sphere"):
        RotnePragerBlake(lone_sphere="oseen")


def test_importing_it_is_light() -> None:
    code = "import sys, mpad_rpb; print([m for m in ('numba', 'scipy', 'h5py') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("few", [0, 100])
@pytest.mark.parametrize("gap", [1e-6, 1e-3, 0.3, 5.0, 100.0])
def test_lone_sphere_is_exact(gap: float, few: int) -> None:
    a = 1.7
    at = Configuration(centres=[[3.0, -2.0, a + gap * a]], radii=[a], wall_gaps=[gap * a])
    mobility, free = solved(EXACT, SHEAR, at, few)
    expected, held = np.empty((6, 6)), np.empty(6)
    wall_mobility(a + gap * a, gap * a, a, SHEAR.viscosity, expected)
    wall_shear_load(a + gap * a, gap * a, a, SHEAR.viscosity, SHEAR.shear_rate, held)
    scale = np.sqrt(np.diag(expected))
    assert (abs(mobility - expected) / np.outer(scale, scale)).max() < 1e-12
    assert relative(free, expected @ held) < 1e-12


def test_lone_correction_is_positive_semidefinite() -> None:
    """The method's lone sphere is a Galerkin projection, which never resists more than the exact one."""
    gaps = np.logspace(-6, 2, 161)
    resistance, load_ = np.empty((161, 6, 6)), np.empty((161, 6))
    centres = np.column_stack([gaps, gaps, 1 + gaps])
    lone_corrections(centres, np.ones(161), gaps, 1.0, 1.0, resistance, load_)
    lowest = np.linalg.eigvalsh(resistance)[:, 0]
    assert (lowest > -1e-10).all()  # far from the wall it vanishes, to the last digits of both resistances
    assert (lowest[gaps < 1] > 0).all()
    assert resistance == pytest.approx(np.swapaxes(resistance, 1, 2), abs=1e-13)


@pytest.mark.parametrize("gap", [1.0, 1e-3, 1e-6])
@pytest.mark.parametrize("count", [2, 7, 20])
def test_symmetric_and_definite(count: int, gap: float) -> None:
    mobility, _ = solved(EXACT, Setting(viscosity=1.0), scattered(count, count, gap))
    scale = np.sqrt(np.diag(mobility))
    scaled = mobility / np.outer(scale, scale)
    assert abs(scaled - scaled.T).max() < 1e-14
    assert np.linalg.eigvalsh(scaled)[0] > 0


@pytest.mark.parametrize("solver", [EXACT, BLAKE])
@pytest.mark.parametrize("wall", [True, False])
@pytest.mark.parametrize("gap", [0.5, 1e-6])
def test_either_way_gives_the_same(solver: RotnePragerBlake, wall: bool, gap: float) -> None:
    setting = evolve(SHEAR, wall=wall)
    at = scattered(12, 5, gap)
    dense, free = solved(solver, setting, at, few=100)
    iterated, free_iterated = solved(solver, setting, at, few=0)
    assert relative(free_iterated, free) < 1e-9
    scale = np.sqrt(np.diag(dense))
    assert (abs(iterated - dense) / np.outer(scale, scale)).max() < 1e-7  # squeezing is small beside the whole column
    assert relative(iterated, dense) < 1e-9


def test_same_at_the_crossover() -> None:
    plan = EXACT.plan(SHEAR)
    loads = np.random.default_rng(1).normal(size=(plan.few + 1, 6))
    at = scattered(plan.few + 1, 3)
    iterated = EXACT.solve(EXACT.prepare(plan, at), loads)
    dense = EXACT.solve(EXACT.prepare(evolve(plan, few=plan.few + 1), at), loads)
    assert iterated.report.iterations > 0
    assert dense.report.iterations == 0
    assert relative(iterated.velocity, dense.velocity) < 1e-9
    assert iterated.report.error == pytest.approx(dense.report.error)


def test_solves_the_equation_of_resistances() -> None:
    at = scattered(3, 8)
    mobility, free = solved(EXACT, SHEAR, at)
    inverse = np.linalg.inv(grand_mobility(at.centres, at.radii, SHEAR.viscosity, True))
    resistance, load_ = np.empty((3, 6, 6)), np.empty((3, 6))
    lone_corrections(at.centres, at.radii, at.wall_gaps, SHEAR.viscosity, SHEAR.shear_rate, resistance, load_)
    ambient = np.zeros((3, 6))
    ambient[:, 0], ambient[:, 4] = SHEAR.shear_rate * at.centres[:, 2], SHEAR.shear_rate / 2
    grand = inverse.copy()
    for i in range(3):
        grand[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] += resistance[i]
    assert relative(mobility, np.linalg.inv(grand)) < 1e-11
    assert relative(free, np.linalg.solve(grand, load_.reshape(-1) + inverse @ ambient.reshape(-1))) < 1e-11


def test_warm_start_saves_products() -> None:
    plan = evolve(EXACT.plan(SHEAR), few=0)
    at, loads = scattered(30, 2), np.zeros((30, 6))
    cold = EXACT.solve(EXACT.prepare(plan, at), loads)
    warm = EXACT.solve(EXACT.prepare(plan, at, cold.guess), loads)
    other_shape = EXACT.solve(EXACT.prepare(plan, at, np.zeros((4, 6))), loads)
    assert warm.report.iterations < cold.report.iterations
    assert relative(warm.velocity, cold.velocity) < 1e-9
    assert (other_shape.velocity == cold.velocity).all()


def test_blocks_of_loads_are_their_columns() -> None:
    for few in (0, 100):
        plan = evolve(EXACT.plan(SHEAR), few=few)
        prepared = EXACT.prepare(plan, scattered(5, 4))
        loads = np.random.default_rng(2).normal(size=(5, 6, 3))
        whole = EXACT.solve(prepared, loads).velocity
        for k in range(3):
            assert whole[:, :, k] == pytest.approx(EXACT.solve(prepared, loads[:, :, k]).velocity, rel=1e-12, abs=1e-12)


def test_cut_by_the_wall_stays_definite_and_continuous() -> None:
    rng = np.random.default_rng(4)
    for _ in range(100):
        count = int(rng.integers(1, 7))
        radii = rng.uniform(0.2, 2, count)
        centres = rng.uniform(-1, 1, (count, 3))
        centres[:, 2] = radii * 10 ** rng.uniform(-2, 0.3, count)
        mobility, _ = solved(BLAKE, Setting(viscosity=1.0), Configuration(centres=centres, radii=radii))
        scale = np.sqrt(np.diag(mobility))
        assert np.linalg.eigvalsh(mobility / np.outer(scale, scale))[0] > 0
    above, below = (Configuration(centres=[[0, 0, 1 + d], [2.5, 0, 3]], radii=[1, 1.2]) for d in (1e-9, -1e-9))
    assert solved(BLAKE, SHEAR, above)[0] == pytest.approx(solved(BLAKE, SHEAR, below)[0], abs=1e-8)


def test_two_cut_spheres_in_one_column_stay_definite() -> None:
    at = Configuration(centres=[[0, 0, 0.4], [0, 0, 0.8]], radii=[1, 1])
    for few in (0, 10):
        mobility, _ = solved(BLAKE, Setting(viscosity=1.0), at, few)
        scale = np.sqrt(np.diag(mobility))
        assert np.linalg.eigvalsh(mobility / np.outer(scale, scale))[0] > 1e-3


BAD = [
    (EXACT, [[0, 0, 3], [5, 0, -0.5]], [1, 1], "sphere 1: height -0.5 µm"),
    (BLAKE, [[0, 0, 3], [5, 0, 0.0]], [1, 1], "sphere 1: height 0.0 µm"),
    (EXACT, [[0, 0, 0.9], [5, 0, 2]], [1, 1], "sphere 0: gap -0.09"),
    (EXACT, [[0, 0, 1.0]], [1], "sphere 0: gap 0.0 µm"),
    (EXACT, [[0, 0, 3], [float("nan"), 0, 2]], [1, 1], "sphere 1: centre"),
    (EXACT, [[0, 0, 3]], [-1], "sphere 0: radius -1"),
    (EXACT, [[0, 0, 3], [0, 0, 3]], [1, 1], "spheres 0 and 1"),
]


@pytest.mark.parametrize(("solver", "centres", "radii", "message"), BAD)
def test_refuses_by_name(solver: RotnePragerBlake, centres: Any, radii: Any, message: str) -> None:
    with pytest.raises(RefusedError, match=message):
        solver.prepare(solver.plan(SHEAR), Configuration(centres=centres, radii=radii))


@pytest.mark.parametrize("few", [0, 10])
def test_refuses_loads_that_are_no_numbers(few: int) -> None:
    prepared = EXACT.prepare(evolve(EXACT.plan(SHEAR), few=few), scattered(2, 1))
    with pytest.raises(RefusedError, match="loads"):
        EXACT.solve(prepared, np.full((2, 6), np.nan))


def test_unbounded_moves_with_the_flow() -> None:
    at = Configuration(centres=[[0, 0, -4.0], [3, 0, 5]], radii=[1, 2])
    _, free = solved(EXACT, evolve(SHEAR, wall=False), at)
    assert free == pytest.approx([-8, 0, 0, 0, 1, 0, 10, 0, 0, 0, 1, 0])


def test_error_grows_as_spheres_close_in_and_vanishes_alone() -> None:
    plan = EXACT.plan(SHEAR)
    errors = []
    for gap in (20.0, 2.0, 0.2, 0.02):
        at = Configuration(centres=[[0, 0, 2], [2 + gap, 0, 2.5]], radii=[1, 1])
        errors.append(EXACT.solve(EXACT.prepare(plan, at), np.zeros((2, 6))).report.error)
    assert errors == sorted(errors)
    assert errors[0] < 0.01 < 0.1 < errors[-1]
    lone = Configuration(centres=[[0, 0, 1.1]], radii=[1])
    assert EXACT.solve(EXACT.prepare(plan, lone), np.zeros((1, 6))).report.error < 1e-11
    bare = BLAKE.solve(BLAKE.prepare(BLAKE.plan(SHEAR), lone), np.zeros((1, 6)))
    exact = EXACT.solve(EXACT.prepare(plan, lone), np.zeros((1, 6)))
    weights = [1, 1, 1, 1.0, 1, 1]
    true = np.linalg.norm((bare.velocity - exact.velocity) * weights) / np.linalg.norm(exact.velocity * weights)
    assert 0.5 * true < bare.report.error < 1.5 * true


def test_inverts() -> None:
    rng = np.random.default_rng(6)
    factor = rng.normal(size=(30, 30))
    matrix = factor @ factor.T + np.diag(10 ** rng.uniform(0, 8, 30))
    inverse = matrix.copy()
    assert invert(inverse)
    assert (inverse == inverse.T).all()
    assert inverse @ matrix == pytest.approx(np.eye(30), abs=1e-6)
    assert not invert(np.diag([1.0, -1.0]))


@pytest.mark.parametrize("gap", [1e-9, 1e-6, 1e-3, 0.3])
def test_the_error_of_a_bare_sphere_at_the_wall_is_told(gap):
    """Relative to the exact velocity, so that one which is too fast does not make its own error look small."""
    at, load = Configuration(centres=[[0, 0, 1 + gap]], radii=[1.0], wall_gaps=[gap]), np.zeros((1, 6))
    load[0, 2] = -6 * np.pi
    setting = Setting(viscosity=1.0, shear_rate=1.0)
    bare, exact = (s.solve(s.prepare(s.plan(setting), at), load) for s in (BLAKE, EXACT))
    wrong = np.linalg.norm(bare.velocity - exact.velocity) / np.linalg.norm(exact.velocity)
    assert bare.report.error == pytest.approx(wrong, rel=1e-6)
