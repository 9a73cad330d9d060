"""A wall whose site density varies from place to place: stripes, a checkerboard, a gradient, a picture."""

from importlib import import_module
from typing import Any, ClassVar, Literal, Protocol

import attrs
import numpy as np
from attrs import frozen

from mpad_core import Array, Surface, hookimpl, quantity

_HOMES = {"stripes": "Stripes", "checkerboard": "Checkerboard", "gradient": "Gradient", "mask": "Mask"}


class Law(Protocol):
    """Where the density is high: one class for each kind, in the module of that name."""

    def share(self, x: Array, y: Array) -> Array:
        """Give how far (0 to 1) from low to high the density is at places (µm), elementwise."""
        ...

    def resolution(self) -> float:
        """Give the length (µm) below which it does not vary but at edges."""
        ...


def _only(doc: str, kind: str, **metadata: Any) -> Any:
    """Declare a parameter that only some kinds take."""
    return attrs.field(default=None, metadata={"doc": f"{kind}: {doc}", **metadata})


def _length(doc: str, kind: str) -> Any:
    return _only(doc, kind, unit="um")


@frozen(kw_only=True)
class Pattern:
    """Site density between `low` and `high`, by one of four laws.

    Attributes
    ----------
    kind
        Which law; each takes some of the parameters below, and refuses the others.
    high, low
        1/µm²; where `share` is 1, and where it is 0.
    angle
        Degrees from the flow (x) towards y: the direction in which the density varies.
    """

    name: ClassVar[str] = "pattern"
    kind: Literal["stripes", "checkerboard", "gradient", "mask"] = attrs.field(metadata={"doc": "which pattern"})
    high: float = quantity("1/um^2", doc="binding sites per area where they are dense")
    low: float = quantity("1/um^2", default=0.0, doc="binding sites per area elsewhere")
    angle: float | None = _only("direction in which it varies, from the flow", "all but mask", unit="deg")
    period: float | None = _length("from one dense place to the next", "stripes, checkerboard")
    duty: float | None = _only("dense part of the period", "stripes")
    offset: float | None = _length("where a dense stripe begins", "stripes")
    start: float | None = _length("where the density begins to change", "gradient")
    end: float | None = _length("where it ends to change", "gradient")
    image: str | None = _only("a picture, white where sites are dense; beside the scene", "mask", file="sha256")
    sha256: str | None = _only("what the picture's bytes must be; filled in", "mask")
    pixel: float | None = _length("side of a pixel", "mask")
    origin: tuple[float, float] | None = _length("place of the picture's lower left corner", "mask")
    outside: Literal["low", "repeat"] | None = _only("what is outside the picture", "mask")
    law: Law = attrs.field(init=False, repr=False, eq=False)

    @high.validator
    @low.validator
    def _not_negative(self, attribute: object, value: float) -> None:
        if not value >= 0:
            raise ValueError(f"must not be negative, but is {value:g}")

    @law.default
    def _made(self) -> Law:
        """Make the law of the parameters given; those left out have the law's own defaults."""
        if self.kind not in _HOMES:
            raise ValueError(f"kind must be one of {', '.join(_HOMES)}, not {self.kind!r}")
        made: Any = getattr(import_module(f"{__name__}.{self.kind}"), _HOMES[self.kind])
        shared = {"kind", "high", "low", "law"}
        own = {field.name: getattr(self, field.name) for field in attrs.fields(Pattern) if field.name not in shared}
        given = {key: value for key, value in own.items() if value is not None}
        known = {field.name: field.default for field in attrs.fields(made) if field.init}
        for key in given.keys() - known.keys():
            raise ValueError(f"{key} is unknown to kind {self.kind!r} (its parameters: {', '.join(known)})")
        for key, default in known.items():
            if default is attrs.NOTHING and key not in given:
                raise ValueError(f"{key} is missing; kind {self.kind!r} needs it")
        law: Law = made(**given)
        return law

    def density(self, x: Array, y: Array) -> Array:
        """Give the density (1/µm²) at every place."""
        share = self.law.share(np.asarray(x, float), np.asarray(y, float))
        least, most = sorted((self.low, self.high))
        density: Array = np.clip((1 - share) * self.low + share * self.high, least, most)
        return density

    def densest(self) -> float:
        """Give the larger of the two densities (1/µm²)."""
        return max(self.low, self.high)

    def resolution(self) -> float:
        """Give the length (µm) below which the density does not vary, but at sharp edges."""
        return self.law.resolution()


@hookimpl
def mpad_surfaces() -> list[type[Surface]]:
    """Give the surface of this module."""
    return [Pattern]
