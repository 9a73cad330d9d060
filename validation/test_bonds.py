"""Every installed bond model keeps the contract."""

from typing import Any

import pytest

from mpad_core.testing import BondModelContract
from mpad_core.testing.suite.cases import Chosen, cases


class TestInstalledBonds(BondModelContract):
    @pytest.fixture(autouse=True, params=cases("bond", Chosen()), ids=lambda case: case.label)
    def _part(self, request: Any) -> None:
        self.model = request.param.made()
