"""What each effect contributes: known answers, nothing changed by looking, and cheap."""

import math
import time
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from attrs import evolve

from mpad_core import velocities
from mpad_core.physics.coupling import lone_cell
from mpad_core.physics.state import State
from mpad_core.running import accounting
from mpad_core.running.accounting import Accounts
from mpad_core.running.balance import LOADS, OuterStep
from mpad_core.running.initial import at_rest
from mpad_core.running.march import Machine, march, step
from mpad_core.running.shares import shares

ONE, HEIGHT, RADIUS, SHEAR = {"a": 'height = "5.4 um"'}, 5.4, 5.0, 80.0
TWO = {"a": 'height = "6 um"', "b": 'x = "-13 um"\nheight = "5.5 um"'}
ROLLING: dict[str, Any] = {"shear": SHEAR, "excess": 50.0, "repulsion": True, "bond": {"off_rate": 50}, "rate": 1e-2}
SCALE = np.array([1, 1, 1, RADIUS, RADIUS, RADIUS])


def heard(machine: Machine, until: float) -> tuple[Accounts, list[State]]:
    """March, with an account kept of every step."""
    accounts = Accounts.of(machine)
    states = []
    marching = march(accounts.machine, at_rest(machine), until)
    states.append(next(marching))
    began = time.perf_counter()
    for after in marching:
        accounts.hear(states[-1], after, time.perf_counter() - began, 0.0)
        states.append(after)
        began = time.perf_counter()
    return accounts, states


def first_step(machine: Machine, until: float = 1.0) -> OuterStep:
    """Take one outer step from rest, at most so long (s)."""
    accounts, before = Accounts.of(machine), at_rest(machine)
    after = step(accounts.machine, before, until)
    assert accounts.coupler.last is not None
    return OuterStep(problem=machine.problem, before=before, after=after, coupling=accounts.coupler.last[1])


def alone(height: float, weight: float = 0.0, shear: float = SHEAR) -> Any:
    """Give the exact velocities of one cell in shear, and under a weight, scaled by the radius."""
    setting = type("Setting", (), {"viscosity": 1e-3, "shear_rate": shear, "wall": True})()
    resistance, ambient = lone_cell(setting, RADIUS, height, height - RADIUS)
    loads = np.stack([ambient, [0, 0, -weight, 0, 0, 0]], axis=1)
    return np.linalg.solve(resistance, loads).T * SCALE


