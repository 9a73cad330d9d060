"""Bonds between cells: their loads, their equilibria, and that no pair of molecules within reach is overlooked.

Seeds are fixed. Each statistical bound would be broken by chance once in 1e6 tries or less.
"""

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from attrs import evolve
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation

from bridged import BRIDGE, REPULSION, SHELL, SITES, TETHER, WALL, bond_loads, bonded, problem_of, with_molecules
from mpad_core.physics.coupling import contact_range
from mpad_core.physics.reactions import BondLaw
from mpad_core.physics.state import from_arrays, to_arrays
from mpad_core.records.reader import living_bonds
from mpad_core.running import assembly

CAP = 900  # molecules scattered over a cap


def facing(lengths: Any) -> tuple[Any, list[Any]]:
    """Give places of two cells, and arms such that molecule k of one is at length k from that of the other alone."""
    side = np.arange(8) * 0.1 - 0.35
    y, z = (a.ravel() for a in np.meshgrid(side, side))
    x = np.full(64, 5.149)  # within the shell, by a little
    apart = 10.31
    return [[0, 0, 60.0], [apart, 0, 60.0]], [
        np.column_stack([x, y, z]), np.column_stack([x + lengths - apart, y, z])
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("between", "kinds", "held"),
    [('"slex", "psgl"', (0, 1), 0), ('"slex", "psgl"', (1, 0), 0), ('"slex", "slex"', (0, 0), 1)],
)
def test_pairs_of_molecules_are_bound_as_often_as_detailed_balance_has_it(
    lab: Any, between: str, kinds: Any, held: int
) -> None:
    """One pair each of its own; K/(1 + K), K = on/off exp(−σ (x − λ)²/2kT) for x > λ. The fluid is very viscous."""
    lengths = np.resize([0.0135, 0.03, 0.0315, 0.033, 0.035], 64)
    places, arms = facing(lengths)
    problem = problem_of(places, held=(held,), between=between, on=300, off=300)
    problem = evolve(problem, setting=evolve(problem.setting, viscosity=1e6))
    machine = with_molecules(lab.ready(problem, sub_step=1e-3, longest=2e-2), arms, list(kinds))
    constant = np.exp(-1e3 * np.maximum(lengths - 0.03, 0) ** 2 / (2 * problem.species[0].kT))
    expected, samples, state = constant / (1 + constant), 120, lab.start(machine)
    state, bound = lab.last(machine, 0.05, state), np.zeros(64)
    for _ in range(samples):
        state = lab.last(machine, state.time + 0.02, state)  # six times as long as anything is remembered
        bonds, first = state.bonds, machine.fixed.molecules.first
        assert (bonds.cell == 1 - held).all()
        assert (bonds.partner == held).all()
        assert (bonds.site - first[bonds.cell] == bonds.ligand - first[bonds.partner]).all()
        bound[bonds.site - first[bonds.cell]] += 1
    assert machine.lengths_and_tensions(state)[0] == pytest.approx(lengths[bonds.site - first[bonds.cell]], abs=1e-5)
    for length in np.unique(lengths):
        chosen = lengths == length
        mean, variance = samples * expected[chosen].sum(), samples * (expected * (1 - expected))[chosen].sum()
        # exp(−6) of a sample is left in the next
        assert abs(bound[chosen].sum() - mean) < 5 * np.sqrt(variance * 1.01), length


def passing(
    lab: Any, *, at: float = -1.5, shear: float = 80.0, sub_step: float = 2e-4, longest: float = 4e-3, **keys: Any
) -> Any:
    """Make two cells that pass each other in shear, 8 nm between the tips when they are nearest; no wall."""
    rng = np.random.default_rng(2)
    caps = [_cap(rng, np.array([0, sign, 0.1 * sign])) for sign in (1.0, -1.0)]
    problem = problem_of([[0, 0, 60], [at, 10.31, 61.0]], shear=shear, **keys)
    return with_molecules(lab.ready(problem, sub_step=sub_step, longest=longest), caps, [0, 1])


