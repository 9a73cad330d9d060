"""Bonds on held cells, where everything is known: lifetimes, equilibria, and which molecules may bind.

Seeds are fixed. Each statistical bound would be broken by chance once in 1e4 tries or less.
"""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from attrs import evolve
from scipy import stats

from mpad_core.interfaces.errors import MpadError
from mpad_core.numerics.rotations import matrix_of
from mpad_core.numerics.streams import Stream, mixed, uniform_pair
from mpad_core.physics.reactions import BondLaw
from mpad_core.physics.state import State
from mpad_core.running import assembly
from mpad_core.running.places import SQUARE, ligands_of

HELD = {"a": 'height = "5.235 um"\nheld = true'}  # tips 10 nm above the wall's
SHELL = 5.175


def in_reach(machine: Any) -> tuple[Any, Any]:
    """Give which molecules of the held cell can bind, and their tip gaps."""
    arm = machine.fixed.molecules.arm
    gaps = machine.problem.start[0, 2] + arm[:, 2] - machine.problem.wall_roughness
    chosen = np.flatnonzero(gaps <= machine.fixed.species.reach[0])
    return chosen, gaps[chosen]


@pytest.mark.parametrize("sub_step", [1e-5, 1e-3])
@pytest.mark.parametrize(("force", "off_rate"), [(0.0, 30.0), (20.0, 30.0), (80.0, 5.0)])
def test_lifetimes_under_constant_force_are_exponential(
    lab: Any, force: float, off_rate: float, sub_step: float
) -> None:
    """20 000 bonds of equal length, mean 1/k whatever the sub-step."""
    cells, each, compliance = 200, 100, 1e-4
    number = cells * each
    bond = {"on_rate": 0, "off_rate": off_rate, "compliance": compliance}
    problem = lab.many(lab.problem(HELD, bond=bond), cells)
    ready = lab.ready(problem, sub_step=sub_step, longest=1.0)
    machine = lab.with_molecules(ready, [np.tile([[0.0, 0.0, -SHELL]], (each, 1))] * cells)
    length = 0.03 + force / 1e5
    anchor = [np.sqrt(length**2 - 0.01**2), 0, 0.05]
    anchors = np.tile(anchor, (number, 1)) + np.repeat(problem.start * [1, 1, 0], each, axis=0)
    state = lab.bound(machine, np.arange(number), anchors)
    rate = off_rate * np.exp(force * compliance / problem.species[0].kT)
    events = np.concatenate([s.events for s in lab.states(machine, 25 / rate, state)])
    assert len(events) == number
    assert (events["kind"] == 1).all()
    assert events["force"] == pytest.approx(force, rel=1e-6, abs=1e-6)
    lived = events["time"]
    assert abs(lived.mean() * rate - 1) < 5.1 / np.sqrt(number)
    assert stats.kstest(lived, "expon", args=(0, 1 / rate)).pvalue > 1e-6


def sampled(lab: Any, machine: Any, every: int, number: int, state: State | None = None) -> Any:
    """Give which molecules are bound, as (number, molecules), at every so many sub-steps."""
    dt, state = machine.pace.sub_step, lab.start(machine) if state is None else state
    state = lab.last(machine, 100 * dt, state)
    rows = np.zeros((number, len(machine.fixed.molecules.kind)), bool)
    for row in rows:
        state = lab.last(machine, state.time + every * dt, state)
        row[state.bonds.site] = True
    return rows


