"""One run into one directory: march, record, keep checkpoints, stop in order, go on bit for bit."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from attrs import field, frozen

from mpad_core.interfaces.errors import InputError, InterruptedRunError, MpadError, PartError, RefusedError
from mpad_core.physics.asking import one_line
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import State, from_arrays
from mpad_core.records.checkpoint import read_checkpoint
from mpad_core.records.log import RunLog
from mpad_core.records.progress import Progress
from mpad_core.records.room import NearlyFullError
from mpad_core.running.accounting import Account, Accounts
from mpad_core.running.initial import initial_state
from mpad_core.running.march import Machine, make_ready, march
from mpad_core.running.recorder import (
    CHECKPOINT,
    TRAJECTORY,
    Recorder,
    Recording,
    begin_recording,
    close_observers,
    go_on_recording,
)
from mpad_core.running.stopping import Signals, StopWhen, first_that_holds

CHECKPOINT_EVERY = 2.0  # s of wall time


@frozen(kw_only=True)
class Order:
    """What a single run is to do."""

    problem: Problem
    recording: Recording
    until: float  # s
    stop_when: Sequence[StopWhen] = ()
    checkpoint_every: float = CHECKPOINT_EVERY


@frozen(kw_only=True)
class Outcome:
    """How a single run ended."""

    state: State = field(repr=False)
    ended: str  # "time", or the condition that held
    sub_step: float  # s
    account: Account = field(repr=False)  # of what this process did of the run


@frozen(kw_only=True)
class _Listeners:
    """All who hear of every outer step."""

    recorder: Recorder
    accounts: Accounts
    signals: Signals
    bar: Progress


@frozen(kw_only=True)
class Session:
    """What the single runs of a process share."""

    log: RunLog
    signals: Signals  # heard from before the first one
    resume: bool  # go on with what is there


def run_one(order: Order, directory: Path, session: Session, bar: Progress) -> Outcome:
    """Run into a directory, whose lock the caller holds, or go on with what is there.

    Raises
    ------
    InputError
        If the directory holds a run and `resume` was not asked for.
    InterruptedRunError
        After SIGINT or SIGTERM, with a checkpoint written.
    PartError
        If a part raises, naming the step.
    DiskFullError
        With a checkpoint written where there was room.
    """
    directory.mkdir(parents=True, exist_ok=True)
    with _named_parts(order.problem, "before step one"):
        machine = make_ready(order.problem)
        recorder, state, ended = _begin(order, machine, directory, session)
    listeners = _Listeners(recorder=recorder, accounts=Accounts.of(machine), signals=session.signals, bar=bar)
    with _closed(recorder):
        state, ended = _go_on(order, listeners, state, ended)
    account = listeners.accounts.closed()
    if account.fault:
        session.log.write("shares of effects not told", why=account.fault)
    return Outcome(state=state, ended=ended, sub_step=machine.pace.sub_step, account=account)


@contextmanager
def _named_parts(problem: Problem, when: str, remedy: str = "") -> Iterator[None]:
    """Add the moment to what a part raises, and what would do; an error that names no part gets all their names."""
    try:
        yield
    except (PartError, RefusedError) as error:
        raise type(error)(f"{error}; {when}{remedy}") from error
    except MpadError:
        raise
    except (Exception, SystemExit) as error:
        names = [problem.solver.name, *(s.model.name for s in problem.species)]
        what = f"a part failed (parts: {', '.join(names)}): {one_line(error)}; {when}{remedy}"
        raise PartError(what) from error


@contextmanager
def _closed(recorder: Recorder) -> Iterator[None]:
    """End trajectory and observers in order; a trajectory that an error has broken is let go of."""
    try:
        yield
        recorder.writer.close()
    except MpadError:
        try:
            recorder.writer.close()
        except MpadError:
            recorder.writer.abandon()
        raise
    finally:
        close_observers(recorder.recording.observers)


def _begin(order: Order, machine: Machine, directory: Path, session: Session) -> tuple[Recorder, State, str]:
    """Give the recorder, the state to march from (a checkpoint's, or time zero's), and why the run is over if it is."""
    checkpoint = directory / CHECKPOINT
    if not session.resume and (checkpoint.exists() or (directory / TRAJECTORY).exists()):
        raise InputError(f"{directory}: holds a run already; add --resume to go on with it, or choose another with -o")
    if not checkpoint.exists():
        session.log.write("preparing", run=directory.name, cells=order.problem.names)
        state = _prepared(machine, session.signals)
        return begin_recording(order.recording, machine, directory, state), state, ""
    kept = read_checkpoint(checkpoint)
    try:
        state = from_arrays(kept, len(order.problem.names), len(machine.fixed.molecules.kind))
        ended = kept["ended"]
        if str(ended) not in {"", "time", *(condition.text for condition in order.stop_when)}:
            raise ValueError(f"it ended by {str(ended)!r}")
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise InputError(f"{checkpoint}: does not fit the scene ({one_line(error)}); start anew with -o") from error
    session.log.write("resumed", run=directory.name, simulated=state.time)
    return go_on_recording(order.recording, order.problem, directory, kept), state, str(ended)


def _prepared(machine: Machine, signals: Signals) -> State:
    """Give the state at time zero; cells that first roll alone do so here."""

    def hear(name: str, state: State) -> None:
        if signals.received:
            raise InterruptedRunError(f"interrupted while {name!r} first rolled alone; start anew", signals.received)

    return initial_state(machine, hear)


def _go_on(order: Order, listeners: _Listeners, state: State, ended: str) -> tuple[State, str]:
    """March to the end; give the last state and why it ended."""
    if ended:
        return state, ended
    recorder, signals = listeners.recorder, listeners.signals
    # a condition may hold already: for the first state, or for one kept just before the process died
    ended = first_that_holds(order.stop_when, order.problem, state) or ""
    kept_at, before = time.monotonic(), state
    marching = march(listeners.accounts.machine, state, order.until)
    next(marching)
    while not ended:
        now = f"at t = {before.time:.6g} s, step {before.step - before.zero}"
        with _named_parts(order.problem, now, "; go on with --resume"):
            began = time.perf_counter()
            after = next(marching, None)
            marched = time.perf_counter()
            if after is None:
                break
            try:
                recorder.hear(before, after)
            except NearlyFullError:
                recorder.keep(after)
                raise
            listeners.accounts.hear(before, after, marched - began, time.perf_counter() - marched)
        before = after
        listeners.bar.update(after.time, after.step - after.zero)
        ended = first_that_holds(order.stop_when, order.problem, after) or ""
        if signals.received:
            recorder.keep(after)
            raise InterruptedRunError(f"interrupted at t = {after.time:.6g} s; go on with --resume", signals.received)
        if time.monotonic() - kept_at > order.checkpoint_every:
            recorder.keep(after)
            kept_at = time.monotonic()
    recorder.finish(before)
    recorder.keep(before, ended or "time")
    return before, ended or "time"
