"""Many spheres: one answer by either way of solving, work and memory that grow as they should."""

import json
import subprocess
import sys
import time

import numpy as np
import pytest

from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.numerics.harmonics import factors
from mpad_sd import StokesianDynamics, solving
from spheres import grown, velocity_error

SHEAR = Setting(viscosity=1.0, shear_rate=1.0)
TIGHT = StokesianDynamics(tolerance=1e-11)


def crowd(count, ratio=2.0, seed=1):
    """Give spheres near each other and the wall."""
    centres, radii = grown(np.random.default_rng(seed), count, ratio, 1e-3, 1.0)
    return Configuration(centres=centres, radii=radii)


def loads_on(radii):
    unit = 6 * np.pi * np.column_stack([radii, radii**2]).repeat(3, axis=1)
    return unit * np.random.default_rng(2).normal(size=(len(radii), 6))


def motion(chosen, at, guess=None, setting=SHEAR):
    return chosen.solve(chosen.prepare(chosen.plan(setting), at, guess), loads_on(at.radii))


@pytest.mark.parametrize("wall", [True, False])
@pytest.mark.parametrize("count", [2, 20])
def test_inverse_and_sparse_factors_give_one_answer(monkeypatch, count, wall):
    at, found = crowd(count), []
    for dense in (0, 10**6):
        monkeypatch.setattr(factors, "DENSE", dense)
        prepared = TIGHT.prepare(TIGHT.plan(Setting(viscosity=1.0, shear_rate=1.0, wall=wall)), at)
        assert (len(prepared.level.system.coupled.inverse) > 0) == (dense > 0)
        found.append(TIGHT.solve(prepared, loads_on(at.radii)).velocity)
    assert velocity_error(*found, at.radii) < 1e-9


def test_a_guess_changes_the_work_and_not_the_answer():
    """Of the same spheres, of the same a little later, of others, of fewer, and of none."""
    at = crowd(20)
    cold = motion(TIGHT, at)
    moved = Configuration(centres=at.centres + 1e-4 * np.sin(at.centres), radii=at.radii)
    later = motion(TIGHT, moved, cold.guess)
    assert motion(TIGHT, at, cold.guess).report.iterations <= 1
    assert later.report.iterations < 0.8 * motion(TIGHT, moved).report.iterations
    assert velocity_error(later.velocity, motion(TIGHT, moved).velocity, at.radii) < 1e-9
    for guess in (motion(TIGHT, crowd(20, seed=5)).guess, motion(TIGHT, crowd(3)).guess, np.ones((1, 7)), np.ones(3)):
        assert velocity_error(motion(TIGHT, at, guess).velocity, cold.velocity, at.radii) < 1e-9


def test_reach_changes_the_answer_by_what_it_says():
    """The far spheres of one answer are near ones of the other."""
    at = crowd(20, ratio=1.0)
    near, far = (motion(StokesianDynamics(reach=reach), at).velocity for reach in (100.0, 1.5))
    assert 0 < velocity_error(far, near, at.radii) < 3e-2


@pytest.mark.slow
def test_three_hundred_spheres_of_as_many_radii():
    """Each new ratio of radii takes its own exact series, once."""
    at, taken = crowd(300, ratio=5.0), []
    at = Configuration(centres=at.centres, radii=at.radii * np.random.default_rng(3).uniform(0.98, 1.0, 300))
    assert len(np.unique(at.radii)) == 300
    for _ in range(2):
        began = time.perf_counter()
        found = motion(StokesianDynamics(), at)
        taken.append(time.perf_counter() - began)
    print(f"300 radii: {taken[0]:.1f} s, again {taken[1]:.1f} s, {found.report}")
    assert np.isfinite(found.velocity).all()
    assert found.report.error < 0.2


@pytest.mark.parametrize(("wall", "reach"), [(True, 8.0), (True, 2.0), (False, 2.0)])
def test_the_whole_mobility_by_elimination_is_that_by_columns(monkeypatch, wall, reach):
    """Loads and flow together, near pairs and far ones."""
    centres, radii = grown(np.random.default_rng(5), 6, 2.0, 0.05, 3.0)
    at, loads = Configuration(centres=centres, radii=radii), np.random.default_rng(6).normal(size=(6, 6, 40))
    chosen = StokesianDynamics(tolerance=1e-12, reach=reach)
    prepared = chosen.prepare(chosen.plan(Setting(viscosity=2.0, shear_rate=3.0, wall=wall)), at)
    eliminated = chosen.solve(prepared, loads)
    single = chosen.solve(prepared, loads[:, :, 7])
    assert eliminated.velocity[:, :, 7] == pytest.approx(single.velocity, abs=1e-9)
    assert eliminated.report.iterations == 0
    monkeypatch.setattr(solving, "DENSE", 0)
    by_columns = chosen.solve(prepared, loads)
    assert by_columns.report.iterations > 0
    assert by_columns.velocity == pytest.approx(eliminated.velocity, abs=1e-9)


PEAK = """
import json, re, sys
from pathlib import Path
import numpy as np
from mpad_core.interfaces.values import Configuration, Setting
from mpad_sd import StokesianDynamics
count = int(sys.argv[1])
rng, side = np.random.default_rng(count), int(np.ceil(np.sqrt(count)))
i, j = np.divmod(np.arange(count), side)
flat = 6.0 * np.column_stack([i, j]) + rng.uniform(-1.5, 1.5, (count, 2))
at = Configuration(centres=np.column_stack([flat, rng.uniform(1.01, 3, count)]), radii=np.ones(count))
chosen = StokesianDynamics(tolerance=1e-2)
found = chosen.solve(chosen.prepare(chosen.plan(Setting(viscosity=1.0, shear_rate=1.0)), at), np.zeros((count, 6)))
# the most that this program has held; getrusage would tell that of the process that started it
peak = re.search(r"VmHWM:\\s*(\\d+)", Path("/proc/self/status").read_text())
print(json.dumps([int(peak[1]) / 1024, found.report.residual]))
"""


@pytest.mark.slow
def test_memory_grows_as_the_number_of_spheres():
    peaks = []
    for count in (2, 2000, 4000):
        done = subprocess.run([sys.executable, "-c", PEAK, str(count)], capture_output=True, text=True, check=True)
        peaks.append(json.loads(done.stdout)[0])
    print(f"MB with 2, 2000 and 4000 spheres: {peaks}")
    assert peaks[2] - peaks[0] < 2.6 * (peaks[1] - peaks[0])
