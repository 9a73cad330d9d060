"""The ideal bond: a linear spring that breaks at one rate, whatever pulls at it."""

from typing import ClassVar

import numpy as np
from attrs import frozen

from mpad_core import Array, BondModel, hookimpl, quantity


@frozen(kw_only=True)
class Ideal:
    """k_off = k⁰ on a linear spring F = σ (x − λ): Bell's bond with no reactive compliance, Dembo's with σ_ts = σ.

    Called ideal by Dembo et al. (Proc R Soc Lond B 234:55, 1988), between slip bonds and catch bonds.

    Attributes
    ----------
    unstressed_off_rate
        k⁰ in 1/s (in scenes: ``off_rate``).
    stiffness, rest_length
        σ in pN/µm, λ in µm: filled from the scene's bond.
    """

    name: ClassVar[str] = "ideal"
    unstressed_off_rate: float = quantity("1/s", alias="off_rate", doc="off-rate, at any tension")
    stiffness: float = quantity("pN/um", doc="spring constant")
    rest_length: float = quantity("um", doc="unstressed length")

    @unstressed_off_rate.validator
    def _not_negative(self, attribute: object, value: float) -> None:
        if not value >= 0:
            raise ValueError(f"must not be negative, but is {value:g}")

    def tension(self, length: Array) -> Array:
        """Give σ (x − λ)."""
        return self.stiffness * (length - self.rest_length)

    def off_rate(self, length: Array) -> Array:
        """Give k⁰."""
        return np.full(np.shape(length), self.unstressed_off_rate)

    def breakpoints(self) -> tuple[float, ...]:
        """Give the unstressed length."""
        return (self.rest_length,)


@hookimpl
def mpad_bond_models() -> list[type[BondModel]]:
    """Give the bond model of this module."""
    return [Ideal]