@pytest.mark.parametrize("reach", ["overlap", "boltzmann_gap"])
@pytest.mark.parametrize(("compression", "stiffness"), [("slack", 1e3), ("linear", 100.0)])
def test_bond_number_in_equilibrium(lab: Any, reach: str, compression: str, stiffness: float) -> None:
    """Each molecule is bound with its own chance, independently: mean Σp, variance Σp(1−p)."""
    bond = {"on_rate": 200, "off_rate": 300, "reach": reach, "compression": compression, "stiffness": stiffness}
    machine = lab.ready(lab.problem(HELD, bond=bond, sites=100.0), sub_step=1e-3, longest=2e-2)
    sites, gaps = in_reach(machine)
    law = BondLaw(species=machine.problem.species[0])
    least = 0.03 if reach == "overlap" and compression == "linear" else 0.0
    lengths = np.maximum(np.abs(gaps), least)
    expected = law.on_rate(lengths) / (law.on_rate(lengths) + law.off_rate(lengths))
    samples = 300
    rows = sampled(lab, machine, 20, samples)  # correlation falls as exp(−0.5) a sub-step
    assert not np.delete(rows, sites, axis=1).any()
    counts, wanted = rows.sum(axis=1), (expected * (1 - expected)).sum()
    assert abs(counts.mean() - expected.sum()) < 4 * np.sqrt(wanted / samples)
    assert abs(counts.var(ddof=1) / wanted - 1) < 4 * np.sqrt(2 / (samples - 1))
    each = (rows[:, sites].mean(axis=0) - expected) / np.sqrt(expected * (1 - expected) / samples + 1e-12)
    sure = expected * samples > 20  # where the normal law holds for a single molecule
    assert abs((each[sure] ** 2).mean() - 1) < 5 * np.sqrt(2 / sure.sum())


def wall_molecules(machine: Any, reach: float) -> dict[int, tuple[float, float]]:
    """Give identity and place of the wall's molecules around the origin."""
    found = {}
    key, side = machine.fixed.key, int(np.ceil(reach / SQUARE)) + 1
    for i in range(-side, side):
        for j in range(-side, side):
            square = int((i & 0xFFFFFF) << 32 | (j & 0xFFFFFF) << 8)
            for k in range(ligands_of(key, 0, i, j, machine.problem.species[0].surface.densest())):
                u, v = uniform_pair(key, int(Stream.LIGANDS), np.uint64(mixed(square, 0)), 1 + k)
                found[square | k] = ((i + u) * SQUARE, (j + v) * SQUARE)
    return found


def test_pairs_bind_each_molecule_of_the_wall_once(lab: Any) -> None:
    """Many molecules of the cell over few of the wall."""
    bond = {"on_rate": 500, "off_rate": 50, "reach": "pairs"}
    machine = lab.ready(lab.problem(HELD, bond=bond, sites=2000.0, wall_sites=60.0), sub_step=1e-3, longest=1e-2)
    there = wall_molecules(machine, 0.7)
    for state in lab.states(machine, 0.1)[1:]:
        assert len(np.unique(state.bonds.ligand)) == len(state.bonds)
        for ligand, anchor in zip(state.bonds.ligand, state.bonds.anchor, strict=True):
            assert (*there[int(ligand)], 0.05) == pytest.approx(tuple(anchor), abs=1e-12)
    lengths, _ = machine.lengths_and_tensions(state)
    assert lengths.max() <= machine.fixed.species.reach[0]
    assert len(state.bonds) > 20


def test_pairs_equilibrium(lab: Any) -> None:
    """Molecules of the cell far apart from each other, m of the wall's within reach of one: Σ K_j / (1 + Σ K_j)."""
    bond = {"on_rate": 60, "off_rate": 300, "reach": "pairs", "stiffness": 1e3}
    made = lab.ready(lab.problem(HELD, bond=bond, wall_sites=1500.0), sub_step=1e-3, longest=2e-2)
    places = np.array([(x, y) for x in np.linspace(-0.3, 0.3, 6) for y in np.linspace(-0.3, 0.3, 6)])
    arm = np.column_stack([places, -np.sqrt(SHELL**2 - (places**2).sum(axis=1))])
    machine = lab.with_molecules(made, [arm])
    law, there = BondLaw(species=machine.problem.species[0]), np.array(list(wall_molecules(machine, 0.7).values()))
    gaps = 5.235 + arm[:, 2] - 0.05
    along = np.linalg.norm(places[:, None] - there[None], axis=2)
    lengths = np.sqrt(along**2 + gaps[:, None] ** 2)
    within = lengths <= law.reach()
    assert within.sum(axis=0).max() == 1  # no molecule of the wall has two to choose from
    on, off = np.where(within, law.on_rate(lengths), 0.0), law.off_rate(lengths)
    weight = (on / off).sum(axis=1)
    expected = weight / (1 + weight)
    samples = 400
    rows = sampled(lab, machine, 20, samples)
    z = (rows.sum() - samples * expected.sum()) / np.sqrt(samples * (expected * (1 - expected)).sum())
    assert abs(z) < 4
    assert expected.sum() > 5
    assert rows[:, expected == 0].sum() == 0


