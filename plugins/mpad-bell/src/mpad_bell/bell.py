"""Bell's bond: a linear spring whose off-rate grows exponentially with its tension (Bell, Science 200:618, 1978)."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from attrs import field, frozen

from mpad_bell.presets import PRESETS
from mpad_core import Array, BondModel, Preset, hookimpl, quantity


@frozen(kw_only=True)
class Bell:
    """k_off = k⁰ exp(r₀ |F| / kT) on a linear spring F = σ (x − λ): eq. 1 of King & Hammer (PNAS 2001).

    Attributes
    ----------
    unstressed_off_rate
        k⁰ in 1/s (in scenes: ``off_rate``).
    reactive_compliance
        r₀ in µm; zero for an ideal bond, which does not feel force.
    stiffness, rest_length, kT
        σ in pN/µm, λ in µm, kT in pN µm: filled from the scene's bond and fluid.
    """

    name: ClassVar[str] = "bell"
    presets: ClassVar[Mapping[str, Preset]] = PRESETS
    unstressed_off_rate: float = quantity("1/s", alias="off_rate", doc="off-rate of the unstressed bond")
    reactive_compliance: float = quantity("um", default=0.0, doc="how strongly force speeds breaking")
    stiffness: float = quantity("pN/um", doc="spring constant")
    rest_length: float = quantity("um", doc="unstressed length")
    kT: float = field(metadata={"unit": "pN um", "doc": "thermal energy"})  # noqa: N815

    @unstressed_off_rate.validator
    @reactive_compliance.validator
    def _not_negative(self, attribute: object, value: float) -> None:
        if not value >= 0:
            raise ValueError(f"must not be negative, but is {value:g}")

    def tension(self, length: Array) -> Array:
        """Give σ (x − λ)."""
        return self.stiffness * (length - self.rest_length)

    def off_rate(self, length: Array) -> Array:
        """Give k⁰ exp(r₀ |F| / kT)."""
        rate: Array = self.unstressed_off_rate * np.exp(
            self.reactive_compliance * np.abs(self.tension(length)) / self.kT
        )
        return rate

    def breakpoints(self) -> tuple[float, ...]:
        """Give the unstressed length, where |F| has its kink."""
        return (self.rest_length,)


@hookimpl
def mpad_bond_models() -> list[type[BondModel]]:
    """Give the bond model of this module."""
    return [Bell]
