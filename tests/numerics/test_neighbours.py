"""Near pairs and the closest one, against all distances."""

import numpy as np
import pytest

from mpad_core.numerics.neighbours import closest_pair, near_pairs


def spheres(count, seed):
    rng = np.random.default_rng(seed)
    return rng.uniform(-8, 8, (count, 3)), rng.uniform(0.2, 2, count)


def all_gaps(centres, radii):
    return np.linalg.norm(centres[:, None] - centres[None], axis=2) - radii[:, None] - radii[None]


@pytest.mark.parametrize("reach", [0.0, 1.5, 1e3])
@pytest.mark.parametrize("count", [1, 2, 60])
def test_near_pairs_are_those_within_reach_smaller_first(count, reach):
    centres, radii = spheres(count, count)
    i, j = np.triu_indices(count, 1)
    within = all_gaps(centres, radii)[i, j] < reach * np.minimum(radii[i], radii[j])
    found = near_pairs(centres, radii, reach)
    assert {frozenset(pair) for pair in found.tolist()} == set(map(frozenset, zip(i[within], j[within], strict=True)))
    assert len(found) == within.sum()
    assert (radii[found[:, 0]] <= radii[found[:, 1]]).all()


def test_closest_pair():
    centres, radii = spheres(40, 3)
    gaps = all_gaps(centres, radii) + np.diag(np.full(40, np.inf))
    i, j, gap = closest_pair(centres, radii)
    assert gap == pytest.approx(gaps.min(), rel=1e-12)
    assert gap == pytest.approx(gaps[i, j], rel=1e-12)
    assert i < j


def test_one_sphere_has_no_pair():
    assert closest_pair(np.zeros((1, 3)), np.ones(1))[2] == np.inf
    assert near_pairs(np.zeros((1, 3)), np.ones(1), 1.0).shape == (0, 2)


def test_gap_of_spheres_in_contact_keeps_its_digits():
    gap = closest_pair(np.array([[0, 0, 0], [0, 0, 2 + 1e-12]]), np.ones(2))[2]
    assert gap == pytest.approx(1e-12, abs=5e-16)