def test_density_of_the_walls_molecules(lab: Any) -> None:
    """Poisson in each square; by sums over 20 000 squares, whose sd is known."""
    key = lab.machine(HELD, bond={}).fixed.key
    for density in (3.0, 180.0, 3000.0):
        counts = np.array([ligands_of(key, 0, i, j, density) for i in range(200) for j in range(100)])
        mean = density * SQUARE**2
        assert abs(counts.mean() - mean) < 4 * np.sqrt(mean / len(counts))
        assert abs(counts.var() / mean - 1) < 4 * np.sqrt((2 + 1 / mean) / len(counts))


def test_a_wall_denser_than_can_be_laid_out_is_not_thinned_in_silence(lab: Any) -> None:
    """Scenes allow 1e6 sites per µm²; what cannot be laid out must be refused before step one."""
    density = 50_000.0
    try:
        machine = lab.machine(HELD, bond={"reach": "pairs"}, wall_sites=density)
    except MpadError:
        return
    counts = [ligands_of(machine.fixed.key, 0, i, 0, density) for i in range(1000)]
    assert np.mean(counts) == pytest.approx(density * SQUARE**2, rel=0.01)


def test_overlap_bonds_are_born_upright_or_unstressed(lab: Any) -> None:
    slack = lab.ready(lab.problem(HELD, bond={"on_rate": 1e4, "off_rate": 0}), sub_step=1e-3)
    state = lab.last(slack, 2e-3)
    assert len(state.bonds) > 30
    assert (state.bonds.anchor[:, 2] == 0.05).all()
    places = slack.problem.start[0] + slack.fixed.molecules.arm[state.bonds.site]
    assert state.bonds.anchor[:, :2] == pytest.approx(places[:, :2])
    bond = {"on_rate": 1e4, "off_rate": 0, "compression": "linear", "stiffness": 100}
    linear = lab.ready(lab.problem(HELD, bond=bond), sub_step=1e-3)
    state = lab.last(linear, 2e-3)
    lengths, tensions = linear.lengths_and_tensions(state)
    upright = linear.problem.start[0, 2] + linear.fixed.molecules.arm[state.bonds.site, 2] - 0.05
    assert lengths == pytest.approx(np.maximum(upright, 0.03))
    assert tensions.min() > -1e-9
    away = (state.bonds.anchor - linear.problem.start[0] - linear.fixed.molecules.arm[state.bonds.site])[:, :2]
    tilted = upright < 0.025
    angles = np.arctan2(away[tilted, 1], away[tilted, 0])
    assert tilted.sum() > 30
    assert abs(np.exp(1j * angles).mean()) * np.sqrt(2 * tilted.sum()) < 4.5  # in no preferred direction


def test_bonds_and_events_agree(lab: Any) -> None:
    """Living bonds = formed − broken, molecule by molecule; times and steps lie within their outer step."""
    cells = {"a": 'overlap = "-20 nm"', "b": 'x = "14 um"\noverlap = "-15 nm"'}
    machine = lab.machine(
        cells, shear=80.0, excess=50.0, repulsion=True, solver="rpb", rate=1e-2, bond={"off_rate": 50}
    )
    marched = lab.states(machine, 0.05)
    living: set[tuple[int, int]] = set()
    born: dict[tuple[int, int], float] = {}
    for before, after in pairwise(marched):
        assert (np.diff(after.events["time"]) >= 0).all()
        for event in after.events:
            who = (int(event["cell"]), int(event["receptor"]))
            assert before.time - 1e-12 <= event["time"] <= after.time + 1e-12
            assert 0 <= event["time"] - event["step"] * machine.pace.grain <= machine.pace.sub_step * (1 + 1e-9)
            assert (who in living) == bool(event["kind"])
            if event["kind"]:
                assert event["time"] > born[who]
                living.remove(who)
            else:
                living.add(who)
                born[who] = event["time"]
        bonds = after.bonds
        receptors = bonds.site - machine.fixed.molecules.first[bonds.cell]
        assert set(zip(bonds.cell.tolist(), receptors.tolist(), strict=True)) == living
        assert len(living) == len(bonds) == after.bond_counts().sum()
    assert sum(len(s.events) for s in marched) > 200


