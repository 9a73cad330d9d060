"""What a surface must be: where the wall's binding sites are."""

from typing import ClassVar, Protocol, runtime_checkable

from mpad_core.interfaces.values import Array


@runtime_checkable
class Surface(Protocol):
    """The density of one kind of binding site on the wall, as a function of place."""

    name: ClassVar[str]

    def density(self, x: Array, y: Array) -> Array:
        """Give the site density (1/µm²) at places (µm), elementwise."""
        ...

    def densest(self) -> float:
        """Give an upper bound of the density (1/µm²) over the whole wall."""
        ...


@runtime_checkable
class Resolving(Protocol):
    """A surface that says how finely its density has to be sampled."""

    def resolution(self) -> float:
        """Give the length (µm) below which the density does not vary but at sharp edges; infinite if it is uniform.

        The core samples it on squares of this side: an edge is off by half their diagonal at most.
        """
        ...
