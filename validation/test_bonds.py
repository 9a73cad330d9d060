"""Every installed bond model keeps the contract."""

from typing import Any

import pytest

from mpad_core.plugins.registry import installed, load
from mpad_core.testing import BondModelContract, typical


class TestInstalledBonds(BondModelContract):
    @pytest.fixture(autouse=True, params=[part.name for part in installed("bond")])
    def _part(self, request: Any) -> None:
        self.model = typical(load("bond", request.param))
