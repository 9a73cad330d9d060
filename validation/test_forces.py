"""Every installed force law keeps the contract."""

from typing import Any

import pytest

from mpad_core.testing import GapForceContract
from mpad_core.testing.suite.cases import Chosen, cases


class TestInstalledForces(GapForceContract):
    @pytest.fixture(autouse=True, params=cases("force", Chosen()), ids=lambda case: case.label)
    def _part(self, request: Any) -> None:
        self.force = request.param.made()
