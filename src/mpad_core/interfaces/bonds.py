"""What a bond model must be."""

from typing import ClassVar, Protocol, runtime_checkable

from mpad_core.interfaces.values import Array


@runtime_checkable
class BondModel(Protocol):
    """How hard a bond pulls and how fast it breaks, at a given length.

    Elementwise numpy functions of the length, without randomness: the core tabulates them once and draws the events.
    A model is a frozen attrs class; its fields are its parameters in the scene. Fields named ``rest_length``,
    ``stiffness`` and ``kT`` are filled from the scene's bond and fluid where the scene's model does not give them.

    A model may also give ``on_rate(length)`` in 1/s. Without it the core derives the on-rate from the off-rate and
    the elastic energy, so that detailed balance holds.
    """

    name: ClassVar[str]

    def tension(self, length: Array) -> Array:
        """Give the tension (pN) at lengths (µm); positive pulls the ends together."""
        ...

    def off_rate(self, length: Array) -> Array:
        """Give the rate of breaking (1/s) at lengths (µm)."""
        ...

    def breakpoints(self) -> tuple[float, ...]:
        """Give the lengths (µm) where tension or rates have a kink; the rest length is the first of them."""
        ...


@runtime_checkable
class Interconverting(Protocol):
    """A bond model with inner states, each with its own off-rate; state 0 is the one that the others are weighed by.

    Its ``off_rate(length)`` gives (states, ...), and so does its ``on_rate(length)`` if it has one. The tension is that
    of any state.
    """

    def states(self) -> int:
        """Give the number of inner states."""
        ...

    def exchange(self, length: Array) -> Array:
        """Give the exchange rates (1/s) as (states, states, ...): row = from, column = to, the diagonal zero."""
        ...


@runtime_checkable
class Encounter(Protocol):
    """An on-rate that depends on how fast the two surfaces slip past each other."""

    def factor(self, slip_speed: Array) -> Array:
        """Give the factor on the on-rate at slip speeds (µm/s)."""
        ...
