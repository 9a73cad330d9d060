"""Bond laws: detailed balance, energy, reach, and the hazard against a sum over molecules."""

from typing import Any

import numpy as np
import pytest
from attrs import evolve
from scipy.integrate import quad

from mpad_core.numerics.tables import value
from mpad_core.physics.measures import dx_of, hazards
from mpad_core.physics.reactions import TABLE_ERROR, BondLaw, hazard_table

BALANCED = ["bell", "soft bell", "ideal", "catch-slip", "stiffening"]
BOTH = pytest.mark.parametrize("compression", ["slack", "linear"])


def lengths_of(law: BondLaw) -> Any:
    """From nothing to where the Boltzmann factor has fallen to 1e-9."""
    return np.concatenate([np.linspace(0, law.species.rest_length, 50), np.linspace(0, 1, 151) * law.reach()])


def energy_of(law: BondLaw, length: float) -> float:
    """The tension integrated by other means, with every kink told."""
    rest = law.species.rest_length
    if law.species.compression == "slack" and length <= rest:
        return 0.0
    kinks = [b for b in law.species.model.breakpoints() if min(rest, length) < b < max(rest, length)]
    pull = law.species.model.tension
    return float(quad(lambda x: float(pull(np.array([x]))[0]), rest, length, points=kinks or None, epsrel=1e-11)[0])


@BOTH
@pytest.mark.parametrize("model", [*BALANCED, "eternal"])
def test_energy_is_the_integral_of_the_tension(species: Any, model: str, compression: str) -> None:
    law = BondLaw(species=species(model, compression=compression))
    lengths = lengths_of(law)
    expected = [energy_of(law, float(x)) for x in lengths]
    scale = law.species.kT
    assert law.energy(lengths) == pytest.approx(expected, rel=1e-9, abs=1e-9 * scale)


@BOTH
@pytest.mark.parametrize("model", BALANCED)
def test_detailed_balance_at_every_length(species: Any, model: str, compression: str) -> None:
    """k_on / k_off = K exp(−E / kT), K from the unstressed bond: section 3, item 4 of the physics notes."""
    law = BondLaw(species=species(model, compression=compression))
    lengths = lengths_of(law)
    energy = np.array([energy_of(law, float(x)) for x in lengths])
    unstressed = float(law.species.model.off_rate(np.array([law.species.rest_length]))[0])
    ratio = law.on_rate(lengths) / law.off_rate(lengths)
    assert ratio == pytest.approx(84.0 / unstressed * np.exp(-energy / law.species.kT), rel=1e-8)


@BOTH
def test_bells_on_rate_in_closed_form(species: Any, compression: str) -> None:
    """k_f = k_f0 exp[σ |x−λ| (r0 − |x−λ|/2) / kT]."""
    law = BondLaw(species=species("bell", compression=compression))
    x = np.linspace(0.028, 0.0315, 100)
    strain = np.maximum(x - 0.03, 0) if compression == "slack" else np.abs(x - 0.03)
    assert law.on_rate(x) == pytest.approx(84 * np.exp(1e5 * strain * (4e-5 - strain / 2) / law.species.kT), rel=1e-9)


def test_slack_bonds_feel_nothing_and_linear_ones_push(species: Any) -> None:
    slack, linear = (BondLaw(species=species("bell", compression=c)) for c in ("slack", "linear"))
    x = np.linspace(0, 0.0299, 20)
    assert (slack.tension(x) == 0).all()
    assert (slack.off_rate(x) == 2.0).all()
    assert (slack.energy(x) == 0).all()
    assert linear.tension(x) == pytest.approx(1e5 * (x - 0.03))
    assert (linear.off_rate(x) > 2.0).all()
    y = np.linspace(0.03, 0.05, 20)
    assert (slack.tension(y) == linear.tension(y)).all()


@pytest.mark.parametrize("model", BALANCED)
def test_beyond_reach_the_on_rate_is_negligible_and_within_it_is_not(species: Any, model: str) -> None:
    law = BondLaw(species=species(model))
    reach, rest = law.reach(), law.species.rest_length
    most = law.on_rate(np.linspace(0, reach, 2000)).max()
    assert reach > rest
    assert (law.on_rate(np.linspace(reach, 3 * reach, 500)) <= 1e-9 * most).all()
    assert law.on_rate(np.array([rest + 0.98 * (reach - rest)]))[0] > 1e-9 * most


