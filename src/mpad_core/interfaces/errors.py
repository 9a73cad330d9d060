"""The errors that people see: one clear line, an exit code, never a traceback."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


class MpadError(Exception):
    """What mpad tells its user in one line."""

    exit_code = 70


class InputError(MpadError):
    """Bad input: says where, what is wrong, and what would do. ``lines`` holds one line for each fault."""

    exit_code = 2

    def __init__(self, *lines: str) -> None:
        super().__init__("\n".join(lines))
        self.lines = lines


class PartError(MpadError):
    """A part (plugin) failed: names the part and the distribution it came from."""


class RefusedError(MpadError):
    """The numerics refuse to answer: names what could not be treated, and where."""


def refuse_first(solver: str, fault: str, values: Any, bad: Any) -> None:
    """Refuse the first sphere that is bad, if there is one.

    Parameters
    ----------
    solver
        Who refuses.
    fault
        What is wrong with the sphere; ``{}`` stands for its value.
    values, bad : (N, ...), (N,)
        Arrays: of every sphere the value, and whether it is at fault.
    """
    if bad.any():
        first = int(bad.argmax())
        raise RefusedError(f"{solver}: sphere {first}: " + fault.format(values[first].tolist()))


@contextmanager
def refused(solver: str, where: Callable[[], str] | None = None) -> Iterator[None]:
    """Turn what arithmetic could not do into a solver's refusal; what `where` gives then follows after a semicolon."""
    try:
        yield
    except FloatingPointError as error:
        raise RefusedError(f"{solver}: {error}" + (f"; {where()}" if where else "")) from error


class DiskFullError(MpadError):
    """No room to record; all recorded so far is kept."""

    exit_code = 74


class BusyError(MpadError):
    """Another process is writing to the run directory."""

    exit_code = 75


class InterruptedRunError(MpadError):
    """The run was told to stop and has written a checkpoint; ``exit_code`` is 128 + the signal's number."""

    def __init__(self, message: str, signal_number: int) -> None:
        super().__init__(message)
        self.exit_code = 128 + signal_number
