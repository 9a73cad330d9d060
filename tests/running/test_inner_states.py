"""Bonds with inner states on a held cell: lifetimes and occupancy against the master equation, births, balance.

Seeds are fixed. Each statistical bound would be broken by chance once in 1e6 tries or less.
"""

from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest
from attrs import evolve, frozen
from scipy import stats
from scipy.linalg import expm

from mpad_catch.two_state import TwoState
from mpad_core.arrays import Array
from mpad_core.physics.reactions import BondLaw
from mpad_core.records.reader import living_bonds

HELD = {"a": 'height = "5.235 um"\nheld = true'}  # tips 10 nm above the wall's
SHELL = 5.175
SPRING = {"stiffness": 1e3, "rest_length": 0.03, "kT": 4.11e-3}


@frozen(kw_only=True)
class Ladder:
    """States in a row; each next one is entered as e^(F/f) times as fast as it is left, and has its own off-rate."""

    name: ClassVar[str] = "ladder"
    off_rates: tuple[float, ...]
    up: tuple[float, ...]  # 1/s, from each state to the next, without force
    down: tuple[float, ...]
    shift: float = 4.0  # pN
    stiffness: float = SPRING["stiffness"]
    rest_length: float = SPRING["rest_length"]

    def tension(self, length: Array) -> Array:
        return self.stiffness * (length - self.rest_length)

    def breakpoints(self) -> tuple[float, ...]:
        return (self.rest_length,)

    def states(self) -> int:
        return len(self.off_rates)

    def off_rate(self, length: Array) -> Array:
        growth = np.exp(np.abs(self.tension(length)) / 20)
        return np.stack([rate * growth**k for k, rate in enumerate(self.off_rates)])

    def exchange(self, length: Array) -> Array:
        rates = np.zeros((self.states(), self.states(), *np.shape(length)))
        for k in range(self.states() - 1):
            rates[k, k + 1] = self.up[k] * np.exp(np.abs(self.tension(length)) / self.shift)
            rates[k + 1, k] = self.down[k]
        return rates


TWO_STATE = TwoState(
    weak_rate=40.0, strong_rate=3.0, reactive_compliance=4e-4, energy_difference=8e-3, exchange_force=4.0,
    exchange_rate=50.0, **SPRING,
)  # fmt: skip
MODELS = [
    TWO_STATE,
    Ladder(off_rates=(30, 4), up=(9,), down=(20,)),
    Ladder(off_rates=(30, 9, 2), up=(20, 5), down=(15, 25)),
]
NAMES = ["two-state", "two", "three"]


def made(lab: Any, model: Any, *, on_rate: float = 0.0, compression: str = "slack", **words: Any) -> Any:
    """Make a machine with a held cell whose bonds are of a model."""
    bond = {"on_rate": on_rate, "compression": compression, "stiffness": 1e3}
    problem = lab.problem(HELD, bond=bond, **words)
    species = evolve(problem.species[0], model=model)
    return lab.ready(evolve(problem, species=(species,)), sub_step=1e-3, longest=2e-2)


def generator(model: Any, length: float) -> Any:
    """Give the generator of the master equation over the states and, last, the broken bond."""
    n, at = model.states(), np.array([length])
    rates = np.zeros((n + 1, n + 1))
    rates[:n, :n], rates[:n, n] = model.exchange(at)[..., 0], model.off_rate(at)[:, 0]
    return rates - np.diag(rates.sum(axis=1))


def pulled(lab: Any, model: Any, force: float, number: int) -> Any:
    """Give a machine whose bonds all bear one force, and its state with so many in each inner state."""
    machine = made(lab, model)
    states = np.repeat(np.arange(model.states()), number)
    machine = lab.with_molecules(machine, [np.tile([[0.0, 0.0, -SHELL]], (len(states), 1))])
    length = 0.03 + force / 1e3
    anchor = [np.sqrt(length**2 - 0.01**2), 0, 0.05]
    state = lab.bound(machine, np.arange(len(states)), np.tile(anchor, (len(states), 1)))
    return machine, evolve(state, bonds=evolve(state.bonds, state=states)), length


