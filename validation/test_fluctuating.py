"""Every installed solver that can drive thermal motion keeps the contract for it."""

from typing import Any

import pytest

from mpad_core import Fluctuating, solver
from mpad_core.plugins.registry import installed
from mpad_core.testing import FluctuatingContract

CASES: list[tuple[str, dict[str, Any]]] = [(part.name, {}) for part in installed("solver")]
CASES += [("rpb", {"lone_sphere": "blake"}), ("cdl-biem", {"discretisation": "elements", "elements": 24})]
FLUCTUATING = [case for case in CASES if isinstance(solver(case[0], **case[1]), Fluctuating)]


class TestInstalledFluctuatingSolvers(FluctuatingContract):
    @pytest.fixture(autouse=True, params=FLUCTUATING, ids=lambda case: "-".join((case[0], *map(str, case[1].values()))))
    def _part(self, request: Any) -> None:
        name, parameters = request.param
        self.solver = solver(name, **parameters)
        self.many = 8 if "elements" in parameters else 27  # by elements, many are treated as few are