def test_reach_of_a_gaussian_tail(species: Any) -> None:
    """Ideal bond: exp(−σ s²/2kT) = 1e-9 at s = sqrt(2 kT/σ ln 1e9)."""
    law = BondLaw(species=species("ideal"))
    assert law.reach() - 0.03 == pytest.approx(np.sqrt(2 * law.species.kT / 1e3 * np.log(1e9)), rel=5e-3)


def test_no_on_rate_reaches_to_the_unstressed_length(species: Any) -> None:
    assert BondLaw(species=species("bell", on_rate=0.0)).reach() == 0.03


def test_an_own_on_rate_is_respected(species: Any) -> None:
    law = BondLaw(species=species("own rate", compression="linear"))
    x = np.linspace(0, 0.1, 30)
    assert (law.on_rate(x) == law.species.model.on_rate(x)).all()
    tables = law.tables()[0]
    for at in (0.045, 0.05, 0.07):
        assert value(tables, 0, 2, at) == pytest.approx(7 / (1 + (at / 0.05) ** 8), rel=2 * TABLE_ERROR)


@BOTH
def test_a_bond_that_never_breaks_is_legal(species: Any, compression: str) -> None:
    law = BondLaw(species=species("eternal", compression=compression))
    x = lengths_of(law)
    assert law.on_rate(x) == pytest.approx(84 * np.exp(-law.energy(x) / law.species.kT))
    tables = law.tables()[0]
    assert all(value(tables, 0, 1, float(at)) == 0 for at in x)


@BOTH
@pytest.mark.parametrize("model", [*BALANCED, "own rate", "eternal"])
def test_tables_follow_the_law(species: Any, model: str, compression: str) -> None:
    law = BondLaw(species=species(model, compression=compression))
    tables, edges = law.tables()[0], law.edges()
    x = np.random.default_rng(3).uniform(edges[0], min(edges[-1], 2 * law.reach()), 1500)
    x = np.concatenate([x, np.nextafter(edges, 0), edges[:-1], np.nextafter(edges[:-1], 1)])
    x = x[(x >= edges[0]) & (x < edges[-1])]
    functions = (law.tension, law.off_rate, lambda s: np.where(s <= law.reach(), law.on_rate(s), 0.0))
    for column, function in enumerate(functions):
        found = np.array([value(tables, 0, column, float(at)) for at in x])
        expected = function(x)
        negligible = (1.001e-9 if column == 2 else 1e-12) * np.abs(expected).max()  # on-rates end where they are
        near = np.abs(found - expected) <= 2 * TABLE_ERROR * np.abs(expected) + negligible
        at_reach = (column == 2) & (np.abs(x - law.reach()) < 1e-15)  # the jump itself may fall to either side
        assert (near | at_reach).all()


def test_tension_goes_on_by_its_tangent(species: Any) -> None:
    tables = BondLaw(species=species("bell")).tables()[0]
    assert value(tables, 0, 0, 20.0) == pytest.approx(1e5 * (20 - 0.03), rel=1e-6)


# The hazard


def spread_evenly(law: BondLaw, centre: float, shell: float, tips: float, per_area: float, density: float) -> float:
    """Sum the rates of very many molecules spread evenly over the shell, at the heights of equal slices of it."""
    n = 4_000_000
    z = centre + shell * (2 * (np.arange(n) + 0.5) / n - 1)
    gap = z[z - tips < law.reach()] - tips
    species = law.species
    if species.reach == "pairs":
        x = np.linspace(0, law.reach(), 40_001)
        weight = law.on_rate(x) * x
        mean = 0.5 * (weight[1:] + weight[:-1]) * np.diff(x)
        inner = np.concatenate([[0], np.cumsum(mean)])
        rates = 2 * np.pi * density * (inner[-1] - np.interp(np.abs(gap), x, inner))
    else:
        least = species.rest_length if species.reach == "overlap" and species.compression == "linear" else 0.0
        rates = law.on_rate(np.maximum(np.abs(gap), least)) * density / species.at_density
    return float(rates.sum() * 4 * np.pi * shell**2 * per_area / n)


