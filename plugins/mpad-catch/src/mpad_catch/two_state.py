"""The two-state catch bond: a weak inner state, a strong one that force favours, and the exchange between them."""

from typing import ClassVar

import numpy as np
from attrs import field, frozen

from mpad_core import Array, BondModel, hookimpl, quantity


@frozen(kw_only=True)
class TwoState:
    """Inner states 0, which breaks at k₁, and 1, which breaks at k₂ exp(x_b |F| / kT), after Evans et al. (2004).

    At equilibrium the states are as p₁ / p₀ = r = exp(|F| / f₁₂ − ΔE / kT). If they exchange much faster than they
    break, the bond has one rate,

        k_off = [φ k₁ + exp(|F| / f₁₂) k₂ exp(x_b |F| / kT)] / [φ + exp(|F| / f₁₂)],  φ = exp(ΔE / kT),

    which Evans et al. (PNAS 101:11281) compared with experiments. Here exchange has a rate of its own, so what a bond
    does depends on how it has been loaded before, as seen on P-selectin (Marshall et al., Biophys J 88:1458, 2005). The
    limit says nothing on how exchange splits into there and back: it is taken to relax at one rate ν = X₀₁ + X₁₀ at any
    force, hence X₀₁ = ν r / (1 + r), X₁₀ = ν / (1 + r). A bond that is pushed is taken to feel the same force as one
    that is pulled.

    Attributes
    ----------
    weak_rate
        k₁ in 1/s.
    strong_rate, reactive_compliance
        k₂ in 1/s, x_b in µm.
    energy_difference
        ΔE in pN µm: how far the strong state of the unstressed bond lies above the weak one.
    exchange_force
        f₁₂ in pN: the force that shifts the balance by a factor e.
    exchange_rate
        ν in 1/s.
    stiffness, rest_length, kT
        σ in pN/µm, λ in µm, kT in pN µm: filled from the scene's bond and fluid.
    """

    name: ClassVar[str] = "two-state"
    weak_rate: float = quantity("1/s", doc="off-rate of the weak state, at any tension")
    strong_rate: float = quantity("1/s", doc="off-rate of the strong state, unstressed")
    reactive_compliance: float = quantity("um", doc="how strongly force speeds breaking from the strong state")
    energy_difference: float = quantity("pN um", doc="energy of the strong state above the weak one, unstressed")
    exchange_force: float = quantity("pN", doc="force that shifts the balance of the states by a factor e")
    exchange_rate: float = quantity("1/s", doc="rate at which the states come to their balance")
    stiffness: float = quantity("pN/um", doc="spring constant")
    rest_length: float = quantity("um", doc="unstressed length")
    kT: float = field(metadata={"unit": "pN um", "doc": "thermal energy"})  # noqa: N815

    @weak_rate.validator
    @strong_rate.validator
    @reactive_compliance.validator
    def _not_negative(self, attribute: object, value: float) -> None:
        if not value >= 0:
            raise ValueError(f"must not be negative, but is {value:g}")

    @exchange_force.validator
    @exchange_rate.validator
    def _positive(self, attribute: object, value: float) -> None:
        if not value > 0:
            raise ValueError(f"must be above zero, but is {value:g}")

    def states(self) -> int:
        """Give two: 0 weak, 1 strong."""
        return 2

    def tension(self, length: Array) -> Array:
        """Give σ (x − λ), in either state."""
        return self.stiffness * (length - self.rest_length)

    def off_rate(self, length: Array) -> Array:
        """Give k₁ and k₂ exp(x_b |F| / kT), (2, ...)."""
        strong = self.strong_rate * np.exp(self.reactive_compliance * np.abs(self.tension(length)) / self.kT)
        return np.stack([np.full(np.shape(length), self.weak_rate), strong])

    def exchange(self, length: Array) -> Array:
        """Give X₀₁ = ν r / (1 + r) and X₁₀ = ν / (1 + r) off a diagonal of zeros, (2, 2, ...)."""
        log_ratio = np.abs(self.tension(length)) / self.exchange_force - self.energy_difference / self.kT
        rates = np.zeros((2, 2, *np.shape(length)))
        rates[0, 1] = self.exchange_rate * np.exp(-np.logaddexp(0.0, -log_ratio))
        rates[1, 0] = self.exchange_rate * np.exp(-np.logaddexp(0.0, log_ratio))
        return rates

    def breakpoints(self) -> tuple[float, ...]:
        """Give the unstressed length, where |F| has its kink."""
        return (self.rest_length,)


@hookimpl
def mpad_bond_models() -> list[type[BondModel]]:
    """Give the bond model of this module."""
    return [TwoState]
