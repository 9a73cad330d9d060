"""Parts made with typical numbers, so that every installed part can be tried without being known."""

import atexit
import shutil
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, ClassVar

import attrs
import numpy as np
from attrs import frozen

from mpad_core.arrays import Array

THERMAL_ENERGY = 4.11e-3  # pN µm, at 298 K
REST_LENGTH = 0.03  # µm, of a selectin bond (King & Hammer, PNAS 2001)

_BY_NAME: dict[str, Any] = {
    "rest_length": REST_LENGTH, "kT": THERMAL_ENERGY, "stiffness": 1e4, "transition_stiffness": 9e3,
    "strength": 500.0, "decay": 565.0, "density": 180.0,
}  # fmt: skip
_BY_UNIT: dict[str, Any] = {
    "1/s": 2.0, "um": 4e-5, "1/um": 100.0, "1/um^2": 100.0, "pN": 10.0, "pN/um": 1e4, "pN um": THERMAL_ENERGY, "s": 0.1,
}  # fmt: skip

_SAMPLES: dict[str, Sequence[Mapping[str, Any]]] = {
    "pattern": (
        {"kind": "stripes", "period": 7.0, "angle": 20.0, "low": 11.3},
        {"kind": "checkerboard", "period": 3.0, "angle": -40.0},
        {"kind": "gradient", "start": -300.0, "end": 2000.0, "angle": 100.0, "low": 0.3},
        {"kind": "mask", "image": "grey", "pixel": 1.7, "outside": "repeat", "low": 250.1},
        {"kind": "mask", "image": "grey", "pixel": 1.7, "outside": "low"},
    )
}


@frozen(kw_only=True)
class Everywhere:
    """A surface with one site density: what contracts use where any surface will do."""

    name: ClassVar[str] = "everywhere"
    sites: float = 180.0  # 1/µm²

    def density(self, x: Array, y: Array) -> Array:
        """Give the density (1/µm²)."""
        return np.full(np.broadcast_shapes(np.shape(x), np.shape(y)), self.sites)

    def densest(self) -> float:
        """Give the density (1/µm²)."""
        return self.sites

    def resolution(self) -> float:
        """Give infinity (µm): it does not vary."""
        return np.inf


def typical(made: Any, **given: Any) -> Any:
    """Make a part with its defaults, and with typical numbers for parameters that have none.

    Parameters that name a file are given one: a picture of grey dots.

    Parameters
    ----------
    made
        The part's attrs class.
    given
        Parameters that are to have other values.

    Returns
    -------
    The part. Numbers are chosen by a parameter's name, else by its unit, else 1.
    """
    chosen = {
        field.alias: _BY_NAME.get(field.alias, _BY_UNIT.get(field.metadata.get("unit", ""), 1.0))
        for field in attrs.fields(made)
        if field.init and field.default is attrs.NOTHING
    }
    files = {field.alias for field in attrs.fields(made) if "file" in field.metadata} & given.keys()
    return made(**(chosen | given | {name: str(_grey()) for name in files}))


def samples_of(made: Any) -> Sequence[Mapping[str, Any]]:
    """Give the sets of parameters that a part is tried with: its own class variable ``samples``, if it has one.

    A part whose parameters have defaults, or may be any number of their unit, needs none.
    """
    own: Sequence[Mapping[str, Any]] = getattr(made, "samples", _SAMPLES.get(made.name, ({},)))
    return own


@lru_cache(maxsize=1)
def _grey() -> Path:
    """Draw a picture of grey dots, once a process."""
    from matplotlib import image

    folder = mkdtemp(prefix="mpad-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    path = Path(folder) / "grey.png"
    image.imsave(path, np.random.Generator(np.random.Philox(1)).random((400, 300)), cmap="gray")
    return path
