"""Every installed force law keeps the contract."""

from typing import Any

import pytest

from mpad_core.plugins.registry import installed, load
from mpad_core.testing import GapForceContract, typical


class TestInstalledForces(GapForceContract):
    @pytest.fixture(autouse=True, params=[part.name for part in installed("force")])
    def _part(self, request: Any) -> None:
        self.force = typical(load("force", request.param))
