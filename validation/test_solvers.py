"""Every installed solver keeps the contract, and so does `rpb` with bare lone spheres."""

from typing import Any

import pytest

from mpad_core import solver
from mpad_core.plugins.registry import installed
from mpad_core.testing import MobilitySolverContract

CHEAP = {"auto": {"accuracy": 0.05, "levels": ("isolated", "rpb lone_sphere=exact", "sd reach=8.0")}}
CASES: list[tuple[str, dict[str, Any]]] = [(part.name, CHEAP.get(part.name, {})) for part in installed("solver")]
CASES.append(("rpb", {"lone_sphere": "blake"}))


class TestInstalledSolvers(MobilitySolverContract):
    @pytest.fixture(autouse=True, params=CASES, ids=lambda case: "-".join((case[0], *map(str, case[1].values()))))
    def _part(self, request: Any) -> None:
        name, parameters = request.param
        self.solver = solver(name, **parameters)