def _cap(rng: Any, pole: Any, number: int = CAP, half_width: float = 0.28) -> Any:
    """Scatter molecules over a cap around a pole."""
    found = rng.normal(size=(100 * number, 3))
    found /= np.linalg.norm(found, axis=1)[:, None]
    return SHELL * found[found @ pole / np.linalg.norm(pole) > np.cos(half_width)][:number]


GAUSS = 0.5 + 0.5 * np.polynomial.legendre.leggauss(4)[0], 0.5 * np.polynomial.legendre.leggauss(4)[1]


def brute_force(machine: Any, before: Any, after: Any) -> tuple[float, int]:
    """Integrate the rate of forming over an outer step, of all pairs of free molecules, along the way recorded.

    Give how many pairs were within reach at most, too.
    """
    law, total, most = BondLaw(species=machine.problem.species[0]), 0.0, 0
    reach, way, start = law.reach(), after.way, (before.time, before.centres, before.orientations)
    for end in zip(way.times, way.centres, way.orientations, strict=True):
        turn = Rotation.from_quat(start[2], scalar_first=True)
        rest = (Rotation.from_quat(end[2], scalar_first=True) * turn.inv()).as_rotvec()
        for share, weight in zip(*GAUSS, strict=True):
            centres, turns = start[1] + share * (end[1] - start[1]), Rotation.from_rotvec(share * rest) * turn
            (mine, own), (theirs, other) = (near_molecules(machine, centres, turns, c, reach) for c in (0, 1))
            lengths, bound = cdist(own, other), taken(before, after, start[0] + share * (end[0] - start[0]))
            most = max(most, int((lengths <= reach).sum()))
            free = ~np.isin(mine, bound[:, 0])[:, None] & ~np.isin(theirs, bound[:, 1])
            total += weight * (end[0] - start[0]) * law.on_rate(lengths[free & (lengths <= reach)]).sum()
        start = end
    return total, most


def near_molecules(machine: Any, centres: Any, turns: Any, cell: int, reach: float) -> tuple[Any, Any]:
    """Give which of a cell's molecules are within reach of the shell on which the other's lie, and their places."""
    first = machine.fixed.molecules.first
    places = turns[cell].apply(machine.fixed.molecules.arm[first[cell] : first[cell + 1]]) + centres[cell]
    near = np.flatnonzero(np.linalg.norm(places - centres[1 - cell], axis=1) <= SHELL + reach)
    return near, places[near]


def taken(before: Any, after: Any, time: float) -> Any:
    """Give the pairs of molecules (B, 2) that are bound at a time of an outer step, by its events."""
    now = {(s, p - CAP) for s, p in zip(before.bonds.site.tolist(), before.bonds.ligand.tolist(), strict=True)}
    for event in after.events[after.events["time"] <= time]:
        now ^= {(int(event["receptor"]), int(event["ligand"]))}
    return np.array(sorted(now), np.int64).reshape(-1, 2)


def test_no_pair_within_reach_is_overlooked(lab: Any) -> None:
    """What clocks use up while cells pass each other is the rate of all pairs, integrated; no bond forms.

    Two points of Gauss and Legendre in each part of at most 20 nm, across a kink of the rate at 30 nm: good to 1 %.
    """
    machine = passing(lab, on=1e-3, off=2)
    states, most = lab.states(machine, 0.036), 0
    spent, expected = [], []
    for before, after in pairwise(states):
        assert len(after.events) == 0
        spent.append(before.clocks[0] - after.clocks[0])
        integral, pairs = brute_force(machine, before, after)
        expected.append(integral)
        most = max(most, pairs)
        assert spent[-1] == pytest.approx(expected[-1], rel=0.05, abs=1e-8)
    assert most > 20
    assert states[0].clocks[1] == states[-1].clocks[1]  # the second keeps nothing
    assert sum(spent) == pytest.approx(sum(expected), rel=0.01)
    assert spent[0] < 1e-3 * max(spent)
    assert spent[-1] < 1e-3 * max(spent)


