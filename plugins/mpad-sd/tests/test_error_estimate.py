"""The error that `sd` reports is seldom below the true one, and seldom far above it: shear, loads, both."""

import numpy as np
import pytest

from mpad_core import solver
from mpad_core.interfaces.values import Configuration, Setting
from spheres import grown, two_at_the_wall, velocity_error


def near_two(rng):
    """Give two spheres near each other and the wall, radii to 5:1."""
    return *two_at_the_wall(rng, rng.choice([1.0, 2.0, 5.0])), True


def near_few(rng):
    """Give two to four spheres near each other, and the wall if there is one, radii to 3:1."""
    wall = bool(rng.random() < 0.75)
    return *grown(rng, int(rng.integers(2, 5)), rng.choice([1.0, 3.0]), 1e-3, 3.0, wall), wall


def spread(rng):
    """Give five to twelve spheres at some distance from each other, radii to 2:1."""
    return *grown(rng, int(rng.integers(5, 13)), rng.choice([1.0, 2.0]), 0.3, 6.0), True


def crowd(rng):
    """Give eight to twelve spheres near each other and the wall, radii to 2:1: some are far in between."""
    return *grown(rng, int(rng.integers(8, 13)), rng.choice([1.0, 2.0]), 1e-3, 1.0), True


CERTAIN = {
    near_two: 1e-4,
    near_few: 1e-4,
    crowd: 1e-4,
    spread: 1e-5,
}  # of the reference, a hundredth of what is looked for


QUANTILES = (0, 0.03, 0.5, 0.97, 1)


def sample(kind, chosen, seed):
    """Give the true and the reported error of one random case."""
    rng, reference = np.random.default_rng(seed), solver("cdl-biem", accuracy=CERTAIN[kind], tolerance=1e-7)
    centres, radii, wall = kind(rng)
    unit = 6 * np.pi * np.column_stack([radii, radii**2]).repeat(3, axis=1)  # moves spheres about as fast as shear
    loads = (0 if seed % 3 == 0 else 1) * unit * rng.normal(size=(len(radii), 6))
    setting = Setting(viscosity=1.0, shear_rate=0.0 if seed % 3 == 1 else 1.0, wall=wall)
    at = Configuration(centres=centres, radii=radii)
    found, true = (each.solve(each.prepare(each.plan(setting), at), loads) for each in (chosen, reference))
    return velocity_error(found.velocity, true.velocity, radii), found.report.error


def ratios(kind, chosen, seeds):
    """Give reported over true errors, and print how they are spread; a reference as wrong as that tells nothing."""
    rows = np.array([sample(kind, chosen, seed) for seed in seeds])
    true, reported = np.maximum(rows[:, 0], CERTAIN[kind]), rows[:, 1]
    found = reported / true
    print(f"{kind.__name__}, reach {chosen.reach}: reported/true at {QUANTILES}: {np.quantile(found, QUANTILES)}")
    print(f"    true 50, 97, 100 %: {np.quantile(true, (0.5, 0.97, 1))}; covered {(found >= 1).mean():.3f}")
    for k, flow in enumerate(("shear", "loads", "both")):
        part = found[np.array(seeds) % 3 == k]
        print(f"    {flow}: median {np.median(part):.2f}, least {part.min():.2f}, covered {(part >= 1).mean():.3f}")
    return found


CROWDED = [pytest.param(crowd, reach, marks=pytest.mark.slow) for reach in (1.5, 8.0)]
MANY = [pytest.mark.long, pytest.mark.timeout(1800)]


@pytest.mark.parametrize("count", [30, pytest.param(300, marks=MANY)], ids=["some", "many"])
@pytest.mark.parametrize(
    ("kind", "reach"),
    [(near_two, 8.0), (near_few, 8.0), (spread, 8.0), (spread, 4.0), (spread, 1.5), *CROWDED],
)
def test_reported_error_covers_the_true_one(kind, reach, count):
    found = ratios(kind, solver("sd", reach=reach), range(count))
    assert (found >= 1).mean() >= (0.97 if count > 100 else 0.9)  # of thirty, three by chance
    assert 1 < np.median(found) < 10


@pytest.mark.parametrize("gap", [1e-7, 1e-9, 1e-12])
def test_what_the_least_gap_feigns_is_told(gap):
    """Below it spheres slide as at the least gap; exactly they would be slower by the logarithm."""
    setting, at = Setting(viscosity=1.0, shear_rate=1.0), {"centres": [[0, 0, 1 + gap]], "radii": [1.0]}
    answers = []
    for name in ("sd", "isolated"):
        chosen = solver(name)
        there = Configuration(**at, wall_gaps=[gap])
        answers.append(chosen.solve(chosen.prepare(chosen.plan(setting), there), np.zeros((1, 6))))
    wrong = velocity_error(answers[0].velocity, answers[1].velocity, np.ones(1))
    assert wrong < 3 * answers[0].report.error < 9 * wrong
    touching = Configuration(centres=[[0, 0, 1]], radii=[1.0])
    sd = solver("sd")
    assert sd.solve(sd.prepare(sd.plan(setting), touching), np.zeros((1, 6))).report.error >= 1
