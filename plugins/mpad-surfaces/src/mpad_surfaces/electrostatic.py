"""Electrostatic repulsion between the bumps of two rough surfaces."""

from typing import ClassVar

import numpy as np
from attrs import frozen

from mpad_core import Array, GapForce, hookimpl, quantity

_NEGLIGIBLE = 1e-9  # pN: beyond the gap of this force there is none


@frozen(kw_only=True)
class Electrostatic:
    """F = F₀ τ exp(−τ e) / (1 − exp(−τ e)) over the tip gap e (Takamura, Goldsmith & Mason 1981).

    Adhesive dynamics uses it between roughness layers (Bell, Dembo & Bongrand 1984; King & Hammer 2001). It turns
    attractive for e < 0; below `continued_below` it is continued by its tangent, so it keeps pushing.

    Attributes
    ----------
    strength
        F₀ in pN µm.
    decay
        τ in 1/µm, the reciprocal Debye length of the effective layer.
    continued_below
        µm.
    """

    name: ClassVar[str] = "electrostatic"
    strength: float = quantity("pN um", doc="strength F0 of the law")
    decay: float = quantity("1/um", doc="reciprocal range of the law")
    continued_below: float = quantity("um", default=1e-3, doc="tip gap below which the law is continued by its tangent")

    @strength.validator
    @decay.validator
    @continued_below.validator
    def _positive(self, attribute: object, value: float) -> None:
        if not value > 0:
            raise ValueError(f"must be positive, but is {value:g}")

    def force(self, gap: Array) -> Array:
        """Give the repulsion (pN) at tip gaps (µm)."""
        force: Array = self.strength * self.decay / np.expm1(self.decay * gap)
        return force

    def gaps(self) -> tuple[float, float]:
        """Give where the tangent takes over, and where the force has become negligible (µm)."""
        farthest = float(np.log1p(self.strength * self.decay / _NEGLIGIBLE)) / self.decay
        return self.continued_below, max(farthest, 2 * self.continued_below)


@hookimpl
def mpad_force_laws() -> list[type[GapForce]]:
    """Give the force law of this module."""
    return [Electrostatic]