class TestKnownAnswers:
    def test_a_lone_cell_in_shear(self, lab: Any) -> None:
        """The wall's share is what the exact wall functions take off Stokes' velocity."""
        found = shares(first_step(lab.machine(ONE, shear=SHEAR)))
        flowing, _ = alone(HEIGHT)
        bulk = np.array([SHEAR * HEIGHT, 0, 0, 0, SHEAR / 2 * RADIUS, 0])
        assert found["shear"][:, 0] == pytest.approx([1, 1], abs=1e-12)
        assert found["wall"][0, 0] == pytest.approx(np.linalg.norm(flowing - bulk) / np.linalg.norm(bulk), rel=1e-6)
        assert 0.25 < found["wall"][0, 0] < 0.35
        assert all(found[name][0, 0] == 0 for name in ("gravity", "bonds", "repulsion", "thermal"))
        assert np.isnan(found["shear"][0, 1])  # nothing moves it to the wall

    def test_a_lone_heavy_cell_in_shear(self, lab: Any) -> None:
        """Only its weight moves it to the wall, and the wall holds it back by Brenner's factor."""
        problem = lab.problem(ONE, shear=SHEAR, excess=50.0)
        taken = first_step(lab.ready(problem))
        found, height = shares(taken), RADIUS + float(taken.gaps()[0])
        assert HEIGHT - 0.02 < height < HEIGHT  # on the way
        flowing, falling = alone(height, weight=-problem.external[0, 2])
        sizes = np.linalg.norm([flowing, falling], axis=1)
        assert found["gravity"][0] == pytest.approx([sizes[1] / sizes.sum(), 1], rel=1e-4)
        assert found["shear"][0] == pytest.approx([sizes[0] / sizes.sum(), 0], rel=1e-4)
        drag = lone_cell(problem.setting, RADIUS, height, height - RADIUS)[0][2, 2]
        assert found["wall"][0, 1] == pytest.approx(1 - 6 * math.pi * 1e-3 * RADIUS / drag, rel=1e-4)

    def test_two_cells_in_shear(self, lab: Any) -> None:
        """The coupling's share is what the solver's velocities are off those of each cell alone."""
        taken = first_step(lab.machine(TWO, shear=SHEAR, solver="rpb"), until=1e-5)  # so short that nothing changes
        middle = 0.5 * (taken.before.centres + taken.after.centres)
        full = velocities(taken.problem.solver, middle, RADIUS, viscosity=1e-3, shear_rate=SHEAR) * SCALE
        own = np.array([alone(z)[0] for z in middle[:, 2]])
        changed = full - own
        found = shares(taken)
        expected = np.linalg.norm(changed) / (np.linalg.norm(changed) + np.linalg.norm(own))
        assert found["coupling"][0, 0] == pytest.approx(expected, rel=1e-4)
        assert found["coupling"][:, 1] == pytest.approx([1, 1, 1], abs=1e-9)  # nothing else moves them to the wall
        each = np.linalg.norm(changed, axis=1)
        assert found["coupling"][1:, 0] == pytest.approx(each / (each + np.linalg.norm(own, axis=1)), rel=1e-4)

    def test_heat_beside_weight(self, lab: Any) -> None:
        """Over a time t the one moves a cell by w M t, the other by (2 kT M t)^½."""
        problem = lab.problem(ONE, excess=50.0, thermal="on")
        taken = first_step(lab.ready(problem))
        found, height = shares(taken), RADIUS + float(taken.gaps()[0])
        mobility = 1 / lone_cell(problem.setting, RADIUS, height, height - RADIUS)[0][2, 2]
        falling = -problem.external[0, 2] * mobility
        shaken = math.sqrt(2 * problem.thermal_energy * mobility / taken.lasted)
        assert found["thermal"][0, 1] == pytest.approx(shaken / (shaken + falling), rel=1e-6)

    def test_lubrication_is_told_where_a_solver_can_leave_it_out(self, lab: Any) -> None:
        near = {"a": 'height = "6 um"', "b": 'x = "-10.1 um"\nheight = "6 um"'}
        problem = lab.problem(near, shear=SHEAR, solver="cdl-biem")
        bare = evolve(problem.solver, lubrication=False)
        accounts, states = heard(lab.ready(problem), 2e-4)
        told = accounts.samples[0]["lubrication"][0, 0]
        with_it, without = (
            velocities(s, states[0].centres, RADIUS, viscosity=1e-3, shear_rate=SHEAR) * SCALE
            for s in (problem.solver, bare)
        )
        largest = max(np.linalg.norm(with_it), np.linalg.norm(without))
        assert told == pytest.approx(np.linalg.norm(with_it - without) / largest, rel=0.05)
        assert 1e-4 < told < 1


class TestSums:
    @pytest.mark.parametrize("solver", ["isolated", "rpb"])
    def test_they_add_up_and_make_the_motion(self, lab: Any, solver: str) -> None:
        """The parts of every step add up to one, and to the displacement by the step's time."""
        cells = {"a": 'overlap = "-22 nm"', "b": 'x = "-12 um"\noverlap = "0 nm"\nbinds = false'}
        machine = lab.machine(cells, solver=solver, **ROLLING)
        listened = Accounts.of(machine)
        seen = 0
        for before, after in pairwise(march(listened.machine, at_rest(machine), 0.05)):
            assert listened.coupler.last is not None
            coupling = listened.coupler.last[1]
            taken = OuterStep(problem=machine.problem, before=before, after=after, coupling=coupling)
            found = shares(taken)
            additive = sum(found[name] for name in (*LOADS, "coupling", "thermal"))
            assert additive == pytest.approx(np.ones((3, 2)), abs=1e-9)
            assert found["bonds"][2] == pytest.approx(0, abs=1e-12)  # a probe
            free = taken.velocities()["whole"][1, 0]
            assert free == pytest.approx(after.drift[1, 0], rel=5e-3)  # means of products are not products of means
            seen += 1
        assert seen > 10
        assert found["bonds"][1, 0] > 0.1  # a rolling cell hangs on its bonds

    def test_held_cells_have_none(self, lab: Any) -> None:
        cells = {"a": 'height = "6 um"\nheld = true', "b": 'x = "-13 um"\nheight = "5.5 um"'}
        found = shares(first_step(lab.machine(cells, shear=SHEAR, solver="rpb")))
        assert np.isnan(found["shear"][1]).all()
        assert found["coupling"][2] == pytest.approx(found["coupling"][0])

    def test_without_a_free_cell_there_is_nothing_to_tell(self, lab: Any) -> None:
        machine = lab.machine({"a": 'height = "6 um"\nheld = true'}, shear=SHEAR)
        accounts, _ = heard(machine, 0.01)
        account = accounts.closed()
        assert account.effects["shear"].velocity is None
        assert account.steps > 0


