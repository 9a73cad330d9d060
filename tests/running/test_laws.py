"""The burst against closed forms: lifetimes, ramps, clusters, detailed balance, unequal loads, first passages.

Where bonds are drawn at rates r while they are open to it, the number of events less ∫ r dt has the variance ∫ r dt
(it is a martingale), so counts test rates without regard to how histories are correlated. Seeds are fixed; every
statistical bound has a false-alarm rate below 1e-6 (`FIVE` standard deviations: 3.4e-7, two-sided).
"""

from typing import Any

import numpy as np
import pytest
from attrs import evolve
from scipy import stats
from scipy.special import erfc

from adhesion import CatchSlip, Ramp, cluster_lifetime, fall_time, hazard_under_ramp
from mpad_core.running.march import march

KT = 0.00411433402  # pN µm, at 298 K
SHELL, TIPS, REST = 5.175, 0.05, 0.03  # µm: where molecules are, the wall's bumps, the unstressed bond
FIVE, SURE = 5.1, 1e-6
pytestmark = pytest.mark.slow

FREE = {"a": 'height = "5.255 um"'}


class Rebinding:
    """Bell's bond, which closes at the same rate whatever the gap up to 6 nm above the rest length."""

    name = "bell of a test"

    def __init__(self, off_rate: float, on_rate: float, scale: float, stiffness: float = 1e5) -> None:
        self.k, self.on, self.scale, self.stiffness = off_rate, on_rate, scale, stiffness

    def tension(self, length: Any) -> Any:
        return self.stiffness * (length - REST)

    def off_rate(self, length: Any) -> Any:
        return self.k * np.exp(np.abs(self.tension(length)) / self.scale)

    def on_rate(self, length: Any) -> Any:
        return self.on * 0.5 * erfc((length - REST - 6e-3) / 5e-4)

    def breakpoints(self) -> tuple[float, ...]:
        return (REST,)


def with_model(problem: Any, model: Any) -> Any:
    return evolve(problem, species=(evolve(problem.species[0], model=model),))


def expected_exponential(used: Any) -> None:
    """Hazards used up at events are exponential with mean one."""
    assert abs(used.mean() - 1) < FIVE / np.sqrt(len(used))
    assert stats.kstest(used, "expon").pvalue > SURE


# Constant force


@pytest.mark.parametrize("force", [0.0, 11.7, 40.0])
def test_lifetimes_of_catch_slip_bonds_of_constant_length(lab: Any, force: float) -> None:
    """Bonds on held cells; the middle force is where they live longest."""
    cells, each = 1000, 30
    model = CatchSlip(KT)
    base = lab.problem({"a": 'height = "5.235 um"\nheld = true'}, bond={"on_rate": 0})
    problem = lab.many(with_model(base, model), cells)
    ready = lab.ready(problem, sub_step=0.1, longest=100.0)
    machine = lab.with_molecules(ready, [np.tile([[0.0, 0.0, -SHELL]], (each, 1))] * cells)
    length = REST + force / model.stiffness
    anchors = problem.start * [1, 1, 0] + [np.sqrt(length**2 - 0.01**2), 0, TIPS]
    state = lab.bound(machine, np.arange(cells * each), np.repeat(anchors, each, axis=0))
    rate = float(model.at_force(force))
    events = np.concatenate([s.events for s in lab.states(machine, 30 / rate, state)])
    assert len(events) == cells * each
    expected_exponential(events["time"] * rate)


# Clusters of bonds that share a constant force; one bond is a cluster, too


