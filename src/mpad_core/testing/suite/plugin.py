"""The pytest plugin of the validation suite: which parts are asked, and what each law has stated about them.

Every process of a run has it, workers too. What a law states travels with its report, as `Told`.
"""

from collections.abc import Generator
from functools import lru_cache
from pathlib import Path
from typing import Any

import pytest
from attrs import asdict

from mpad_core.physics.asking import one_line
from mpad_core.testing.asking import AskedSolver, Place
from mpad_core.testing.claims import Stated, collected
from mpad_core.testing.reproducing import place_of, scene_text
from mpad_core.testing.rows import Told
from mpad_core.testing.suite.cases import KINDS, Case, Chosen, beside, cases, finest, of_scene, parts

TOLD = "mpad-told"
"""Under which name a test's properties hold what it has told."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Take the parts that are to be asked, and the one place where."""
    for kind in KINDS:
        parser.addoption(f"--mpad-{kind}", action="append", default=[], help=f"ask this {kind}")
    parser.addoption("--mpad-at", default=None, help="ask the solver of this scene, at its configuration only")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Give each law its cases, by the name of what it asks for."""
    wanted = set(metafunc.fixturenames) & {*_CASES}
    for name in wanted:
        found = _CASES[name](metafunc.config)
        metafunc.parametrize(name, found, ids=[_label(case) for case in found])


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out laws for which there is no case."""
    items[:] = [item for item in items if _is_asked(item)]


def _is_asked(item: Any) -> bool:
    given = getattr(getattr(item, "callspec", None), "params", {})
    return any(isinstance(given.get(name), Case | tuple) for name in _CASES)


def chosen_of(config: pytest.Config) -> Chosen:
    """Give the parts that were named on the command line."""
    return Chosen(names={kind: tuple(config.getoption(f"--mpad-{kind}")) for kind in KINDS})


@lru_cache(maxsize=1)
def _scene(path: str) -> tuple[Case, Place]:
    from mpad_core.scene.files import load_scene

    scene = load_scene(Path(path))
    return of_scene(scene.solver), place_of(scene)


def only_place(config: pytest.Config) -> Place | None:
    """Give the place of the scene that was named, if one was."""
    path = config.getoption("--mpad-at")
    return _scene(path)[1] if path else None


def _solvers(config: pytest.Config) -> list[Case]:
    path = config.getoption("--mpad-at")
    return [_scene(path)[0]] if path else cases("solver", chosen_of(config))


def _others(kind: str, config: pytest.Config) -> list[Case]:
    return [] if config.getoption("--mpad-at") else cases(kind, chosen_of(config))


def _levels(config: pytest.Config) -> list[tuple[Case, Case]]:
    judge = finest()
    return [] if judge is None else [(case, judge) for case in _solvers(config) if case.label != judge.label]


_CASES: dict[str, Any] = {
    "solver_case": _solvers,
    "solver_pair": lambda config: list(beside(_solvers(config))),
    "solver_level": _levels,
    "bond_case": lambda config: _others("bond", config),
    "surface_case": lambda config: _others("surface", config),
    "force_case": lambda config: _others("force", config),
    "part": lambda config: [] if config.getoption("--mpad-at") else parts(chosen_of(config)),
}


def _label(case: Any) -> str:
    if isinstance(case, Case):
        return case.label
    return " beside ".join(one.label for one in case) if isinstance(case[0], Case) else " ".join(case)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Generator[None, Any, Any]:
    """Put what the law has told into the report of its call, or of what has kept it from being called."""
    report = yield
    if call.when == "call" or (call.when == "setup" and not report.passed):
        stated = getattr(item, "mpad_stated", Stated())
        report.user_properties.append((TOLD, asdict(_told(item, call, stated, report))))
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    """Collect the claims that a law states."""
    with collected() as stated:
        item.mpad_stated = stated  # type: ignore[attr-defined]
        yield


def _told(item: Any, call: "pytest.CallInfo[None]", stated: Stated, report: Any) -> Told:
    """Say what a law has told of a part."""
    kind, part, first = _asked(item)
    law, _, _ = item.originalname.removeprefix("test_").partition("[")
    told = Told(kind=kind, part=part, law=law.replace("_", " "), meaning=_first_line(item.function))
    told = told.with_claims(stated)
    if report.passed:
        return told
    if report.skipped:
        return told.left_out(_reason(call))
    fault = call.excinfo.value if call.excinfo else None
    broken = bool(stated.claims) and isinstance(fault, AssertionError) and str(fault) == str(stated.claims[-1])
    reason = "" if broken else one_line(fault) if fault is not None else "failed"
    return told.failed(stated.claims[-1] if broken else None, reason, _reproduced(item, first, told, reason, stated))


def _asked(item: Any) -> tuple[str, str, Case | None]:
    """Give kind and label of what a law was asked of, and the first case."""
    given = item.callspec.params
    name, case = next((name, given[name]) for name in _CASES if name in given)
    if name == "part":
        return case[0], case[1], None
    first = case[0] if isinstance(case, tuple) else case
    return first.kind, _label(case) if name == "solver_pair" else first.label, first


def _first_line(function: Any) -> str:
    return (function.__doc__ or "").strip().partition("\n")[0]


def _reason(call: "pytest.CallInfo[None]") -> str:
    return str(getattr(call.excinfo.value, "msg", call.excinfo.value)) if call.excinfo else "skipped"


def _reproduced(item: Any, case: Case | None, told: Told, reason: str, stated: Stated) -> str:
    """Write the scene at which a solver's law has failed; empty for other parts, and where it was asked nowhere."""
    instance = item.instance
    if case is None or not isinstance(instance, AskedSolver) or instance.asked is None:
        return ""
    says = reason or str(stated.claims[-1])
    return scene_text(case, instance.asked, f"{told.part}: {told.law}: {told.meaning}", says)
