"""When a run ends before its time: the scene's conditions, and signals."""

import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

from attrs import define, frozen

from mpad_core.interfaces.errors import InterruptedRunError
from mpad_core.physics.measures import dx_of
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import State


@frozen(kw_only=True)
class StopWhen:
    """One condition: a cell's quantity passes a value (µm); ``caught`` passes zero when the cell is caught."""

    cell: str
    quantity: str
    above: bool
    value: float
    text: str

    def holds(self, problem: Problem, state: State) -> bool:
        """Tell whether the run ends; never for a cell that has been taken away."""
        if self.cell not in problem.names:
            return False
        i = problem.names.index(self.cell)
        measured = _MEASURED[self.quantity](problem, state, i)
        return measured > self.value if self.above else measured < self.value


_MEASURED: dict[str, Callable[[Problem, State, int], float]] = {
    "dx": lambda problem, state, i: float(dx_of(problem, state.centres)[i]),
    "x": lambda problem, state, i: float(state.centres[i, 0]),
    "y": lambda problem, state, i: float(state.centres[i, 1]),
    "z": lambda problem, state, i: float(state.centres[i, 2]),
    "overlap": lambda problem, state, i: float(state.centres[i, 2] - problem.zero_overlap[i]),
    "caught": lambda problem, state, i: float(state.caught_since[i] <= state.time),
}


def first_that_holds(conditions: Sequence[StopWhen], problem: Problem, state: State) -> str | None:
    """Give the text of the first condition that holds."""
    return next((condition.text for condition in conditions if condition.holds(problem, state)), None)


@define
class Signals:
    """Remembers the signal that asked the run to stop."""

    received: int = 0

    def _hear(self, number: int, frame: FrameType | None) -> None:
        self.received = number


@contextmanager
def interruptible() -> Iterator[None]:
    """Let SIGINT and SIGTERM end, at once, what nobody can go on with later.

    Raises
    ------
    InterruptedRunError
        When one of them comes.
    """

    heard: list[int] = []

    def end(number: int, frame: FrameType | None) -> None:
        heard.append(number)
        raise KeyboardInterrupt  # which no part can take for a fault of its own

    try:
        before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
    except ValueError:  # only the main thread may set handlers
        yield
        return
    try:
        yield
    except KeyboardInterrupt:
        number = heard[-1] if heard else signal.SIGINT
        raise InterruptedRunError("interrupted before the run began; start anew", number) from None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def listening() -> Iterator[Signals]:
    """Turn SIGINT and SIGTERM into a note, while the block lasts; outside the main thread nothing is heard."""
    heard = Signals()
    try:
        before = {number: signal.signal(number, heard._hear) for number in (signal.SIGINT, signal.SIGTERM)}
    except ValueError:  # only the main thread may set handlers
        yield heard
        return
    try:
        yield heard
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