class Hung:
    """Free cells drawn off the wall by a constant force, each with bonds from one molecule place to one wall place.

    The fluid is a hundred times thinner than water and the wall's drag is left out, so that a cell is at its new height
    within 10 ns of an event.
    """

    def __init__(self, lab: Any, number: int, size: int, force: float, model: Any, seed: int = 1) -> None:
        base = with_model(lab.problem(FREE, bond={"on_rate": 1}, seed=seed), model)
        problem = lab.many(base, number)
        length = REST + force / size / model.stiffness
        start, external = problem.start.copy(), problem.external.copy()
        start[:, 2], external[:, 2] = TIPS + SHELL + length, force
        self.problem = evolve(
            problem, start=start, external=external, setting=evolve(problem.setting, viscosity=1e-5, wall=False)
        )
        self.lab, self.number, self.size = lab, number, size

    def events(self, lifetime: float, sub_step: float) -> Any:
        """Run until all clusters have once been without a bond; give the events up to then.

        `lifetime` (s) is what is expected of one; none lives thirty times as long but once in 1e10.
        """
        ready = self.lab.ready(self.problem, sub_step=sub_step, longest=1.0)
        arms = np.tile([[0.0, 0.0, -SHELL]], (self.size, 1))
        machine = self.lab.with_molecules(ready, [arms] * self.number)
        anchors = np.repeat(self.problem.start * [1, 1, 0] + [0, 0, TIPS], self.size, axis=0)
        state = self.lab.bound(machine, np.arange(len(anchors)), anchors)
        seen: list[Any] = []
        level, least = np.full(self.number, self.size), np.full(self.number, self.size)
        while (least > 0).any():
            assert state.time < 30 * lifetime + 2 * sub_step
            marching = march(machine, state, state.time + max(2 * lifetime, sub_step))
            next(marching)
            for state in marching:
                seen.append(state.events)
                for event in state.events:
                    level[event["cell"]] += 1 if event["kind"] == 0 else -1
                    least[event["cell"]] = min(least[event["cell"]], level[event["cell"]])
        return np.concatenate(seen)


class Histories:
    """How many bonds were closed in each cell, from event to event, up to the first time that there was none."""

    def __init__(self, events: Any, number: int, size: int) -> None:
        events = events[np.lexsort((events["time"], events["cell"]))]
        cell = events["cell"]
        first = np.searchsorted(cell, np.arange(number))
        change = np.where(events["kind"] == 0, 1, -1)
        total = np.cumsum(change)
        after = size + total - (total[first] - change[first])[cell]
        ends = np.array([np.flatnonzero(part == 0)[0] for part in np.split(after, first[1:])]) + first
        within = np.arange(len(events)) <= ends[cell]
        since = np.diff(events["time"], prepend=0.0)
        since[first] = events["time"][first]
        self.lived = events["time"][ends]
        self.closed = (after - change)[within]  # before each event
        self.waited = since[within]
        self.broke = change[within] < 0

    def deviation(self, broke: bool, rate_of: Any) -> float:
        """Give by how many standard deviations the number of ruptures (or formations) is off.

        The last few bonds of a loaded cluster, whose rates are beyond the ends of the tables, are left out.
        """
        rates = rate_of(self.closed)
        known = rates < BEYOND
        expected = float((rates * self.waited)[known].sum())
        return float(((self.broke == broke)[known].sum() - expected) / np.sqrt(expected))


K0 = 500.0
BEYOND = 1e6  # 1/s


def clusters(
    lab: Any, size: int, force: float, rebinding: float, number: int, batches: int, sub_step: float = 1e-3
) -> None:
    """Compare clusters with the master equation: numbers of events, and the mean lifetime."""
    scale, mean = 4.0, cluster_lifetime(size, force, rebinding) / K0
    lived = []
    for seed in range(1, batches + 1):
        hung = Hung(lab, number, size, force * scale, Rebinding(K0, rebinding * K0, scale), seed)
        events = hung.events(mean, sub_step)
        found = Histories(events, number, size)
        assert abs(found.deviation(True, lambda i: K0 * i * np.exp(force / i))) < FIVE
        if rebinding > 0:
            assert abs(found.deviation(False, lambda i: K0 * rebinding * (size - i))) < FIVE
        lived.append(found.lived)
    every = np.concatenate(lived)
    assert abs(every.mean() - mean) < FIVE * every.std() / np.sqrt(len(every))
    if size == 1:
        expected_exponential(every / mean)


@pytest.mark.parametrize("sub_step", [1e-5, 1e-3])
def test_lifetimes_of_one_bond_that_holds_a_free_cell(lab: Any, sub_step: float) -> None:
    """The whole force is on the bond."""
    clusters(lab, 1, 1.0, 0.0, 1000, 1 if sub_step < 1e-4 else 5, sub_step)


@pytest.mark.parametrize(("size", "force", "rebinding"), [(2, 1.0, 1.0), (10, 5.0, 0.0)])
def test_small_clusters(lab: Any, size: int, force: float, rebinding: float) -> None:
    clusters(lab, size, force, rebinding, 2000, 1)


