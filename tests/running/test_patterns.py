"""The wall's local density in the burst: bonds only where there are sites, and as often as there are many.

Seeds are fixed. Each statistical bound would be broken by chance once in 1e6 tries or less.
"""

from typing import Any, ClassVar

import numpy as np
import pytest
from attrs import evolve, frozen

from mpad_core.arrays import Array
from mpad_core.numerics.rotations import matrix_of
from mpad_core.physics.reactions import BondLaw
from mpad_core.running.places import SQUARE, ligand_at, ligands_of

REACHES = ["overlap", "boltzmann_gap", "pairs"]
PERIOD, GRID = 0.4, 0.02  # µm


@frozen(kw_only=True)
class Stripes:
    """Stripes across the flow, with a share of the sites between them."""

    name: ClassVar[str] = "stripes"
    most: float = 180.0
    between: float = 0.0

    def density(self, x: Array, y: Array) -> Array:
        return np.where(np.mod(x, PERIOD) < PERIOD / 2, self.most, self.between) + 0 * y

    def densest(self) -> float:
        return 180.0

    def resolution(self) -> float:
        return GRID


def machine_of(lab: Any, reach: str, surface: Any, keys: str, **words: Any) -> Any:
    bond = {"reach": reach, "stiffness": 1e3, "on_rate": 1e-4, "off_rate": 0} | words.pop("bond", {})
    problem = lab.problem({"a": keys}, bond=bond, **words)
    problem = evolve(problem, species=(evolve(problem.species[0], surface=surface),))
    return lab.ready(problem, sub_step=5e-4, longest=1e-2)


HELD = 'height = "5.235 um"\nheld = true'


@pytest.mark.parametrize("reach", REACHES)
def test_bonds_form_on_stripes_only(lab: Any, reach: str) -> None:
    """A cell that rolls over several stripes, and forms many bonds that break soon."""
    bond = {"on_rate": 3000.0 if reach == "pairs" else 300.0, "off_rate": 300.0}  # of each pair, or of all
    machine = machine_of(lab, reach, Stripes(), 'height = "5.235 um"', shear=40.0, bond=bond, repulsion=True)
    births = np.concatenate([s.events for s in lab.states(machine, 0.04)])
    births = births[births["kind"] == 0]
    place = np.mod(births["anchor_x"], PERIOD)
    assert len(births) > 100
    assert (place < PERIOD / 2).all()  # the lattice's squares end where the stripes do
    assert np.ptp(np.floor(births["anchor_x"] / PERIOD)) >= 3


def rate_by_hand(machine: Any, state: Any) -> float:
    """Sum the rates of all molecules of the one cell, with the wall's density straight under each, or at the ligand."""
    problem, turn = machine.problem, np.empty((3, 3))
    species, law = problem.species[0], BondLaw(species=problem.species[0])
    matrix_of(state.orientations[0], turn)
    places = state.centres[0] + machine.fixed.molecules.arm @ turn.T
    gaps = places[:, 2] - 0.05
    near = gaps <= law.reach()
    places, gaps = places[near], gaps[near]
    if species.reach != "pairs":
        density = species.surface.density(places[:, 0], places[:, 1])
        return float((law.on_rate(np.abs(gaps)) * density / 180).sum())
    there = ligands(machine, places)
    lengths = np.sqrt(((places[:, None, :2] - there[None]) ** 2).sum(axis=2) + gaps[:, None] ** 2)
    return float(law.on_rate(lengths[lengths <= law.reach()]).sum())


def ligands(machine: Any, places: Any) -> Any:
    """Give the places of the wall's molecules around, thinned to the local density."""
    surface, key, found = machine.problem.species[0].surface, machine.fixed.key, []
    low, high = np.floor(places.min(axis=0) / SQUARE).astype(int) - 1, np.ceil(places.max(axis=0) / SQUARE).astype(int)
    for i in range(low[0], high[0] + 1):
        for j in range(low[1], high[1] + 1):
            for k in range(ligands_of(key, 0, i, j, surface.densest())):
                _, x, y, mark = ligand_at(key, 0, i, j, k)
                if mark < surface.density(np.array(x), np.array(y)) / surface.densest():
                    found.append((x, y))
    return np.array(found)


@pytest.mark.parametrize("reach", REACHES)
@pytest.mark.parametrize("surface", [Stripes(), Stripes(most=120.0, between=40.0)])
def test_clocks_run_by_the_local_density(lab: Any, reach: str, surface: Any) -> None:
    """Of a held cell, where rates are constant, and of one that moves on, every millisecond."""
    machine = machine_of(lab, reach, surface, HELD, sites=300.0)
    start = lab.start(machine)
    end = lab.last(machine, 0.02, start)
    assert start.clocks[0] - end.clocks[0] == pytest.approx(0.02 * rate_by_hand(machine, start), rel=1e-5)
    moving = lab.ready(machine_of(lab, reach, surface, 'height = "5.235 um"', shear=10.0, sites=300.0).problem,
                       sub_step=1e-4, longest=1e-3)  # fmt: skip
    states = lab.states(moving, 0.03)
    assert states[-1].centres[0, 0] > 1.5 * PERIOD
    spent = states[0].clocks[0] - states[-1].clocks[0]
    times = [s.time for s in states]
    assert spent == pytest.approx(np.trapezoid([rate_by_hand(moving, s) for s in states], times), rel=0.02)


@pytest.mark.parametrize("reach", REACHES)
def test_twice_the_density_binds_twice_as_fast(lab: Any, reach: str) -> None:
    """By clocks exactly where the density enters as a factor; by number of pairs, thinned at random, else."""
    spent = []
    for most in (180.0, 90.0):
        machine = machine_of(lab, reach, Stripes(most=most, between=most), HELD, sites=300.0)
        start = lab.start(machine)
        spent.append(start.clocks[0] - lab.last(machine, 0.02, start).clocks[0])
    if reach != "pairs":
        assert spent[0] == pytest.approx(2 * spent[1], rel=1e-12)
    else:
        pairs = spent[0] / (0.02 * 1e-4)  # of about equal rates
        assert abs(spent[1] / spent[0] - 0.5) < 5 * np.sqrt(3 * 0.25 / pairs)


def test_each_molecule_is_bound_by_its_own_local_density(lab: Any) -> None:
    """No bond breaks: bound with 1 − exp(−k t n/n₀), molecule by molecule."""
    bond = {"on_rate": 30.0}
    machine = machine_of(lab, "overlap", Stripes(between=60.0), HELD, sites=2000.0, bond=bond)
    state = lab.last(machine, 0.02)
    arm, law = machine.fixed.molecules.arm, BondLaw(species=machine.problem.species[0])
    gaps = 5.235 + arm[:, 2] - 0.05
    dense = np.mod(arm[:, 0], PERIOD) < PERIOD / 2
    rates = np.where(gaps <= law.reach(), law.on_rate(np.abs(gaps)), 0) * np.where(dense, 1.0, 1 / 3)
    expected, bound = -np.expm1(-rates * 0.02), np.isin(np.arange(len(arm)), state.bonds.site)
    for chosen in (dense, ~dense):
        spread = np.sqrt((expected * (1 - expected))[chosen].sum())
        assert abs(bound[chosen].sum() - expected[chosen].sum()) < 5 * spread
    assert bound[~dense].sum() > 30
