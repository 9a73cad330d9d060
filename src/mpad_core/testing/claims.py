"""A claim: what is said, who says it, what was expected, what was found, and the verdict."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from attrs import define, field, frozen


@frozen(kw_only=True)
class Claim:
    """A statement about a part that a number decides.

    Attributes
    ----------
    claim
        What should hold, in words.
    source
        The law or the paper that it comes from.
    expected
        The largest deviation at which it still holds.
    found
        The deviation that was measured.
    """

    claim: str
    source: str
    expected: float
    found: float

    @property
    def verdict(self) -> str:
        """Say whether the claim holds; a deviation that is no number does not."""
        return "holds" if self.found <= self.expected else "fails"

    def __str__(self) -> str:
        """Give the claim as one line of a table."""
        numbers = f"expected at most {self.expected:.3g}, found {self.found:.3g}"
        return f"{self.claim} ({self.source}): {numbers}: {self.verdict}"

    def check(self) -> None:
        """Raise if the claim fails.

        Raises
        ------
        AssertionError
            With the claim as one line.
        """
        if self.verdict == "fails":
            raise AssertionError(str(self))


@define
class Stated:
    """What a law has stated.

    Attributes
    ----------
    claims
        In the order in which they were stated, one that fails last.
    withheld
        Why a claim was not stated of some examples.
    """

    claims: list[Claim] = field(factory=list)
    withheld: list[str] = field(factory=list)


_STATED: ContextVar[Stated | None] = ContextVar("stated", default=None)


@contextmanager
def collected() -> Iterator[Stated]:
    """Collect what is stated inside; what `mpad validate` lists."""
    stated = Stated()
    token = _STATED.set(stated)
    try:
        yield stated
    finally:
        _STATED.reset(token)


def withhold(reason: str) -> None:
    """Say why a claim is not stated of an example; a law that states none at all was not asked."""
    listening = _STATED.get()
    if listening is not None:
        listening.withheld.append(reason)


def check(claim: str, source: str, expected: float, found: float) -> None:
    """State a claim and check it at once; see `Claim`."""
    stated = Claim(claim=claim, source=source, expected=float(expected), found=float(found))
    listening = _STATED.get()
    if listening is not None:
        listening.claims.append(stated)
    stated.check()
