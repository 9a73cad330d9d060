"""Layouts of molecules on a cell. Seeds are fixed; a bound fails by chance once in a million seeds, or more rarely."""

from typing import Any

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.distance import pdist

from mpad_core.interfaces.errors import InputError
from mpad_core.numerics.streams import Stream, fill_uniform, key_of
from mpad_core.physics.layouts.around import around
from mpad_core.physics.layouts.clusters import Clusters
from mpad_core.physics.layouts.microvilli import Microvilli
from mpad_core.physics.layouts.uniform import Uniform
from mpad_core.physics.molecules import identity_of, place_sites

RADIUS, SHELL = 5.0, 5.175
TIPS = Microvilli(tips=2.0, tip_radius=0.1)
CLUSTERS = Clusters(cluster_size=50.0, cluster_radius=0.1)
LAYOUTS = [Uniform(), TIPS, CLUSTERS]
RARE = 1e-6


def draws(seed: int) -> Any:
    return lambda sequence, first, number: np.random.default_rng([seed, sequence, first]).random((number, 2))


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: type(layout).__name__)
@pytest.mark.parametrize("number", [0, 1, 28_274])
def test_gives_so_many_unit_vectors(layout: Any, number: int) -> None:
    found = layout.directions(number, RADIUS, SHELL, draws(1))
    assert found.shape == (number, 3)
    assert np.linalg.norm(found, axis=1) == pytest.approx(1, rel=1e-14)


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: type(layout).__name__)
def test_no_direction_is_preferred(layout: Any) -> None:
    """Over 2000 cells, the first molecule of each: chi-square over 6 bands of equal area times 6 sectors."""
    small = Microvilli(tips=0.05, tip_radius=0.1) if layout is TIPS else layout
    first = np.array([small.directions(1, RADIUS, SHELL, draws(seed))[0] for seed in range(2000)])
    band = np.minimum((first[:, 2] + 1) * 3, 5).astype(int)
    sector = np.minimum((np.arctan2(first[:, 1], first[:, 0]) / np.pi + 1) * 3, 5).astype(int)
    assert stats.chisquare(np.bincount(6 * band + sector, minlength=36)).pvalue > RARE


def test_points_around_a_pole() -> None:
    random = np.random.default_rng(2)
    poles = np.concatenate([np.eye(3), -np.eye(3), random.normal(size=(300, 3))])
    poles /= np.linalg.norm(poles, axis=1)[:, None]
    angle, azimuth = random.uniform(1e-4, 3, len(poles)), random.uniform(0, 2 * np.pi, len(poles))
    ends = around(poles, angle, azimuth)
    apart = 2 * np.arcsin(0.5 * np.linalg.norm(ends - poles, axis=1))
    assert apart == pytest.approx(angle, rel=1e-9)
    opposite = around(poles, angle, azimuth + np.pi)
    middle = (ends + opposite) / (2 * np.cos(angle))[:, None]  # on either side of the pole
    assert middle == pytest.approx(poles, abs=1e-12)


# Microvilli


def test_tips_do_not_overlap_and_are_as_many_as_asked() -> None:
    centres = Microvilli(tips=8.0, tip_radius=0.12).centres(RADIUS, SHELL, draws(3))
    assert len(centres) == round(8 * 4 * np.pi * 25)
    assert 2 * np.arcsin(0.5 * pdist(centres).min()) * SHELL > 0.24


def test_molecules_lie_on_tips_anywhere_within_them() -> None:
    centres = TIPS.centres(RADIUS, SHELL, draws(4))
    found = TIPS.directions(28_274, RADIUS, SHELL, draws(4))
    tip = np.argmax(found @ centres.T, axis=1)
    chord = np.linalg.norm(found - centres[tip], axis=1)
    widest = 2 * np.sin(0.5 * 0.1 / SHELL)
    assert chord.max() <= widest * (1 + 1e-9)
    assert stats.kstest((chord / widest) ** 2, "uniform").pvalue > RARE  # Archimedes: area goes with the chord squared
    assert stats.chisquare(np.bincount(tip, minlength=len(centres))).pvalue > RARE


def test_crowded_tips_are_refused() -> None:
    crowded = Microvilli(tips=10.0, tip_radius=0.13)
    with pytest.raises(ValueError, match=r"3142 tips on each cell would cover 0\.50 of it, the most is 0\.45"):
        crowded.directions(10, RADIUS, SHELL, draws(5))
    assert "makes 0 tips" in Microvilli(tips=1e-3, tip_radius=0.1).refusal(RADIUS, SHELL)
    assert "makes 31416 tips" in Microvilli(tips=100.0, tip_radius=1e-3).refusal(RADIUS, SHELL)