@pytest.mark.parametrize("sub_step", [1e-5, 1e-3])
def test_clusters_of_ten_under_force(lab: Any, sub_step: float) -> None:
    clusters(lab, 10, 5.0, 1.0, 1000, 1 if sub_step < 1e-4 else 8, sub_step)


@pytest.mark.long
@pytest.mark.parametrize(("size", "force", "number"), [(10, 0.0, 100), (100, 25.0, 20)])
def test_clusters_that_rebind_often(lab: Any, size: int, force: float, number: int) -> None:
    """Few clusters, with a great many events."""
    clusters(lab, size, force, 1.0, number, 1)


@pytest.mark.long
@pytest.mark.parametrize(("size", "force"), [(10, 0.0), (10, 5.0), (100, 25.0)])
def test_four_thousand_clusters(lab: Any, size: int, force: float) -> None:
    clusters(lab, size, force, 1.0, 1000, 4)


# A force that grows with time


def pulled(lab: Any, loading: float, sub_step: float, cells: int, each: int, model: Any) -> Any:
    """Give the ruptures of bonds whose cells are drawn away at constant speed, through a fluid that lets none slow it.

    All bonds of a cell together, some 100 pN each, pull with a thousandth of what the fluid does.
    """
    problem = lab.many(with_model(lab.problem(FREE, bond={"on_rate": 0}), model), cells)
    speed, viscosity = loading / model.stiffness, 1e6
    external = np.zeros((cells, 6))
    external[:, 2] = 6 * np.pi * viscosity * 5 * speed
    setting = evolve(problem.setting, viscosity=viscosity, wall=False)
    problem = evolve(problem, setting=setting, external=external)
    ready = lab.ready(problem, sub_step=sub_step, longest=1.0)
    machine = lab.with_molecules(ready, [np.tile([[0.0, 0.0, -SHELL]], (each, 1))] * cells)
    state = lab.bound(machine, np.arange(cells * each), np.repeat(problem.start - [0, 0, SHELL + REST], each, axis=0))
    events = []
    while len(state.bonds):
        passed = lab.states(machine, state.time + 1000 * sub_step, state)
        state = passed[-1]
        events += [after.events for after in passed[1:]]
    return np.concatenate(events)


@pytest.mark.parametrize(
    ("loading", "sub_step", "cells"),
    [(10.0, 1e-3, 20), (1e3, 1e-3, 500), (1e4, 1e-3, 500), (1e5, 1e-3, 500), (1e5, 1e-5, 100)],
)
def test_rupture_forces_under_a_ramp(lab: Any, loading: float, sub_step: float, cells: int) -> None:
    """k0 = 1 1/s, kT/r0 = 10 pN; at the fastest a sub-step of 1 ms raises the rate by e^10."""
    ramp, each = Ramp(1.0, 10.0, loading), 30
    events = pulled(lab, loading, sub_step, cells, each, Rebinding(1.0, 0.0, 10.0, 1e3))
    force = events["force"]
    number = cells * each
    assert len(force) == number
    assert force == pytest.approx(loading * events["time"], rel=2e-3, abs=0.01)
    expected_exponential(ramp.used(force))
    assert abs(force.mean() - ramp.mean) < FIVE * ramp.deviation / np.sqrt(number)
    kurtosis = np.mean(((force - force.mean()) / force.std()) ** 4)
    assert abs(force.var() / ramp.deviation**2 - 1) < FIVE * np.sqrt((kurtosis - 1) / number)
    near = np.clip([ramp.mode - 3, ramp.mode + 3], 0, None)
    share = float(-np.diff(np.exp(-ramp.used(near)))[0])
    found = ((force > near[0]) & (force < near[1])).sum()
    assert abs(found - number * share) < FIVE * np.sqrt(number * share * (1 - share))


@pytest.mark.parametrize(("loading", "sub_step"), [(300.0, 1e-3), (3e3, 1e-3), (3e4, 1e-4)])
def test_catch_slip_bonds_under_a_ramp(lab: Any, loading: float, sub_step: float) -> None:
    """Most break before the force closes the first path; the others go far beyond the peak."""
    model = CatchSlip(KT, stiffness=1e3)
    events = pulled(lab, loading, sub_step, 400, 30, model)
    expected_exponential(hazard_under_ramp(model.at_force, loading, events["force"]))


