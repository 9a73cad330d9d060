"""Stand-ins for installed parts, so that these tests need no plugin."""

from pathlib import Path
from typing import Any, ClassVar, Literal

import pytest
from attrs import field, frozen, validators

from mpad_core.interfaces.errors import InputError
from mpad_core.plugins import registry
from mpad_core.units import quantity


@frozen(kw_only=True)
class Rpb:
    name: ClassVar[str] = "rpb"
    lone_sphere: Literal["exact", "rpb"] = "exact"
    order: int = 3
    tolerance: float = 1e-6


@frozen(kw_only=True)
class Isolated:
    name: ClassVar[str] = "isolated"


@frozen(kw_only=True)
class Bell:
    name: ClassVar[str] = "bell"
    rest_length: float = quantity("um")
    stiffness: float = quantity("pN/um")
    kT: float = quantity("pN um")  # noqa: N815  # the field's symbol
    off_rate: float = quantity("1/s")
    reactive_compliance: float = quantity("um")

    def __attrs_post_init__(self) -> None:
        if self.reactive_compliance > self.rest_length:
            raise ValueError("reactive_compliance must be shorter than the bond")


@frozen(kw_only=True)
class Uniform:
    name: ClassVar[str] = "uniform"
    sites: float = quantity("1/um^2", alias="density")


@frozen(kw_only=True)
class Electrostatic:
    name: ClassVar[str] = "electrostatic"
    strength: float = quantity("pN um")
    decay: float = quantity("1/um")


@frozen(kw_only=True)
class Spring:
    """Without units in its metadata, as a stranger may write one."""

    name: ClassVar[str] = "spring"
    stiffness: float
    number: int = 2
    reach: float = field(default=0.5, validator=validators.gt(0))
    gentle: bool = False
    box: tuple[float, ...] = (1.0, 2.0)
    inner: float | None = None


@frozen(kw_only=True)
class Watcher:
    name: ClassVar[str] = "watcher"
    label: str = "w"


FAKES: dict[tuple[str, str], Any] = {
    ("solver", "rpb"): Rpb,
    ("solver", "isolated"): Isolated,
    ("bond", "bell"): Bell,
    ("surface", "uniform"): Uniform,
    ("force", "electrostatic"): Electrostatic,
    ("force", "spring"): Spring,
    ("observer", "watcher"): Watcher,
}


@pytest.fixture
def fake_parts(monkeypatch: pytest.MonkeyPatch) -> dict[tuple[str, str], Any]:
    """Put the stand-ins in the registry's place; a test may add to them."""
    parts = dict(FAKES)

    def load(kind: str, name: str) -> Any:
        if (kind, name) not in parts:
            known = [other for family, other in parts if family == kind]
            raise InputError(f"no {kind} {name!r} is installed{registry.nearest(name, known)}")
        return parts[kind, name]

    def installed(kind: str | None = None) -> list[registry.InstalledPart]:
        return [registry.InstalledPart(k, n, "fakes", "1", "fakes") for k, n in parts if kind in (None, k)]

    monkeypatch.setattr(registry, "load", load)
    monkeypatch.setattr(registry, "installed", installed)
    return parts


@pytest.fixture
def examples() -> dict[str, str]:
    """The text of each example, by name."""
    folder = Path(__file__).parents[2] / "examples"
    return {name: (folder / f"{name}.toml").read_text(encoding="utf-8") for name in ("recruitment", "capture")}


@pytest.fixture
def small() -> str:
    """The shortest useful scene: one bead in unbounded quiescent fluid."""
    return """\
solver = "isolated"
stop = { time = "1 s" }
fluid = { viscosity = "1 mPa s" }
[kinds.bead]
radius = "5 um"
[cells.a]
kind = "bead"
height = "0 um"
"""
