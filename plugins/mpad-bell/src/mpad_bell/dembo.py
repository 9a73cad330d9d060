"""Dembo's bond: the bond and its transition state are two springs, and the rate follows the energy between them."""

from typing import ClassVar

import numpy as np
from attrs import field, frozen

from mpad_core import Array, BondModel, hookimpl, quantity


@frozen(kw_only=True)
class Dembo:
    """k_off = k⁰ exp[(σ − σ_ts)(x − λ)² / 2kT] on F = σ (x − λ): Dembo et al. (Proc R Soc Lond B 234:55, 1988).

    A slip bond for σ_ts < σ, an ideal one for σ_ts = σ, a catch bond for σ_ts > σ. Hammer & Apte (Biophys J 63:35,
    1992) quote the fractional slippage (σ − σ_ts) / σ.

    Attributes
    ----------
    unstressed_off_rate
        k⁰ in 1/s (in scenes: ``off_rate``).
    transition_stiffness
        σ_ts in pN/µm.
    stiffness, rest_length, kT
        σ in pN/µm, λ in µm, kT in pN µm: filled from the scene's bond and fluid.
    """

    name: ClassVar[str] = "dembo"
    unstressed_off_rate: float = quantity("1/s", alias="off_rate", doc="off-rate of the unstressed bond")
    transition_stiffness: float = quantity("pN/um", doc="spring constant of the transition state")
    stiffness: float = quantity("pN/um", doc="spring constant")
    rest_length: float = quantity("um", doc="unstressed length")
    kT: float = field(metadata={"unit": "pN um", "doc": "thermal energy"})  # noqa: N815

    @unstressed_off_rate.validator
    @transition_stiffness.validator
    def _not_negative(self, attribute: object, value: float) -> None:
        if not value >= 0:
            raise ValueError(f"must not be negative, but is {value:g}")

    def tension(self, length: Array) -> Array:
        """Give σ (x − λ)."""
        return self.stiffness * (length - self.rest_length)

    def off_rate(self, length: Array) -> Array:
        """Give k⁰ exp[(σ − σ_ts)(x − λ)² / 2kT]."""
        slippage = (self.stiffness - self.transition_stiffness) * (length - self.rest_length) ** 2 / 2
        rate: Array = self.unstressed_off_rate * np.exp(slippage / self.kT)
        return rate

    def breakpoints(self) -> tuple[float, ...]:
        """Give the unstressed length."""
        return (self.rest_length,)


@hookimpl
def mpad_bond_models() -> list[type[BondModel]]:
    """Give the bond model of this module."""
    return [Dembo]
