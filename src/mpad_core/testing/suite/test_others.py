"""Every chosen part loads; every chosen bond model, surface and force law keeps its contract."""

from typing import Any

import pytest

from mpad_core.plugins.registry import load
from mpad_core.testing import BondModelContract, GapForceContract, SurfaceContract
from mpad_core.testing.suite.cases import Case, Chosen, cases


def test_loads(part: tuple[str, str]) -> None:
    """It can be loaded, and made with its samples or levels."""
    kind, name = part
    load(kind, name)
    asked: list[Case] = cases(kind, Chosen(names={kind: (name,)}))
    assert asked
    for case in asked:
        case.made()


class TestBond(BondModelContract):
    """What every bond model promises."""

    @pytest.fixture(autouse=True)
    def _part(self, bond_case: Any) -> None:
        self.model = bond_case.made()


class TestSurface(SurfaceContract):
    """What every surface promises."""

    @pytest.fixture(autouse=True)
    def _part(self, surface_case: Any) -> None:
        self.surface = surface_case.made()


class TestForce(GapForceContract):
    """What every force law promises."""

    @pytest.fixture(autouse=True)
    def _part(self, force_case: Any) -> None:
        self.force = force_case.made()
