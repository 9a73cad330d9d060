"""The cells' molecules: how many, where, and whose. Seeds are fixed; bounds are passed once in 1e4 tries by chance."""

from typing import Any

import numpy as np
import pytest
from scipy import stats

from mpad_core.physics.molecules import identity_of, place_sites, site_counts

DENSITIES = np.array([[90.0, 33.3], [0.0, 10.0], [450.0, 0.0]])


@pytest.fixture(scope="module")
def asked(problem: Any) -> Any:
    return problem(
        [[0, 0, 6], [20, 0, 6], [40, 0, 9]],
        radii=np.array([5.0, 5.0, 7.0]),
        roughness=np.array([0.175, 0.0, 0.3]),
        site_densities=DENSITIES,
        hazard_densities=DENSITIES,
    )


def test_counts(asked: Any) -> None:
    area = 4 * np.pi * np.array([25, 25, 49])
    assert (site_counts(asked) == np.rint(DENSITIES * area[:, None])).all()
    sites = place_sites(asked)
    assert (np.diff(sites.first) == site_counts(asked).sum(axis=1)).all()
    assert len(sites.arm) == len(sites.kind) == sites.first[-1]
    for cell in range(3):
        kinds = sites.kind[sites.first[cell] : sites.first[cell + 1]]
        assert (np.bincount(kinds, minlength=2) == site_counts(asked)[cell]).all()


def test_they_sit_on_the_tips_of_the_bumps(asked: Any) -> None:
    sites = place_sites(asked)
    for cell, shell in enumerate((5.175, 5.0, 7.3)):
        arms = sites.arm[sites.first[cell] : sites.first[cell + 1]]
        assert np.linalg.norm(arms, axis=1) == pytest.approx(shell, rel=1e-14)


def test_they_are_uniform_on_the_sphere(asked: Any) -> None:
    sites = place_sites(asked)
    arms = sites.arm[sites.first[2] :] / 7.3
    assert len(arms) == 277_088
    for axis in range(3):  # Archimedes: each coordinate is uniform
        assert stats.kstest(arms[:, axis], "uniform", args=(-1, 2)).pvalue > 1e-4
    azimuth = np.arctan2(arms[:, 1], arms[:, 0])
    assert stats.kstest(azimuth, "uniform", args=(-np.pi, 2 * np.pi)).pvalue > 1e-4
    assert abs(np.corrcoef(arms[:, 2], azimuth)[0, 1]) * np.sqrt(len(arms)) < 4.5


def test_kinds_and_cells_do_not_share_places(asked: Any) -> None:
    arms = place_sites(asked).arm
    directions = arms / np.linalg.norm(arms, axis=1)[:, None]
    assert len(np.unique(np.round(directions, 9), axis=0)) == len(arms)


def test_a_cell_has_the_same_molecules_whichever_others_are_there(asked: Any) -> None:
    whole = place_sites(asked)
    for chosen in ([2], [2, 0], [1, 2]):
        part = place_sites(asked.only(chosen))
        for place, cell in enumerate(chosen):
            own = part.arm[part.first[place] : part.first[place + 1]]
            assert (own == whole.arm[whole.first[cell] : whole.first[cell + 1]]).all()


def test_another_seed_gives_other_places(problem: Any) -> None:
    first, second = (place_sites(problem([[0, 0, 6]], seed=seed)).arm for seed in (1, 2))
    assert first.shape == second.shape
    assert not np.isclose(first, second).all(axis=1).any()


def test_no_molecules_at_all(problem: Any) -> None:
    sites = place_sites(problem([[0, 0, 6]], site_densities=np.zeros((1, 0))))
    assert sites.arm.shape == (0, 3)
    assert sites.first.tolist() == [0, 0]


def test_identities_of_names_differ() -> None:
    names = [f"{stem}-{i}" for stem in ("free", "cell", "a", "ß") for i in range(500)] + [
        "",
        "a",
        "ab",
        "abcd",
        "abcde",
    ]
    assert len({int(identity_of(name)) for name in names}) == len(names)