@pytest.mark.parametrize("force", [0.0, 6.0])
@pytest.mark.parametrize("model", MODELS, ids=NAMES)
def test_bonds_of_constant_length_follow_the_master_equation(lab: Any, model: Any, force: float) -> None:
    """From each state: how many are in which at three times, and how long they live."""
    number = 300
    machine, state, length = pulled(lab, model, force, number)
    rates, events, first = generator(model, length), [], state.bonds.state.copy()
    for time in (0.01, 0.04, 0.16, 3.0):
        while state.time < time - 1e-9:
            state = lab.last(machine, min(state.time + 0.01, time), state)
            events.append(state.events)
        chances = expm(rates * state.time)
        for start in range(model.states()):
            own = state.bonds.state[first[state.bonds.site] == start]
            found = np.bincount(own, minlength=model.states())
            expected = number * chances[start, :-1]
            sure = (expected > 20) & (expected < number - 20)  # where the normal law holds
            spread = np.sqrt(expected * (1 - expected / number))
            assert (np.abs(found - expected) < 5 * spread)[sure].all(), (time, start)
    broken = np.concatenate(events)
    broken = broken[broken["kind"] == 1]
    for start in range(model.states()):
        lived = broken["time"][first[broken["receptor"]] == start]
        times = np.linspace(0, 3, 3001)
        one = expm(rates * times[1])
        gone, here = [0.0], np.eye(len(rates))[start]
        for _ in times[1:]:
            here = here @ one
            gone.append(here[-1])
        assert len(lived) > 0.99 * number
        assert stats.kstest(lived, lambda t, x=times, y=gone: np.interp(t, x, y)).pvalue > 1e-6


@pytest.mark.parametrize("model", MODELS, ids=NAMES)
def test_changes_and_breaks_happen_at_the_models_rates(lab: Any, model: Any) -> None:
    """Number of each kind of event less rate times time in the state: a martingale of variance that number."""
    machine, state, length = pulled(lab, model, 6.0, 300)
    start, n = state.bonds.state.copy(), model.states()
    events = np.concatenate([s.events for s in lab.states(machine, 0.3, state)])
    spent, happened = np.zeros(n), np.zeros((n, n + 1))
    now, since = start.copy(), np.zeros(len(start))
    for event in events:
        who, to = int(event["receptor"]), int(event["state"]) if event["kind"] == 2 else n
        assert event["kind"] in (1, 2)
        assert event["force"] == pytest.approx(6.0, rel=1e-5)
        if event["kind"] == 1:
            assert event["state"] == now[who]
        spent[now[who]] += event["time"] - since[who]
        happened[now[who], to] += 1
        now[who], since[who] = to, event["time"]
    for who in np.flatnonzero(now < n):
        spent[now[who]] += 0.3 - since[who]
    expected = spent[:, None] * np.where(np.eye(n, n + 1), 0, generator(model, length)[:n])
    assert happened[expected == 0].sum() == 0
    assert (np.abs(happened - expected)[expected > 25] < 5 * np.sqrt(expected[expected > 25])).all()
    assert (expected > 25).sum() > n


@pytest.fixture(scope="module", params=MODELS[::2], ids=NAMES[::2])
def exchanging(lab: Any, request: Any) -> Any:
    """Molecules all over a held cell that bind and break, at lengths up to where they are stretched."""
    machine = made(lab, request.param, on_rate=40.0, sites=400.0)
    states = lab.states(machine, 1.5)
    return machine, np.concatenate([s.events for s in states]), states[-1]


def test_bonds_are_born_in_equilibrium_among_states(exchanging: Any) -> None:
    machine, events, _ = exchanging
    births = events[events["kind"] == 0]
    rates = BondLaw(species=machine.problem.species[0]).on_rates(births["length"])
    shares = rates / rates.sum(axis=0)
    assert len(births) > 1000
    for taut in (False, True):
        chosen = (births["length"] > 0.03) == taut
        assert chosen.sum() > 200
        for state in range(len(shares)):
            p = shares[state, chosen]
            found = (births["state"][chosen] == state).sum()
            assert abs(found - p.sum()) < 5 * np.sqrt((p * (1 - p)).sum())


def test_there_and_back_happen_equally_often(exchanging: Any) -> None:
    """Detailed balance, on every way between the free pair and the states, once the beginning is over."""
    machine, events, _ = exchanging
    n, now, flux = machine.problem.species[0].model.states(), {}, np.zeros((4, 4))
    for event in events:
        who = int(event["receptor"])
        to = n if event["kind"] == 1 else int(event["state"])
        if event["time"] > 0.3:
            flux[now.get(who, n), to] += 1
        now[who] = to
    both = flux + flux.T
    linked = np.triu(both > 100)
    assert linked.sum() >= n + 1
    assert (np.abs(flux - flux.T)[linked] < 5 * np.sqrt(both[linked])).all()


def test_living_bonds_have_their_present_state(exchanging: Any) -> None:
    machine, events, last = exchanging
    found = living_bonds(SimpleNamespace(bond_events=events), last.time)
    assert dict(zip(found["receptor"].tolist(), found["state"].tolist(), strict=True)) == dict(
        zip(last.bonds.site.tolist(), last.bonds.state.tolist(), strict=True)
    )
    assert len(set(found["state"].tolist())) == machine.problem.species[0].model.states()
