"""A claim: what is said, who says it, what was expected, what was found, and the verdict."""

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


def check(claim: str, source: str, expected: float, found: float) -> None:
    """State a claim and check it at once; see `Claim`."""
    Claim(claim=claim, source=source, expected=expected, found=found).check()