@BOTH
@pytest.mark.parametrize("reach", ["overlap", "pairs", "boltzmann_gap"])
@pytest.mark.parametrize("overlap", [-0.025, -0.01, -1e-3, 2e-3])
def test_hazard_is_the_sum_over_many_molecules(
    species: Any, problem: Any, reach: str, compression: str, overlap: float
) -> None:
    made = species("ideal", reach=reach, compression=compression, density=60.0)
    asked = problem([[0, 0, 5.255 + overlap]], species=(made,))
    found = hazards(asked).at(asked.start)[0]
    shell, per_area = 5.175, 90 * (5 / 5.175) ** 2
    expected = spread_evenly(BondLaw(species=made), 5.255 + overlap, shell, 0.05, per_area, 60.0)
    assert found == pytest.approx(expected, rel=1e-3)  # 4e6 slices: at least 700 of them in a gap of 2 nm


def test_hazard_far_away_is_zero(species: Any, problem: Any) -> None:
    asked = problem([[0, 0, 5.5], [20, 0, 400.0]], species=(species("bell"),))
    assert (hazards(asked).at(asked.start) == 0).all()


def test_hazard_scales_with_the_on_rate(species: Any, problem: Any) -> None:
    asked = problem([[0, 0, 5.24]], species=(species("bell"),))
    assert hazards(asked, 8.4).at(asked.start) == pytest.approx(hazards(asked).at(asked.start) / 10, rel=1e-12)
    other = problem([[0, 0, 5.24]], species=(species("bell", on_rate=8.4),))
    assert hazards(asked, 8.4).at(asked.start) == pytest.approx(hazards(other).at(asked.start), rel=1e-9)


def test_hazard_of_another_on_rate_where_the_scenes_is_zero(species: Any, problem: Any) -> None:
    """A run whose bonds are switched off by their on-rate still asks what other on-rates would give."""
    off = problem([[0, 0, 5.24]], species=(species("bell", on_rate=0.0),))
    on = problem([[0, 0, 5.24]], species=(species("bell", on_rate=8.4),))
    assert hazards(off, 8.4).at(off.start) == pytest.approx(hazards(on).at(on.start), rel=1e-6)


def test_hazard_counts_species_and_kinds(species: Any, problem: Any) -> None:
    one, two = species("bell"), species("ideal", site_kind=1)
    densities = np.array([[90.0, 30.0]])
    asked = problem([[0, 0, 5.24]], species=(one, two), hazard_densities=densities, site_densities=densities)
    single = problem([[0, 0, 5.24]], species=(one,), hazard_densities=densities[:, :1])
    other = problem([[0, 0, 5.24]], species=(evolve(two, site_kind=0),), hazard_densities=densities[:, 1:])
    total = hazards(single).at(asked.start) + hazards(other).at(asked.start)
    assert hazards(asked).at(asked.start) == pytest.approx(total, rel=1e-12)


def test_no_species_no_hazard(problem: Any) -> None:
    assert (hazards(problem([[0, 0, 5.24]])).at(np.array([[0, 0, 5.24]])) == 0).all()


def test_hazard_table_falls_with_the_gap(species: Any) -> None:
    table = hazard_table(BondLaw(species=species("bell")))
    assert (np.diff(table.integral) <= 0).all()
    assert table.integral[-1] == 0


def test_dx_is_measured_from_the_partner_or_from_its_place(problem: Any) -> None:
    asked = problem([[0, 0, 6], [-30, 0, 6]], partner=np.array([-1, 0]), dx_from=np.array([2.0, 0.0]))
    moved = np.array([[5.0, 0, 6], [-20, 0, 6]])
    assert (dx_of(asked, moved) == [3.0, -25.0]).all()
    alone = asked.only([1])
    assert (dx_of(alone, moved[1:]) == [-20.0]).all()
