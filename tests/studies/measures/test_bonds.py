"""Bonds from tables of events: by hand, against a plain replay, and for a process that is solved."""

import math

import numpy as np
import pytest

from mpad_core.studies.measures.bonds import (
    CellBonds,
    bond_number,
    bond_number_deviation,
    bond_number_shares,
    bonds_of,
    lifetime,
    lives_of,
    rupture_force,
    rupture_forces,
)
from mpad_core.studies.measures.estimates import estimate

FORMED, BROKEN, CHANGED = 0, 1, 2


@pytest.fixture
def lives(events):
    return lives_of(
        events([
            (0.0, FORMED, 0, 1), (1.0, FORMED, 0, 2), (1.5, FORMED, 1, 1), (2.0, CHANGED, 0, 1),
            (2.0, BROKEN, 0, 1, -1, 30.0), (3.0, FORMED, 0, 1), (3.0, FORMED, 0, 7, 1), (3.5, BROKEN, 0, 2, -1, 50.0),
            (4.0, BROKEN, 0, 7, 1, 9.0),
        ])
    )  # fmt: skip


@pytest.fixture
def wall(lives):
    return bonds_of(lives, ["a", "b"], {"a": np.array([0.0, 2.0, 4.0]), "b": np.array([0.0, 2.0, 4.0])})


def test_lives(lives):
    assert lives["formed"].tolist() == [0, 1, 1.5, 3, 3]
    assert lives["broken"].tolist() == [2, 3.5, math.inf, math.inf, 4]
    assert lives["cell"].tolist() == [0, 0, 1, 0, 0]
    assert lives["partner"].tolist() == [-1, -1, -1, -1, 1]
    assert lives["force"].tolist() == pytest.approx([30, 50, math.nan, math.nan, 9], nan_ok=True)


def test_lives_agree_with_a_plain_replay(events):
    random, alive, rows, expected = np.random.default_rng(5), {}, [], []
    for time in np.arange(500.0):
        bond = (int(random.integers(3)), int(random.integers(10)))
        rows.append((time, BROKEN if bond in alive else FORMED, *bond))
        if bond in alive:
            expected.append((alive.pop(bond), time, bond[0]))
        else:
            alive[bond] = time
    expected += [(formed, math.inf, bond[0]) for bond, formed in alive.items()]
    found = lives_of(events(rows))
    assert [(float(f), float(b), int(c)) for f, b, c in found[["formed", "broken", "cell"]]] == sorted(expected)


def test_no_events_no_lives(events):
    assert len(lives_of(events([]))) == 0
    (nobody,) = bonds_of(lives_of(events([])), ["a"], {"a": np.array([0.0, 1.0])})
    assert nobody.number_integral().tolist() == [0.0]
    assert bond_number_shares([nobody]).tolist() == [1.0]
    assert math.isnan(rupture_force([nobody]).value())


def test_numbers_are_averaged_over_time(wall):
    """Of the first cell 1, 2, 1, 2, 1 from 0, 1, 2, 3, 3.5 s on; of the second 0, 1 from 0, 1.5 s on."""
    assert wall[0].number_integral().tolist() == [3.0, 2.5]
    assert wall[0].number_integral(2).tolist() == [5.0, 3.5]
    assert bond_number(wall).value() == pytest.approx((5.5 + 2.5) / 8)
    assert bond_number_deviation(wall).value() == pytest.approx(math.sqrt((8.5 + 2.5) / 8 - 1))
    assert bond_number_shares(wall).tolist() == pytest.approx([1.5 / 8, 5 / 8, 1.5 / 8])


def test_bonds_between_cells_are_counted_apart_and_for_both(lives, wall):
    edges = {"a": np.array([0.0, 4.0]), "b": np.array([0.0, 4.0])}
    both = bonds_of(lives, ["a", "b"], edges, between_cells=True)
    assert [b.number_integral().tolist() for b in both] == [[1.0], [1.0]]
    assert [len(b.lives) for b in wall] == [3, 1]


def test_forces_and_lifetimes(wall):
    assert [f.tolist() for f in rupture_forces(wall)] == [[30, 50], []]
    assert rupture_force(wall).value() == 40
    assert lifetime(wall).series[0].tolist() == [[3.0, 1.0], [2.5, 1.0]]  # one broke just at 2 s, an interval's end
    assert lifetime(wall).value() == pytest.approx(8 / 2)  # 8 s of bonds were seen, two of which broke


def test_what_happens_outside_of_the_time_watched_does_not_count(lives):
    (late,) = bonds_of(lives, ["a"], {"a": np.array([2.5, 3.25])})
    assert late.number_integral().tolist() == [pytest.approx(0.5 + 0.5)]
    assert len(late.ruptures()) == 0
    assert late.most() == 2


def test_a_process_that_is_solved(events):
    """Bonds that form at 10 1/s and live 0.5 s on average: their number is Poisson's, of mean and variance 5.

    Over T the mean number has the variance 2 · 5 · 0.5 / T, the lifetime 0.5² / (10 T) but for edges. 5 sd: 6e-7.
    """
    span, cells = 400.0, 4
    random, found = np.random.default_rng(9), []
    for cell in range(cells):
        formed = np.sort(random.uniform(-10, span, round(random.poisson(10 * (span + 10)))))
        broken = formed + random.exponential(0.5, len(formed))
        rows = [(t, FORMED, 0, k) for k, t in enumerate(formed)] + [
            (t, BROKEN, 0, k, -1, random.exponential(80.0)) for k, t in enumerate(broken) if t < span
        ]
        lives = lives_of(events(sorted(rows)))
        found.append(CellBonds(lives=lives, times=np.linspace(0, span, 4001), cell="a", run=str(cell)))
    total = span * cells
    number, forces, lasting = (estimate(f(found)) for f in (bond_number, rupture_force, lifetime))
    assert abs(number.value - 5) < 5 * math.sqrt(5 / total)
    assert abs(lasting.value - 0.5) < 5 * 0.5 / math.sqrt(10 * total)
    assert abs(forces.value - 80) < 5 * 80 / math.sqrt(10 * total)
    # widths: as known, to within 40 %, five times what a hundred blocks leave of them
    for one, spread in ((number, math.sqrt(5 / total)), (forces, 80 / math.sqrt(10 * total))):
        assert one.high - one.low == pytest.approx(2 * 1.96 * spread, rel=0.4)
    assert abs(bond_number_deviation(found).value() - math.sqrt(5)) < 0.1
    poisson = np.exp(-5) * 5.0 ** np.arange(10) / np.array([math.factorial(n) for n in range(10)])
    # a share p has a variance of at most 2 · p · τ / T with τ below the lifetime
    assert np.abs(bond_number_shares(found)[:10] - poisson).max() < 5 * math.sqrt(2 * 0.18 * 0.5 / total)
