"""A claim: what is said, who says it, what was expected, what was found, and the verdict."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from attrs import frozen


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


_STATED: ContextVar[list[Claim] | None] = ContextVar("stated", default=None)


@contextmanager
def collected() -> Iterator[list[Claim]]:
    """Collect the claims that are stated inside, those that fail among them; what `mpad validate` lists."""
    stated: list[Claim] = []
    token = _STATED.set(stated)
    try:
        yield stated
    finally:
        _STATED.reset(token)


def check(claim: str, source: str, expected: float, found: float) -> None:
    """State a claim and check it at once; see `Claim`."""
    stated = Claim(claim=claim, source=source, expected=float(expected), found=float(found))
    listening = _STATED.get()
    if listening is not None:
        listening.append(stated)
    stated.check()
