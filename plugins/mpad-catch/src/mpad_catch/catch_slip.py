"""The catch-slip bond: a pathway that force closes, one that it opens (Pereverzev et al., Biophys J 89:1446, 2005)."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from attrs import field, frozen

from mpad_core import Array, BondModel, Preset, hookimpl, quantity

_PRESETS = {
    "p-selectin": Preset(
        parameters={
            "catch_rate": 120.0, "catch_compliance": 2.17e-3, "slip_rate": 0.25, "slip_compliance": 0.51e-3,
        },
        source="Pereverzev et al., Biophys J 89:1446, 2005: P-selectin and soluble PSGL-1",
        provenance="recalled",
    ),
}  # fmt: skip


@frozen(kw_only=True)
class CatchSlip:
    """k_off = k_c exp(−x_c |F| / kT) + k_s exp(x_s |F| / kT) on F = σ (x − λ), after Pereverzev et al. (2005).

    Its life is longest at F* = kT / (x_c + x_s) · ln[k_c x_c / (k_s x_s)], if the logarithm is positive. The law was
    found on bonds that are pulled; one that is pushed is taken to feel the same force, as in Bell's law here.

    Attributes
    ----------
    catch_rate, catch_compliance
        k_c in 1/s, x_c in µm: the pathway that force closes.
    slip_rate, slip_compliance
        k_s in 1/s, x_s in µm: the pathway that force opens.
    stiffness, rest_length, kT
        σ in pN/µm, λ in µm, kT in pN µm: filled from the scene's bond and fluid.
    """

    name: ClassVar[str] = "catch-slip"
    presets: ClassVar[Mapping[str, Preset]] = _PRESETS
    catch_rate: float = quantity("1/s", doc="off-rate of the unstressed bond along the pathway that force closes")
    catch_compliance: float = quantity("um", doc="how strongly force closes it")
    slip_rate: float = quantity("1/s", doc="off-rate of the unstressed bond along the pathway that force opens")
    slip_compliance: float = quantity("um", doc="how strongly force opens it")
    stiffness: float = quantity("pN/um", doc="spring constant")
    rest_length: float = quantity("um", doc="unstressed length")
    kT: float = field(metadata={"unit": "pN um", "doc": "thermal energy"})  # noqa: N815

    @catch_rate.validator
    @catch_compliance.validator
    @slip_rate.validator
    @slip_compliance.validator
    def _not_negative(self, attribute: object, value: float) -> None:
        if not value >= 0:
            raise ValueError(f"must not be negative, but is {value:g}")

    def tension(self, length: Array) -> Array:
        """Give σ (x − λ)."""
        return self.stiffness * (length - self.rest_length)

    def off_rate(self, length: Array) -> Array:
        """Give k_c exp(−x_c |F| / kT) + k_s exp(x_s |F| / kT)."""
        force = np.abs(self.tension(length)) / self.kT
        closing = self.catch_rate * np.exp(-self.catch_compliance * force)
        opening = np.exp(np.minimum(self.slip_compliance * force, 700.0))  # a slip rate of zero stays one, times this
        rate: Array = closing + self.slip_rate * opening
        return rate

    def breakpoints(self) -> tuple[float, ...]:
        """Give the unstressed length, where |F| has its kink."""
        return (self.rest_length,)


@hookimpl
def mpad_bond_models() -> list[type[BondModel]]:
    """Give the bond model of this module."""
    return [CatchSlip]
