"""What a force law must be: a function of the gap between two roughness layers."""

from typing import ClassVar, Protocol, runtime_checkable

from mpad_core.interfaces.values import Array


@runtime_checkable
class GapForce(Protocol):
    """A force along the normal between two surfaces, as a function of the gap between their roughness tips.

    The core tabulates the law with its derivative between the smallest and the largest gap that `gaps` gives,
    continues it by its tangent below, and takes it as zero above.
    """

    name: ClassVar[str]

    def force(self, gap: Array) -> Array:
        """Give the force (pN) at gaps (µm); positive pushes the surfaces apart."""
        ...

    def gaps(self) -> tuple[float, float]:
        """Give the gap (µm) below which the law is continued by its tangent, and the one above which it is zero."""
        ...
