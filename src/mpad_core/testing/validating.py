"""Running the validation suite: pytest inside this process, away from the user's own settings, and what it has told."""

import contextlib
import io
import os
import re
import signal
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from attrs import field, frozen

from mpad_core.interfaces.errors import InputError, InterruptedRunError, PartError
from mpad_core.testing import suite
from mpad_core.testing.report import Validation, json_text
from mpad_core.testing.rows import Told, told_of
from mpad_core.testing.suite.cases import KINDS, Chosen
from mpad_core.testing.suite.plugin import TOLD

_WORKERS = 2
_HOME = Path(suite.__file__).parent
_QUIET = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_ADDOPTS": "", "PYTEST_PLUGINS": ""}


@frozen(kw_only=True)
class Asked:
    """What is to be validated.

    Attributes
    ----------
    chosen
        The parts; all that are installed by default.
    at
        A scene: its solver is asked at its configuration, and nothing else.
    workers
        Processes, if pytest-xdist is there.
    """

    chosen: Chosen = field(factory=Chosen)
    at: Path | None = None
    workers: int = _WORKERS

    def arguments(self) -> list[str]:
        """Give pytest's arguments."""
        several = self.workers > 1 and self.at is None and find_spec("xdist") is not None
        spread = ["-p", "xdist.plugin", "-n", str(self.workers), "--dist", "worksteal"] if several else []
        parts = [f"--mpad-{kind}={name}" for kind in KINDS for name in self.chosen.names.get(kind, ())]
        scene = [f"--mpad-at={self.at.resolve()}"] if self.at else []
        house = ["-c", str(_HOME / "suite.ini"), "--rootdir", str(_HOME), "--import-mode=importlib", "-q"]
        own = ["-p", "mpad_core.testing.suite.plugin", "-p", "no:cacheprovider", "--tb=short"]
        return [*own, *house, *spread, *parts, *scene, str(_HOME)]


def asked(named: Mapping[str, Sequence[str]], at: Path | None) -> Asked:
    """Give what a command line asks for.

    Parameters
    ----------
    named
        Names of parts, by the plural of their kind.
    at
        A scene, or none.
    """
    if at is not None and any(named.values()):
        raise InputError("--at asks the scene's own solver: leave out --solver, --bond, --surface and --force")
    return Asked(chosen=Chosen(names={kind: tuple(named.get(f"{kind}s", ())) for kind in KINDS}), at=at)


class _Listener:
    """Hears the reports of all processes."""

    def __init__(self) -> None:
        self.told: list[Told] = []
        self.broken: list[str] = []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Take up what a law has told."""
        told = [told_of(value) for name, value in _properties(report) if name == TOLD]
        if report.failed and not told:  # a process has died
            self.broken.append(f"{report.nodeid}: {report.longreprtext}")
        self.told += told[-1:] if report.when == "call" or not report.passed else []
        if told and sys.stderr is not None and sys.stderr.isatty():
            print(f"\r{len(self.told)} laws asked", end="", file=sys.stderr, flush=True)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Take up what cannot even be collected."""
        if report.failed:
            self.broken.append(str(report.longrepr))


def _properties(report: pytest.TestReport) -> list[tuple[str, Any]]:
    return [(str(name), value) for name, value in report.user_properties]


def validate(asked: Asked) -> Validation:
    """Ask all laws, and give what was found.

    Raises
    ------
    InputError
        For parts that are not installed, and a scene that cannot be read.
    PartError
        If the suite itself cannot be run.
    """
    for kind in KINDS:
        asked.chosen.of(kind)
    if asked.at is not None:
        from mpad_core.scene.files import load_scene

        load_scene(asked.at)
    listener, said = _Listener(), io.StringIO()
    with _away_from_the_users_settings(), contextlib.redirect_stdout(said):
        code = pytest.main(asked.arguments(), plugins=[listener])
    if code == pytest.ExitCode.INTERRUPTED:
        raise InterruptedRunError("interrupted", signal.SIGINT)
    if listener.broken or code not in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED) or not listener.told:
        last = (listener.broken or said.getvalue().strip().splitlines() or ["no law was asked"])[-1]
        raise PartError(f"the validation suite cannot be run: {' '.join(last.split())[-400:]}")
    return Validation.of(listener.told)


@contextlib.contextmanager
def _away_from_the_users_settings() -> Iterator[None]:
    """Let neither pytest's variables nor other plugins that are installed change what is asked."""
    before = {name: os.environ.get(name) for name in _QUIET}
    os.environ.update(_QUIET)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


def scene_names(validation: Validation) -> dict[str, str]:
    """Give the scenes that reproduce failures, by the name of a file."""
    return {
        re.sub(r"[^\w.=+-]+", "-", f"{told.part}-{told.law}") + ".toml": told.scene
        for told in validation.told
        if told.scene
    }


def failure_line(validation: Validation) -> str:
    """Name in one line the parts and claims that fail; empty if none does."""
    named: dict[str, list[str]] = {}
    for told, row in validation.failing:
        claim = f"{row.claim} ({row.reason})" if row.reason else row.claim
        named.setdefault(f"{told.kind} {told.part}", []).append(claim)
    parts = [f"{part}: {', '.join(dict.fromkeys(claims))}" for part, claims in named.items()]
    return f"claims that fail: {'; '.join(parts)}" if parts else ""


def write(validation: Validation, path: Path) -> list[Path]:
    """Write the JSON, and beside it a scene for each failure that has one.

    Raises
    ------
    InputError
        If they cannot be written.
    """
    texts = {path: json_text(validation)} | {path.parent / name: text for name, text in scene_names(validation).items()}
    for file, text in texts.items():
        try:
            file.write_text(text, encoding="utf-8")
        except OSError as error:
            what = f"cannot be written: {error.strerror}; name a file in a folder that exists"
            raise InputError(f"{file}: {what}") from error
    return list(texts)
