"""How far a run is: a bar for people at a terminal, a JSON line now and then for everybody else."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol, TextIO

from attrs import define, field

from mpad_core.records.log import RunLog, json_line

INTERVAL = 10.0  # s of wall time between two lines

_BAR = "{desc}: {percentage:5.1f} %|{bar}| {n:.4g}/{total:.4g} s{postfix}"


class Progress(Protocol):
    """Hears how far the run has come."""

    def update(self, simulated: float, step: int) -> None:
        """Hear the simulated time (s) and the step; called as often as is convenient."""
        ...

    def close(self) -> None:
        """Hear that no more will come."""
        ...


@contextmanager
def progress(
    total_time: float,
    *,
    start: float = 0.0,
    log: RunLog | None = None,
    stream: TextIO | None = None,
    interval: float = INTERVAL,
) -> Iterator[Progress]:
    """Show the progress of a run while the block lasts.

    On a terminal a bar is drawn: simulated time, speed (simulated seconds a second of wall time), time left. Elsewhere
    a line of JSON goes to the stream every interval. Either way that line also goes to the log.

    Parameters
    ----------
    total_time
        s, simulated, at which the run ends
    start
        s, simulated, at which it begins or is resumed
    log
        the run's log, if it keeps one
    stream
        standard error unless told otherwise
    interval
        s of wall time between two lines; the first comes after the first interval
    """
    shown = sys.stderr if stream is None else stream
    terminal = shown.isatty()
    listeners: list[Progress] = [_Bar(total_time, start, shown)] if terminal else []
    sinks: list[Callable[[str], object]] = [] if terminal else [lambda line: _print(shown, line)]
    lines = _Lines(_Speed(total_time, start), interval, log, sinks)
    everyone = _Everyone([*listeners, lines])
    try:
        yield everyone
    finally:
        everyone.close()


def warn(log: RunLog, effect: str, text: str) -> None:
    """Write a warning to the log and to standard error: in words on a terminal, elsewhere as the log's line."""
    line = log.write("warning", effect=effect, text=text)
    _print(sys.stderr, f"warning: {effect}: {text}\n" if sys.stderr.isatty() else line)


@define
class _Everyone:
    listeners: list[Progress]

    def update(self, simulated: float, step: int) -> None:
        for listener in self.listeners:
            listener.update(simulated, step)

    def close(self) -> None:
        for listener in self.listeners:
            listener.close()


@define
class _Speed:
    """Speed since the beginning of this process, and what it promises."""

    total: float
    start: float
    began: float = field(factory=lambda: time.monotonic())

    def so_far(self, simulated: float) -> tuple[float, float]:
        """Give simulated seconds a second, and seconds of wall time left; infinite before anything has moved."""
        elapsed = max(time.monotonic() - self.began, 1e-9)
        speed = (simulated - self.start) / elapsed
        return speed, (self.total - simulated) / speed if speed > 0 else float("inf")


@define
class _Lines:
    """Gives a line every interval, to the log and to whoever else listens."""

    speed: _Speed
    interval: float
    log: RunLog | None
    sinks: list[Callable[[str], object]]
    last: float = field(factory=lambda: time.monotonic())

    def update(self, simulated: float, step: int) -> None:
        now = time.monotonic()
        if now - self.last < self.interval:
            return
        self.last = now
        speed, left = self.speed.so_far(simulated)
        data = {"simulated": simulated, "total": self.speed.total, "step": step, "speed": speed, "left": left}
        line = self.log.write("progress", **data) if self.log else json_line("progress", data)
        for sink in self.sinks:
            sink(line)

    def close(self) -> None:
        pass


class _Bar:
    def __init__(self, total: float, start: float, stream: TextIO) -> None:
        from tqdm import tqdm  # only where somebody looks

        self._speed = _Speed(total, start)
        self._bar = tqdm(total=total, initial=start, desc="mpad", file=stream, bar_format=_BAR)

    def update(self, simulated: float, step: int) -> None:
        speed, left = self._speed.so_far(simulated)
        self._bar.set_postfix_str(f"{speed:.3g} s/s, {_clock(left)} left", refresh=False)
        self._bar.update(simulated - self._bar.n)

    def close(self) -> None:
        self._bar.close()


def _clock(seconds: float) -> str:
    if seconds == float("inf"):
        return "?"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"


def _print(stream: TextIO, line: str) -> None:
    stream.write(line)
    stream.flush()