def test_tips_without_room_are_refused(problem: Any) -> None:
    with pytest.raises(ValueError, match="no room for more than 1 of 628 tips"):
        TIPS.centres(RADIUS, SHELL, lambda sequence, first, number: np.full((number, 2), 0.3))
    crowded = problem([[0, 0, 6]], layouts=((Microvilli(tips=10.0, tip_radius=0.13),),))
    with pytest.raises(InputError, match="cell 'c0': layout of its sites: its 3142 tips"):
        place_sites(crowded)


# Clusters


def test_pairs_of_clustered_molecules() -> None:
    """How many pairs are within r, over 60 cells, by the law of the Thomas process.

    Two molecules share one of P clusters with chance 1/P; then they are two Gaussian steps apart: within r with chance
    1 − exp(−r²/4σ²). Otherwise they are independent: within r with chance r²/4 (r a chord of the unit sphere).
    """
    number, radii = 2000, np.array([0.5, 1.0, 2.0, 4.0, 20.0]) * 0.1 / SHELL
    within = np.array([_shares(CLUSTERS.directions(number, RADIUS, SHELL, draws(seed)), radii) for seed in range(60)])
    same = 1 / CLUSTERS.count(number)
    assert same == 1 / 40
    expected = same * -np.expm1(-(radii**2) / (4 * (0.1 / SHELL) ** 2)) + (1 - same) * radii**2 / 4
    error = within.std(axis=0, ddof=1) / np.sqrt(len(within))
    assert (np.abs(within.mean(axis=0) - expected) < stats.t.isf(RARE / 10, len(within) - 1) * error).all()
    assert within[:, 1].mean() > 50 * radii[1] ** 2 / 4  # and uniform they are not


def _shares(points: Any, radii: Any) -> Any:
    apart = np.sort(pdist(points))
    return np.searchsorted(apart, radii) / len(apart)


# In a problem


def test_no_draw_serves_twice(problem: Any) -> None:
    """Not in another sequence, of another kind, on another cell; nor does it matter how a sequence is cut."""
    given: list[Any] = []

    class Greedy:
        def directions(self, number: int, radius: float, shell: float, draw: Any) -> Any:
            given.extend(draw(sequence, 0, 3_500) for sequence in range(3))
            assert (draw(1, 700, 50) == given[-2][700:750]).all()
            return np.zeros((number, 3))

    layouts = ((Greedy(), Greedy()),) * 2
    place_sites(problem([[0, 0, 6], [20, 0, 6]], layouts=layouts, site_densities=np.full((2, 2), 9.0)))
    everything = np.concatenate(given).ravel()
    assert len(everything) == 2 * 2 * 3 * 7_000
    assert len(np.unique(everything)) == len(everything)  # of 2^52: two are equal once in 1.2e6 seeds


def test_uniform_molecules_keep_their_bits(problem: Any) -> None:
    """What a cell has had since the first version, written out."""
    asked = problem([[0, 0, 6], [20, 0, 6]], site_densities=np.full((2, 2), 9.0))
    sites, shell = place_sites(asked), 5.175
    for cell, name in enumerate(("c0", "c1")):
        for kind in range(2):
            pairs = np.empty((2827, 2))
            fill_uniform(key_of(1), int(Stream.RECEPTORS), identity_of(name), kind << 40, pairs)
            cosine, azimuth = 2 * pairs[:, 0] - 1, 2 * np.pi * pairs[:, 1]
            sine = np.sqrt(1 - cosine**2)
            expected = shell * np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1)
            start = (2 * cell + kind) * 2827
            assert (sites.arm[start : start + 2827] == expected).all()


def test_a_cell_has_the_same_molecules_whichever_others_are_there(problem: Any) -> None:
    layouts = ((TIPS, CLUSTERS), (CLUSTERS, Uniform()), (Uniform(), TIPS))
    sparse = np.full((3, 2), 9.0)
    asked = problem([[0, 0, 6], [20, 0, 6], [40, 0, 6]], layouts=layouts, site_densities=sparse)
    whole = place_sites(asked)
    for chosen in ([2], [2, 0], [1, 2]):
        part = place_sites(asked.only(chosen))
        for place, cell in enumerate(chosen):
            own = part.arm[part.first[place] : part.first[place + 1]]
            assert (own == whole.arm[whole.first[cell] : whole.first[cell + 1]]).all()


def test_kinds_on_a_cell_do_not_share_tips_and_cells_do_not_either(problem: Any) -> None:
    asked = problem([[0, 0, 6], [20, 0, 6]], layouts=((TIPS, TIPS), (TIPS, TIPS)), site_densities=np.full((2, 2), 9.0))
    sites = place_sites(asked)
    firsts = [sites.arm[i * 2827] for i in range(4)]
    assert len({tuple(np.round(arm, 6)) for arm in firsts}) == 4
    assert np.linalg.norm(sites.arm, axis=1) == pytest.approx(SHELL, rel=1e-13)