@pytest.mark.parametrize(
    ("cells", "words", "until"),
    [
        (TWO, {"shear": SHEAR, "solver": "rpb"}, 0.01),
        ({"a": 'overlap = "-22 nm"'}, ROLLING, 0.15),
        ({"a": 'overlap = "-22 nm"'}, ROLLING | {"thermal": "on"}, 0.01),
    ],
    ids=["two cells", "rolling", "rolling, heat"],
)
def test_looking_changes_no_bit(lab: Any, same: Any, monkeypatch: Any, cells: Any, words: Any, until: float) -> None:
    monkeypatch.setattr(accounting, "EVERY", 1)
    monkeypatch.setattr(accounting, "TIMED_SHARE", np.inf)  # bursts are timed at every step, too
    machine = lab.machine(cells, **words)
    accounts, states = heard(machine, until)
    plain = lab.states(lab.machine(cells, **words), until)
    assert len(plain) == len(states) > 2
    assert all(same(one, other) for one, other in zip(plain, states, strict=True))
    assert accounts.closed().looked_at > 1


class TestWhichSteps:
    def test_by_their_number_and_rarer_as_there_are_more(self, lab: Any, monkeypatch: Any) -> None:
        monkeypatch.setattr(accounting, "MOST", 8)
        monkeypatch.setattr(Accounts, "_without_lubrication", lambda *_: None)
        monkeypatch.setattr(accounting, "shares", lambda step, bare: {})
        machine = lab.machine(ONE, shear=SHEAR)
        accounts, (before, after) = Accounts.of(machine), lab.states(machine, 1e-3)[:2]
        accounts.coupler.last = (None, None)  # type: ignore[assignment]
        for _ in range(64 * 30):
            accounts.hear(before, after, 1e-3, 0.0)
        assert sorted(accounts.samples) == [256 * k for k in range(8)]
        assert accounts.every == 256

    def test_times_are_shares_of_the_whole(self, lab: Any, monkeypatch: Any) -> None:
        monkeypatch.setattr(accounting, "EVERY", 1)
        monkeypatch.setattr(accounting, "TIMED_SHARE", np.inf)
        machine = lab.machine({"a": 'overlap = "-22 nm"'}, **ROLLING)
        accounts, _ = heard(machine, 0.3)
        account = accounts.closed()
        parts = [account.time[name] for name in ("coupling", "drift", "burst", "recording")]
        assert sum(parts) == pytest.approx(1)
        assert min(parts) >= 0
        bonds = account.effects["bonds"]
        assert bonds.time is not None
        assert 0.05 < bonds.time <= account.time["burst"]
        assert account.effects["thermal"].time is None  # it is off


def test_it_takes_little_of_a_run(lab: Any) -> None:
    """Below one per cent; the processor's time of this thread, since others may be at work beside it."""
    machine = lab.machine({"a": 'overlap = "-22 nm"'}, **ROLLING)
    accounts = Accounts.of(machine)
    before, spent, began = None, 0.0, time.thread_time()
    for after in march(accounts.machine, at_rest(machine), 4.0):
        if before is None:
            before, began = after, time.thread_time()
            continue
        started = time.thread_time()
        accounts.hear(before, after, 5e-3, 0.0)
        spent += time.thread_time() - started
        before = after
    share = spent / (time.thread_time() - began)
    print(f"{accounts.steps} outer steps, {len(accounts.samples)} looked at: {100 * share:.2f} % of the time")
    assert accounts.steps > 70
    assert share < 0.01
