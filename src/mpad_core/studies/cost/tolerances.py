"""The scene's two tolerances: that of positions, which chooses the steps, and that of the rates of bond events."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from attrs import evolve, frozen

from mpad_core.physics.problem import Problem
from mpad_core.physics.state import State
from mpad_core.running.march import Machine, make_ready
from mpad_core.scene.compose import compose
from mpad_core.scene.spec import Accuracy
from mpad_core.studies.cost.paths import travel
from mpad_core.studies.cost.replays import moments, replay, waiting_errors
from mpad_core.studies.cost.rows import POSITION, RATE, Row
from mpad_core.studies.cost.runs import Run, judged, run_of
from mpad_core.studies.cost.subject import Subject, ends_of
from mpad_core.studies.measures.estimates import Estimate

FACTORS = (100.0, 10.0, 1.0, 0.1, 0.01)  # on the scene's tolerance of positions; the last is the reference
RATES = (1e-1, 1e-2, 1e-3, 1e-4)
_FINEST_RATE = 1e-6
_NEXT = 10**0.5  # in time, from one factor to the next
_LARGEST = 1.0  # µm, that a scene may ask for
_STRETCHES = 12
_EVENTS = 8  # in each
_PATIENCE = 10.0  # s of computing for each run of the scene that is only timed


def position_runs(subject: Subject, budget: float) -> Iterator[tuple[Row, ...]]:
    """Run the path without bonds with coarser and finer steps; yield the rows after each.

    What would take longer than the budget (s) is left out, and said to be: the time grows with the root of the factor.
    """
    runs: list[Run] = []
    needed = 0.0
    for factor in FACTORS:
        position = min(factor * subject.scene.accuracy.position, _LARGEST)
        label = f"position = {1e3 * position:.3g} nm" + (" (the scene's)" if factor == 1 else "")
        if needed > budget:
            note = f"not run: would take some {needed:.2g} s; add --long"
            runs.append(Run(row=Row(study=POSITION, label=label, line="position", note=note)))
        else:
            runs.append(_position_run(subject, position, label))
            budget, needed = budget - runs[-1].row.time, runs[-1].row.time * _NEXT
        yield judged(runs)


def _position_run(subject: Subject, position: float, label: str) -> Run:
    assert subject.outcome is not None
    machine = subject.quieted(_problem(subject, evolve(subject.scene.accuracy, position=position)))
    way = travel(machine, subject.until, ends_of(subject.scene, machine.problem))
    return run_of(POSITION, label, "position", subject.outcome, way)


def _problem(subject: Subject, accuracy: Accuracy) -> Problem:
    return compose(evolve(subject.scene, accuracy=accuracy))


@frozen(kw_only=True, eq=False)
class Stretches:
    """Short stretches of the scene's own run, and the events in them as finer tolerances have them."""

    starts: tuple[State, ...]
    expected: tuple[Any, ...]
    until: float  # s


def stretches_of(subject: Subject) -> Stretches:
    """Choose stretches of the scene's run, and replay them with much finer tolerances."""
    starts = moments(make_ready(subject.problem), subject.own.last.time, _STRETCHES)
    fine = evolve(subject.scene.accuracy, position=FACTORS[-1] * subject.scene.accuracy.position, rate=_FINEST_RATE)
    machine, until = make_ready(_problem(subject, fine)), subject.until
    expected = [replay(machine, start, _EVENTS, until) for start in starts]
    return Stretches(starts=tuple(starts), expected=tuple(expected), until=until)


def rate_runs(subject: Subject) -> Iterator[tuple[Row, ...]]:
    """Replay stretches of the run with several tolerances of rates, and of positions; yield the rows after each."""
    stretches = stretches_of(subject)
    own = subject.scene.accuracy
    rows: list[Row] = []
    for rate in RATES:
        rows.append(_rate_row(subject, stretches, evolve(own, rate=rate), f"rate = {rate:g}", "rate"))
        yield tuple(rows)
    for factor in FACTORS[:-1]:
        accuracy = evolve(own, position=min(factor * own.position, _LARGEST))
        label = f"position = {1e3 * accuracy.position:.3g} nm, rate = {own.rate:g}"
        rows.append(_rate_row(subject, stretches, accuracy, label, "position"))
        yield tuple(rows)


def _rate_row(subject: Subject, stretches: Stretches, accuracy: Accuracy, label: str, line: str) -> Row:
    machine = make_ready(_problem(subject, accuracy))
    found = [replay(machine, start, _EVENTS, stretches.until) for start in stretches.starts]
    wrong = waiting_errors(found, stretches.expected)
    if not len(wrong):
        return Row(study=RATE, label=label, line=line, note="no bond event happened alike")
    return Row(
        study=RATE,
        label=label,
        line=line,
        error=float(np.median(wrong)),
        worst=float(wrong.max()),
        time=_time_of_run(subject, machine),
        values={"events compared": Estimate(float(len(wrong)))},
    )


def _time_of_run(subject: Subject, machine: Machine) -> float:
    """Give the time (s) of the scene's run; of a part of it, times the rest, where it is long."""
    way = travel(machine, subject.until, ends_of(subject.scene, machine.problem, _PATIENCE))
    cut = way.took > _PATIENCE
    return way.took * (subject.own.last.time / way.last.time if cut and way.last.time > 0 else 1.0)


def has_events(subject: Subject) -> bool:
    """Tell whether bonds can form or break in the scene at all."""
    return bool(subject.problem.site_densities.any()) and len(subject.problem.species) > 0
