"""Bond species with chosen models, and problems made by hand."""

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.values import Setting
from mpad_core.physics.problem import BondSpecies, CaughtWhen, Problem, Tolerances
from mpad_core.plugins.registry import load

KT = 4.11e-3  # pN µm


@frozen(kw_only=True)
class CatchSlip:
    """Two pathways (Pereverzev 2005): slower breaking under some force than under none."""

    name: ClassVar[str] = "catch"
    stiffness: float = 1e4
    rest_length: float = 0.05

    def tension(self, length: Array) -> Array:
        return self.stiffness * (length - self.rest_length)

    def off_rate(self, length: Array) -> Array:
        force = np.abs(self.tension(length))
        return 20 * np.exp(-force * 1e-3 / KT) + 0.25 * np.exp(force * 5e-4 / KT)

    def breakpoints(self) -> tuple[float, ...]:
        return (self.rest_length,)


@frozen(kw_only=True)
class Stiffening:
    """A spring with a second, stiffer branch: the energy has to be integrated in pieces."""

    name: ClassVar[str] = "stiffening"
    rest_length: float = 0.04
    knee: float = 0.045

    def tension(self, length: Array) -> Array:
        return 1e3 * (length - self.rest_length) + 2e4 * np.maximum(length - self.knee, 0.0)

    def off_rate(self, length: Array) -> Array:
        return np.full(np.shape(length), 3.0)

    def breakpoints(self) -> tuple[float, ...]:
        return (self.rest_length, self.knee)


@frozen(kw_only=True)
class OwnRate(CatchSlip):
    """Brings its own on-rate: the core derives none."""

    def on_rate(self, length: Array) -> Array:
        return 7.0 / (1 + (length / 0.05) ** 8)


@frozen(kw_only=True)
class Eternal(Stiffening):
    """Never breaks."""

    def off_rate(self, length: Array) -> Array:
        return np.zeros_like(length)


def _bell(**words: Any) -> Any:
    given = {"off_rate": 2.0, "reactive_compliance": 4e-5, "stiffness": 1e5, "rest_length": 0.03, "kT": KT} | words
    return load("bond", "bell")(**given)


MODELS: dict[str, Callable[[], Any]] = {
    "bell": _bell,
    "soft bell": lambda: _bell(stiffness=100.0),
    "ideal": lambda: _bell(reactive_compliance=0.0, stiffness=1e3),
    "catch-slip": CatchSlip,
    "stiffening": Stiffening,
    "own rate": OwnRate,
    "eternal": Eternal,
}


@pytest.fixture(scope="session")
def species() -> Callable[..., BondSpecies]:
    """Give a maker of bond species by the model's name."""

    def make(model: str = "bell", **words: Any) -> BondSpecies:
        made = MODELS[model]()
        surface = load("surface", "uniform")(density=words.pop("density", 180.0))
        given: dict[str, Any] = {
            "name": "tether", "site_kind": 0, "model": made, "surface": surface, "rest_length": made.rest_length,
            "on_rate": 84.0, "at_density": 180.0, "reach": "overlap", "compression": "slack", "kT": KT,
        }  # fmt: skip
        return BondSpecies(**(given | words))

    return make


@pytest.fixture(scope="session")
def problem() -> Callable[..., Problem]:
    """Give a maker of problems: cells at centres, of radius 5 µm and roughness 175 nm unless told otherwise."""

    def make(centres: Any, *, solver: str = "rpb", setting: Setting | None = None, **words: Any) -> Problem:
        start = np.array(centres, float).reshape(-1, 3)
        n = len(start)
        kinds = max([s.site_kind for s in words.get("species", ())], default=0) + 1
        given: dict[str, Any] = {
            "names": tuple(f"c{i}" for i in range(n)), "kinds": ("bead",) * n, "radii": np.full(n, 5.0),
            "roughness": np.full(n, 0.175), "held": np.zeros(n, bool), "site_densities": np.full((n, kinds), 90.0),
            "hazard_densities": np.full((n, kinds), 90.0), "start": start, "alone_for": np.zeros(n),
            "zero_overlap": np.full(n, 5.255), "partner": np.full(n, -1), "dx_from": np.zeros(n),
            "external": np.zeros((n, 6)), "setting": setting or Setting(viscosity=1e-3, shear_rate=80.0),
            "solver": load("solver", solver)(), "coupled": solver != "isolated", "wall_roughness": 0.05,
            "species": (), "contact": None, "tolerances": Tolerances(position=1e-4, rate=1e-3),
            "caught": CaughtWhen(bound_for=0.1, slower_than=0.1), "seed": 1,
        }  # fmt: skip
        return Problem(**(given | words))

    return make