def test_cells_do_not_pass_each_other_unseen_within_a_burst(lab: Any) -> None:
    """Far apart at the start, without contact or coupling, and bursts that would last until they have passed."""
    machine = passing(lab, at=-8.0, shear=400.0, sub_step=1e-4, longest=0.04, on=1e-3)
    states = lab.states(machine, 0.0215)
    assert np.linalg.norm(np.diff(states[0].centres, axis=0)) - 10 > 1.5 * contact_range(machine.problem)
    expected = sum(brute_force(machine, before, after)[0] for before, after in pairwise(states))
    assert states[0].clocks[0] - states[-1].clocks[0] == pytest.approx(expected, rel=0.02)


def test_bonds_form_as_often_as_all_pairs_have_it(lab: Any) -> None:
    """Formations less the integrated rate, along the way that was gone, are a martingale of variance their number."""
    machine = passing(lab, on=2e3, off=4e3)
    formed, expected, reach = 0, 0.0, BondLaw(species=machine.problem.species[0]).reach()
    for before, after in pairwise(lab.states(machine, 0.036)):
        births = after.events[after.events["kind"] == 0]
        assert (births["length"] <= reach).all()
        formed += len(births)
        expected += brute_force(machine, before, after)[0]
    assert formed > 300
    assert abs(formed - expected) < 5 * np.sqrt(expected)


def replayed(machine: Any, states: Any) -> None:
    """Check that the events lead from each state's bonds to the next one's."""
    first, living = machine.fixed.molecules.first, set()
    for before, after in pairwise(states):
        for event in after.events:
            who = tuple(int(event[n]) for n in ("species", "cell", "receptor", "partner", "ligand"))
            assert before.time - 1e-12 <= event["time"] <= after.time + 1e-12
            assert (who in living) == bool(event["kind"])
            living ^= {who}
        bonds = after.bonds
        ligand = bonds.ligand - np.where(bonds.partner < 0, 0, first[bonds.partner])
        now = zip(bonds.species, bonds.cell, bonds.site - first[bonds.cell], bonds.partner, ligand, strict=True)
        assert {tuple(map(int, row)) for row in now} == living
        both = np.concatenate([bonds.site, bonds.ligand[bonds.partner >= 0]])
        assert len(np.unique(both)) == len(both)  # each molecule binds once
        assert (after.bond_counts() == [sum(c in (w[1], w[3]) for w in living) for c in range(len(first) - 1)]).all()


def crowded() -> Any:
    places = [[0, 0, 5.235], [10.359, 0, 5.24], [5.18, 8.972, 5.24]]
    keys = {"bonds": BRIDGE + TETHER, "on": 2000, "off": 300}
    return problem_of(places, held=(1,), shear=10.0, wall=WALL, more=REPULSION, **keys)


@pytest.fixture(scope="module")
def crowd(lab: Any) -> Any:
    """Three cells near a wall, one held, that bind it and each other; 20 ms."""
    machine = lab.ready(crowded(), sub_step=2e-4, longest=4e-3)
    return machine, lab.states(machine, 0.02)


def test_events_lead_from_state_to_state(crowd: Any) -> None:
    machine, states = crowd
    replayed(machine, states)
    events = np.concatenate([s.events for s in states])
    bridges = events[events["partner"] >= 0]
    assert set(zip(bridges["cell"].tolist(), bridges["partner"].tolist(), strict=True)) == {(0, 1), (0, 2), (2, 1)}
    assert min(np.bincount(bridges["kind"])) > 30
    assert (events["partner"] < 0).sum() > 30
    found = living_bonds(SimpleNamespace(bond_events=events), states[-1].time)
    assert len(found) == len(states[-1].bonds) > 10


