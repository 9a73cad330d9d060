"""Every installed surface keeps the contract; one that follows several laws, under each of them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import image

from mpad_core.plugins.registry import installed, load
from mpad_core.testing import SurfaceContract, typical

GIVEN: dict[str, list[dict[str, Any]]] = {
    "pattern": [
        {"kind": "stripes", "period": 7.0, "angle": 20.0, "low": 11.3},
        {"kind": "checkerboard", "period": 3.0, "angle": -40.0},
        {"kind": "gradient", "start": -300.0, "end": 2000.0, "angle": 100.0, "low": 0.3},
        {"kind": "mask", "pixel": 1.7, "outside": "repeat", "low": 250.1},
        {"kind": "mask", "pixel": 1.7, "outside": "low"},
    ]
}
ASKED = [(part.name, given) for part in installed("surface") for given in GIVEN.get(part.name, [{}])]


class TestInstalledSurfaces(SurfaceContract):
    @pytest.fixture(autouse=True, params=ASKED, ids=lambda asked: "-".join([asked[0], *map(str, asked[1].values())]))
    def _part(self, request: Any, tmp_path: Path) -> None:
        name, given = request.param
        if given.get("kind") == "mask":
            given = given | {"image": str(tmp_path / "grey.png")}
            image.imsave(given["image"], np.random.default_rng(1).random((400, 300)), cmap="gray")
        self.surface = typical(load("surface", name), **given)
