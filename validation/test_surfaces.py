"""Every installed surface keeps the contract."""

from typing import Any

import pytest

from mpad_core.plugins.registry import installed, load
from mpad_core.testing import SurfaceContract, typical


class TestInstalledSurfaces(SurfaceContract):
    @pytest.fixture(autouse=True, params=[part.name for part in installed("surface")])
    def _part(self, request: Any) -> None:
        self.surface = typical(load("surface", request.param))
