"""Far spheres exchange moments: as blocks of all harmonics restricted to these, and none between near ones."""

import numpy as np
import pytest

from mpad_core.numerics.harmonics.far import MOMENTS, add_far, far_of, moment_spots, no_far
from mpad_core.numerics.harmonics.image import image_terms
from mpad_core.numerics.harmonics.levels import _selves_of
from mpad_core.numerics.harmonics.pairs import pair_product, pairs_of, places_of

CENTRES = np.array([[0.0, 0.0, 1.7], [2.0, 1.5, 2.9], [-3.0, 0.4, 1.1], [0.5, -4.0, 0.9]])
RADII = np.array([1.0, 0.6, 1.05, 0.2])
EVERY = np.array([[j, i] for i in range(4) for j in range(i)])
DEGREES = np.array([2, 4, 3, 2])


def moments(at):
    return [at.own[i] + spot for i in range(len(at.degrees)) for spot in moment_spots(at.degrees[i])]


def sources(at, seed=0):
    """Give moments and nothing else."""
    y = np.zeros(at.own[-1])
    y[moments(at)] = np.random.default_rng(seed).normal(size=MOMENTS * len(at.degrees))
    return y


def by_harmonics(at, who, wall, y):
    """Give the traces that the listed pairs make on each other by all harmonics."""
    operators, out = np.zeros(0), np.empty_like(y)
    if wall:
        terms = image_terms(int(at.degrees.max())).reshape(3, -1)
        operators = _selves_of(at, CENTRES[:, 2] / RADII, terms)[0]
    pairs = pairs_of(CENTRES, RADII, who, at.degrees[who], wall)
    pair_product(at, pairs, operators, wall, y, out)
    return out


@pytest.mark.parametrize("wall", [True, False])
@pytest.mark.parametrize("near", [[], [0], [1, 3, 4], range(6)], ids=["all far", "one near", "three near", "none far"])
def test_far_pairs_exchange_the_moments_of_harmonics(wall, near):
    at, near = places_of(DEGREES, wall), list(near)
    y, found = sources(at), np.zeros(at.own[-1])
    add_far(at, far_of(CENTRES, RADII, EVERY[near], wall), wall, y, found)
    true = by_harmonics(at, np.delete(EVERY, near, axis=0), wall, y)
    assert found[moments(at)] == pytest.approx(true[moments(at)], abs=1e-14)
    others = np.ones(len(y), bool)
    others[moments(at)] = False
    assert not found[others].any()


@pytest.mark.parametrize("wall", [True, False])
def test_what_far_spheres_do_to_each_other_is_symmetric(wall):
    at, far = places_of(DEGREES, wall), far_of(CENTRES, RADII, EVERY[[2]], wall)
    one, other = sources(at, 1), sources(at, 2)
    works = []
    for source, target in ((one, other), (other, one)):
        out = np.zeros_like(source)
        add_far(at, far, wall, source, out)
        works.append(target @ out)
    assert works[0] == pytest.approx(works[1], rel=1e-12)


def test_without_far_pairs_nothing_is_added():
    at = places_of(DEGREES, True)
    out = np.ones(at.own[-1])
    add_far(at, no_far(), True, sources(at), out)
    assert (out == 1).all()