def test_a_denser_wall_binds_faster(lab: Any) -> None:
    """The on-rate is given at 180 sites per µm²; half the sites, half the rate."""
    counts = []
    for density in (180.0, 90.0):
        problem = lab.problem(HELD, bond={"on_rate": 1, "off_rate": 0}, sites=5000.0, wall_sites=density)
        machine = lab.ready(problem, sub_step=1e-3, longest=1e-2)
        state = lab.last(machine, 0.05)
        _, gaps = in_reach(machine)
        rates = BondLaw(species=problem.species[0]).on_rate(np.abs(gaps)) * density / 180
        expected = -np.expm1(-rates * state.time)
        sd = np.sqrt((expected * (1 - expected)).sum())
        assert abs(len(state.bonds) - expected.sum()) < 4 * sd
        counts.append(len(state.bonds))
    assert counts[0] > 1.5 * counts[1]


@pytest.mark.parametrize("dt", [2e-4, 2e-3])
def test_the_list_of_candidates_holds_all_that_reach(lab: Any, dt: float) -> None:
    """With formation as good as certain and no breaking, every molecule within reach is bound a little later.

    A molecule is left out with a chance of e^−20. The cell falls and turns fast; the longer sub-steps are split near
    the wall, where one would cross too much of the gap. Bonds reach as far below the tips of the wall's roughness as
    above.
    """
    bond = {"on_rate": 1e5, "off_rate": 0, "stiffness": 1e-3, "compliance": 0}
    problem = lab.problem({"a": 'height = "6.2 um"'}, shear=80.0, excess=20_000.0, bond=bond, sites=30.0)
    machine = lab.ready(problem, sub_step=dt, longest=1.0)
    species = machine.fixed.species._replace(reach=np.array([0.03]))
    machine = evolve(machine, fixed=evolve(machine.fixed, species=species))
    state, arm, turn = lab.start(machine), machine.fixed.molecules.arm, np.empty((3, 3))
    for time in (0.02, 0.026, 0.034, 0.042, 0.05):
        state = lab.last(machine, time, state)
        after = lab.last(machine, time + 2e-4, state)
        matrix_of(state.orientations[0], turn)
        near = np.flatnonzero(np.abs(state.centres[0, 2] + arm @ turn[2] - 0.05) <= 0.03 - 1e-9)
        assert len(near) > 30
        assert len(np.setdiff1d(near, after.bonds.site)) == 0


def test_results_do_not_depend_on_the_room_for_events(lab: Any, same: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A burst that runs out of room goes on with more, as if nothing had happened."""
    words: dict[str, Any] = {"bond": {"on_rate": 5e3, "off_rate": 5e3}, "rate": 0.05, "sites": 300.0}
    cells = {"a": 'overlap = "-20 nm"', "b": 'x = "-14 um"\ny = "2 um"\nheight = "6 um"'}
    machine = lab.machine(cells, shear=80.0, excess=50.0, repulsion=True, solver="rpb", **words)
    whole = lab.states(machine, 0.02)
    wide, rooms = assembly.room_for, []

    def scarce(*words: Any) -> Any:
        """Give room for very few events, to begin with."""
        room = wide(*words)
        rooms.append(room)
        return room._replace(events=room.events[:4])

    monkeypatch.setattr(assembly, "room_for", scarce)
    narrow = lab.states(machine, 0.02)
    assert sum(len(s.events) for s in whole) > 1000
    assert len(whole) == len(narrow) < len(rooms)
    assert all(same(a, b) for a, b in zip(whole, narrow, strict=True))
    assert all((a.events == b.events).all() for a, b in zip(whole, narrow, strict=True))