# Equilibrium


@pytest.mark.parametrize("compliance", [0.0, 2e-4])
@pytest.mark.parametrize("gap", [0.02, 0.0285, 0.0315])
@pytest.mark.parametrize(
    ("reach", "compression"),
    [("overlap", "slack"), ("overlap", "linear"), ("boltzmann_gap", "slack"), ("boltzmann_gap", "linear")],
)
def test_rates_at_one_gap(lab: Any, reach: str, compression: str, gap: float, compliance: float) -> None:
    """Formations and ruptures are as many as molecules were open to them, and K exp(−E/kT) closed over open."""
    cells, each, time, stiffness = 10, 50, 0.5, 1e3
    length = max(gap, REST) if compression == "slack" or reach == "overlap" else gap
    tension, energy = stiffness * (length - REST), 0.5 * stiffness * (length - REST) ** 2
    off = 300 * np.exp(compliance * abs(tension) / KT)
    on = 200 / 300 * off * np.exp(-energy / KT)
    bond = {"on_rate": 200, "off_rate": 300, "reach": reach, "compression": compression, "compliance": compliance}
    base = lab.problem(
        {"a": f'height = "{TIPS + SHELL + gap!r} um"\nheld = true'}, bond=bond | {"stiffness": stiffness}
    )
    problem = lab.many(base, cells)
    ready = lab.ready(problem, sub_step=1e-3, longest=1.0)
    machine = lab.with_molecules(ready, [np.tile([[0.0, 0.0, -SHELL]], (each, 1))] * cells)
    events = np.concatenate([s.events for s in lab.states(machine, time)])
    change = np.where(events["kind"] == 0, 1, -1)
    bound = float((change * (time - events["time"])).sum())
    free = cells * each * time - bound
    for kind, expected in ((0, on * free), (1, off * bound)):
        assert abs((events["kind"] == kind).sum() - expected) < FIVE * np.sqrt(expected)
    born = events["length"][events["kind"] == 0]
    assert born == pytest.approx(length if reach == "overlap" and compression == "linear" else gap, abs=1e-9)
    # of a time average over many correlation times 1/(on + off), two of which are left out at the start
    share, part = on / (on + off), cells * each * time
    deviation = np.sqrt(2 * share * (1 - share) * part / (on + off)) / part
    assert abs(bound / part - share) < FIVE * deviation + 2 * share / (on + off) / time


@pytest.mark.parametrize("compression", ["slack", "linear"])
def test_pairs_are_in_balance_one_by_one(lab: Any, compression: str) -> None:
    """A molecule that has many of the wall's to choose from: each gets k_on of the time when it is free."""
    cells, time, stiffness, compliance = 100, 3.0, 1e3, 1e-4
    bond = {"on_rate": 100, "off_rate": 300, "reach": "pairs", "compression": compression, "stiffness": stiffness}
    base = lab.problem(
        {"a": f'height = "{TIPS + SHELL + 0.02!r} um"\nheld = true'}, bond=bond | {"compliance": compliance},
        wall_sites=900.0,
    )  # fmt: skip
    problem = lab.many(base, cells)
    machine = lab.with_molecules(
        lab.ready(problem, sub_step=1e-2, longest=1.0), [np.array([[0.0, 0.0, -SHELL]])] * cells
    )
    events = np.concatenate([s.events for s in lab.states(machine, time)])
    felt = np.maximum(events["length"], REST) if compression == "slack" else events["length"]
    tension, energy = stiffness * (felt - REST), 0.5 * stiffness * (felt - REST) ** 2
    off = 300 * np.exp(compliance * np.abs(tension) / KT)
    on = 100 / 300 * off * np.exp(-energy / KT)
    formed = events["kind"] == 0
    expected = broken = ruptures = 0.0
    for cell in range(cells):
        own = events["cell"] == cell
        change = np.where(formed[own], 1, -1)
        free = time - float((change * (time - events["time"][own])).sum())
        _, first = np.unique(events["ligand"][own], return_index=True)
        sure = on[own][first] > 15  # the others may not have been met in 3 s
        expected += free * on[own][first][sure].sum()
        broken += (formed[own] & (on[own] > 15)).sum()
        held = np.diff(events["time"][own])[formed[own][:-1]]
        ruptures += (held * off[own][:-1][formed[own][:-1]]).sum()
    assert expected > 2000
    assert abs(broken - expected) < FIVE * np.sqrt(expected)
    assert abs((~formed).sum() - ruptures) < FIVE * np.sqrt(ruptures)


