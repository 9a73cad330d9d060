"""Dembo's spring: a bond and its transition state each have a stiffness, and the rate follows their energies."""

from typing import ClassVar

import numpy as np
from attrs import frozen

from mpad_core import Array, BondModel, hookimpl, quantity


@frozen(kw_only=True)
class DemboSpring:
    """k_off = k⁰ exp[(σ − σ_ts)(x − λ)² / 2kT]: slips for σ_ts < σ, catches for σ_ts > σ (Dembo et al., 1988)."""

    name: ClassVar[str] = "dembo-spring"
    unstressed_rate: float = quantity("1/s", doc="off-rate of the unstressed bond")
    transition_stiffness: float = quantity("pN/um", doc="spring constant of the transition state")
    stiffness: float = quantity("pN/um", doc="spring constant")
    rest_length: float = quantity("um", doc="unstressed length")
    kT: float = quantity("pN um", doc="thermal energy")  # noqa: N815

    def tension(self, length: Array) -> Array:
        """Give σ (x − λ), in pN."""
        return self.stiffness * (length - self.rest_length)

    def off_rate(self, length: Array) -> Array:
        """Give the rate of breaking, in 1/s."""
        energy = (self.stiffness - self.transition_stiffness) * (length - self.rest_length) ** 2 / 2
        return np.asarray(self.unstressed_rate * np.exp(energy / self.kT))

    def breakpoints(self) -> tuple[float, ...]:
        """Give the lengths at which the law has a kink: the unstressed one."""
        return (self.rest_length,)


@hookimpl
def mpad_bond_models() -> list[type[BondModel]]:
    """Give the bond models of this package."""
    return [DemboSpring]