def test_a_march_goes_on_from_a_stored_state_bit_for_bit(lab: Any, same: Any, crowd: Any) -> None:
    machine, states = crowd
    cells, sites = len(machine.problem.radii), len(machine.fixed.molecules.kind)
    middle = from_arrays(to_arrays(states[len(states) // 2]), cells, sites)
    assert (middle.bonds.partner >= 0).any()
    assert same(lab.last(make_again(lab, machine), states[-1].time, middle), states[-1])


@pytest.mark.parametrize(("name", "wrong"), [("partner", 3), ("ligand", 10**6)])
def test_a_stored_bond_to_what_is_not_there_is_refused(crowd: Any, name: str, wrong: int) -> None:
    machine, states = crowd
    arrays = to_arrays(states[-1])
    arrays[f"bonds.{name}"] = np.where(states[-1].bonds.partner >= 0, wrong, arrays[f"bonds.{name}"])
    with pytest.raises(ValueError, match="between cells"):
        from_arrays(arrays, len(machine.problem.radii), len(machine.fixed.molecules.kind))


def make_again(lab: Any, machine: Any) -> Any:
    pace = machine.pace
    return lab.ready(machine.problem, sub_step=pace.sub_step, longest=pace.longest, euler=pace.euler)


def tight(fixed: Any, bonds: Any, cells: int, neighbours: Any = None, times: int = 1) -> Any:
    """Lay bonds out as `room_for`, but with next to no room for more, nor for events and candidates."""
    room = ROOMY(fixed, bonds, cells, neighbours, times)
    counts = np.bincount(bonds.cell, minlength=cells)
    laid = assembly._no_bonds(np.concatenate([[0], np.cumsum(counts + times)]), counts)
    for c in range(cells):
        old, new = (slice(b.first[c], b.first[c] + counts[c]) for b in (room.bonds, laid))
        for name in ("site", "species", "state", "partner", "ligand", "anchor"):
            getattr(laid, name)[new] = getattr(room.bonds, name)[old]
        assembly.list_bridges(c, laid)
    return room._replace(bonds=laid, events=room.events[:3].copy())


ROOMY = assembly.room_for


@pytest.mark.parametrize(
    ("scheme", "few"), [("crowd", 2), ("crowd", 512), ("passing", 512), ("explicit", 512), ("fast", 512)]
)
def test_rooms_that_are_too_small_change_nothing(lab: Any, same: Any, scheme: str, few: int, monkeypatch: Any) -> None:
    """A burst that asks for more room goes on with it as if nothing had happened, also where lists are as yet good."""
    if scheme == "passing":
        machine, until = passing(lab, sub_step=1e-3, longest=1e-2, on=2e3, off=4e3), 0.03
    elif scheme == "fast":  # two cells in a group, in steps as long as lists last; the wall's molecules are told apart
        tether = TETHER.replace('"overlap"', '"pairs"').replace("1e3 pN/um", "1 pN/um").replace("84 1/s", "300 1/s")
        problem = problem_of([[0, 0, 5.235], [0, 10.36, 5.24]], shear=100.0, wall=WALL, bonds=tether, more=REPULSION)
        machine, until = lab.ready(problem, sub_step=1e-3, longest=1e-2), 0.005
    else:
        problem = crowded()
        euler = 5e-6 if scheme == "explicit" else 0.0
        problem = evolve(problem, tolerances=evolve(problem.tolerances, euler=euler))
        machine, until = lab.ready(problem, sub_step=2e-4, longest=4e-3, euler=euler), 0.01
    roomy, asked = lab.states(machine, until), []
    monkeypatch.setattr(assembly, "room_for", lambda *args: asked.append(args[-1]) or tight(*args))
    monkeypatch.setattr(assembly, "_FEW", few)
    tightly = lab.states(make_again(lab, machine), until) if scheme != "passing" else lab.states(machine, until)
    assert same(tightly[-1], roomy[-1])
    assert sum(len(s.events) for s in roomy) > 30
    grown = sum(after > before for before, after in pairwise(asked))  # where bonds or candidates had no room
    emptied = len(asked) - (len(tightly) - 1) - grown  # where the table of events was full
    assert min(grown, emptied) > 0


def test_without_bonds_between_cells_their_sites_change_nothing(lab: Any, same: Any) -> None:
    """Sites that no bond of the scene names leave all as it would be without them, bit for bit."""
    places = [[0, 0, 5.235], [10.3502, 0, 5.24]]
    reached = []
    for sites in (SITES, 'slex = { density = "60 1/um^2" }'):
        problem = problem_of(places, shear=40.0, wall=WALL, bonds=TETHER, sites=sites)
        reached.append(lab.last(lab.ready(problem, sub_step=2e-4, longest=4e-3), 0.02))
    assert len(reached[0].bonds) > 10
    assert same(*reached)


def test_a_bonded_pair_in_a_quiet_fluid_comes_to_rest_without_drifting(lab: Any) -> None:
    places, arms = facing(np.resize([0.06, 0.09], 64))
    chosen = [0, 7, 30, 61]
    machine = with_molecules(
        lab.ready(problem_of(places, on=0, off=0), sub_step=1e-3, longest=2e-3), [a[chosen] for a in arms], [0, 1]
    )
    state = bonded(machine, [(k, 4 + k) for k in range(4)])
    turned = Rotation.from_rotvec([[0.003, 0.002, -0.002], [-0.001, 0.003, 0.004]]).as_quat(scalar_first=True)
    states = lab.states(machine, 0.4, evolve(state, orientations=turned))
    energies = []
    for now in states:
        stretch = np.maximum(machine.lengths_and_tensions(now)[0] - 0.03, 0)
        energies.append(0.5 * 1e3 * (stretch**2).sum())
        assert now.centres.sum(axis=0) == pytest.approx(states[0].centres.sum(axis=0), abs=1e-9)
    assert (np.diff(energies) <= 1e-12 * energies[0]).all()
    assert energies[-1] < 1e-3 * energies[0]
    assert np.linalg.norm(now.centres[1] - now.centres[0]) < 10.31 - 0.02


def test_cells_that_a_soft_bond_ties_stay_tied_however_far_apart(lab: Any) -> None:
    """Drawn out beyond all that is near: cells without coupling are still solved for together."""
    problem = problem_of([[0, 0, 60], [0, 0, 70.4]], shear=20.0, on=0, off=0, stiffness=0.5)
    made = lab.ready(problem, sub_step=1e-3, longest=4e-3)
    pole = np.array([[0, 0, SHELL]])
    machine = with_molecules(made, [pole, -pole], [0, 1])
    states = lab.states(machine, 0.2, bonded(machine, [(0, 1)]))
    gaps = [np.linalg.norm(s.centres[1] - s.centres[0]) - 10 for s in states]
    farthest = states[int(np.argmax(gaps))]
    assert max(gaps) > 3 * contact_range(problem)
    loads = bond_loads(machine, farthest)
    assert np.abs(loads[:, 0]).max() > 1
    drag, flow = 6 * np.pi * problem.setting.viscosity * 5.0, 20.0 * farthest.centres[:, 2]
    assert drag * (farthest.velocities[:, 0] - flow) == pytest.approx(loads[:, 0], rel=2e-2)
    assert farthest.mean_loads[:, :3].sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-9)


def test_a_cell_without_molecules_does_not_stop_its_neighbour(lab: Any) -> None:
    """Of two cells near each other the first, which keeps their bonds, has nothing to bind with."""
    machine = with_molecules(passing(lab), [np.zeros((0, 3)), _cap(np.random.default_rng(1), -np.eye(3)[1])], [0, 1])
    after = lab.last(machine, 0.01)
    assert after.centres[:, 0] == pytest.approx([0.01 * 80 * 60, 0.01 * 80 * 61 - 1.5], abs=1e-3)