# Loads that are not shared equally


@pytest.mark.parametrize("sub_step", [1e-4, 1e-3])
@pytest.mark.long
def test_two_bonds_at_different_levers(lab: Any, sub_step: float) -> None:
    """A force through the centre, one bond 0.2 µm before and one 0.4 µm behind: two thirds and one third of it.

    When one breaks, the cell turns until the other is straight below the centre and takes it all.
    """
    number, scale, force, model = 2000, 4.0, 8.0, Rebinding(100.0, 0.0, 4.0)
    problem = lab.many(with_model(lab.problem(FREE, bond={"on_rate": 0}), model), number)
    external = np.zeros((number, 6))
    external[:, 2] = force
    setting = evolve(problem.setting, viscosity=1e-5, wall=False)
    ready = lab.ready(evolve(problem, external=external, setting=setting), sub_step=sub_step, longest=1.0)
    across = np.array([0.2, -0.4])
    arm = np.column_stack([across, [0.0, 0.0], -np.sqrt(SHELL**2 - across**2)])
    machine = lab.with_molecules(ready, [arm] * number)
    shares = np.array([2.0, 1.0]) / 3
    anchors = problem.start[:, None] + arm[None]
    anchors[:, :, 2] -= REST + shares * force / model.stiffness
    state = lab.bound(machine, np.arange(2 * number), anchors.reshape(-1, 3))
    events = np.concatenate([s.events for s in lab.states(machine, 0.3, state)])
    assert len(events) == 2 * number
    events = events[np.lexsort((events["time"], events["cell"]))].reshape(number, 2)
    rates = 100 * np.exp(shares * force / scale)
    expected_exponential(events["time"][:, 0] * rates.sum())
    near = int((events["receptor"][:, 0] == 0).sum())
    share = rates[0] / rates.sum()
    assert abs(near - number * share) < FIVE * np.sqrt(number * share * (1 - share))
    expected_exponential((events["time"][:, 1] - events["time"][:, 0]) * 100 * np.exp(force / scale))


# Symmetry, and heat


@pytest.mark.long
def test_rolling_cells_stray_to_neither_side(lab: Any) -> None:
    words: dict[str, Any] = {"shear": 100.0, "excess": 50.0, "repulsion": True, "bond": {}, "rate": 1e-2}
    strayed = []
    for seed in range(1, 13):
        machine = lab.machine({"a": 'overlap = "-20 nm"'}, seed=seed, **words)
        strayed.append(lab.last(machine, 0.5).centres[0, 1])
    number = len(strayed)
    assert np.std(strayed) > 0
    assert abs(stats.ttest_1samp(strayed, 0.0).statistic) < stats.t.ppf(1 - SURE / 2, number - 1)


@pytest.mark.long
def test_first_passage_takes_the_time_of_falling(lab: Any) -> None:
    """Gap 1 → 0.255 µm in 2.90 s on average, at any temperature; heat alone spreads it by a fifth."""
    number, low = 400, 0.255
    problem = lab.many(lab.problem({"a": 'height = "6 um"'}, excess=50.0, thermal="on"), number)
    machine = lab.ready(problem, sub_step=1e-3, longest=2e-2)
    weight = -float(problem.external[0, 2])
    passed = np.full(number, np.inf)
    state = lab.last(machine, 0.0)
    while np.isinf(passed).any():
        state = lab.last(machine, state.time + 0.02, state)
        for point in state.trail:
            passed = np.where((point.wall_gaps < low) & np.isinf(passed), point.time, passed)
        assert state.time < 20
    expected = fall_time(1.0, low, 5.0, 1e-3, weight)
    seen_late = 0.6 * np.sqrt(2 * KT * 1e-3 / 2.1) / 0.745  # of a passage seen once a ms: a share of the way
    assert abs(passed.mean() / expected - 1) < FIVE * passed.std() / np.sqrt(number) / expected + seen_late
    assert 0.05 < passed.std() / expected < 0.5
