"""Every installed surface keeps the contract; one that follows several laws, under each of them."""

from typing import Any

import pytest

from mpad_core.testing import SurfaceContract
from mpad_core.testing.suite.cases import Chosen, cases


class TestInstalledSurfaces(SurfaceContract):
    @pytest.fixture(autouse=True, params=cases("surface", Chosen()), ids=lambda case: case.label.replace(" ", "-"))
    def _part(self, request: Any) -> None:
        self.surface = request.param.made()
