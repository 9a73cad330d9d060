"""The reported error is about the true one: random spheres, radii, gaps, flows, loads and accuracies."""

import numpy as np
import pytest
from scipy.stats import spearmanr

from mpad_cdlbiem import CdlBiem
from mpad_core.interfaces.values import Configuration, Setting

ACCURACIES = (1e-2, 1e-3, 1e-4)
LOW, HIGH = np.log([1e-3, 3.0])


def configuration(rng, wall):
    """Grow two to four spheres one upon another, gaps log-uniform over radii, half of them so from the wall too."""
    count, ratio = rng.integers(2, 5), rng.choice([1.0, 3.0])
    centres, radii, gaps = np.empty((0, 3)), np.empty(0), np.empty(0)
    while len(radii) < count:
        a = ratio ** -rng.random()
        to_wall, between = a * np.exp(rng.uniform(LOW, HIGH, 2))
        centre, gap = np.array([0, 0, a + to_wall]), to_wall
        if len(radii):
            j, offset = rng.integers(len(radii)), rng.normal(size=3)
            reach = a + radii[j] + between
            offset *= reach / np.linalg.norm(offset)
            drop = centre[2] - centres[j, 2]
            if wall and rng.random() < 0.5 and abs(drop) < reach:
                offset[:2] *= np.sqrt(reach**2 - drop**2) / np.linalg.norm(offset[:2])
                offset[2] = drop
            else:
                gap = centres[j, 2] + offset[2] - a
            centre = centres[j] + offset
        apart = np.linalg.norm(centres - centre, axis=1) - radii - a
        if (gap > 1e-3 * a or not wall) and (apart > 1e-3 * a).all():
            centres, radii, gaps = np.vstack([centres, centre]), np.append(radii, a), np.append(gaps, gap)
    return Configuration(centres=centres, radii=radii, wall_gaps=gaps)


def loads_on(radii, kind, rng):
    """Give no loads, or random ones that move spheres about as fast as shear does."""
    unit = 6 * np.pi * np.column_stack([radii, radii**2]).repeat(3, axis=1)
    return np.zeros((len(radii), 6)) if kind == "shear" else unit * rng.normal(size=(len(radii), 6))


def solved(setting, at, loads, **parameters):
    solver = CdlBiem(**parameters)
    return solver.solve(solver.prepare(solver.plan(setting), at), loads)


def sample(seed):
    """Give the accuracy, the true and the reported error of one random case."""
    rng = np.random.default_rng(seed)
    wall, kind = rng.random() < 0.75, rng.choice(["shear", "loads", "both"])
    at = configuration(rng, wall)
    setting = Setting(viscosity=1.0, shear_rate=0.0 if kind == "loads" else 1.0, wall=bool(wall))
    loads = loads_on(at.radii, kind, rng)
    accuracy = ACCURACIES[seed % 3]
    found = solved(setting, at, loads, accuracy=accuracy)
    true = solved(setting, at, loads, degree=32, accuracy=1e-8, tolerance=1e-10).velocity
    weights = np.column_stack([np.ones_like(at.radii), at.radii]).repeat(3, axis=1)
    error = np.linalg.norm(weights * (found.velocity - true)) / np.linalg.norm(weights * true)
    return accuracy, error, found.report.error


@pytest.mark.parametrize(
    "count", [39, pytest.param(300, marks=[pytest.mark.long, pytest.mark.timeout(1200)])], ids=["some", "many"]
)
def test_reported_error_is_about_the_true_one(count):
    """The bars: true error within three times the reported one in 95 %, median within ten, ranks alike."""
    rows = np.array([sample(seed) for seed in range(count)])
    true, reported = rows[:, 1:].T
    covered = (true <= 3 * reported).mean()
    ranks = spearmanr(true, reported).statistic
    for accuracy in ACCURACIES:
        ratio = (reported / true)[rows[:, 0] == accuracy]
        print(f"{accuracy:.0e}: reported/true 5, 50, 95 %: {np.quantile(ratio, (0.05, 0.5, 0.95))}")
        print(f"       true 50, 95, 100 %: {np.quantile(true[rows[:, 0] == accuracy], (0.5, 0.95, 1.0))}")
    print(f"covered {covered:.3f}, ranks {ranks:.3f}; not covered: {np.flatnonzero(true > 3 * reported).tolist()}")
    assert covered >= 0.95
    assert 0.1 < np.median(reported / true) < 10
    assert ranks >= 0.7
