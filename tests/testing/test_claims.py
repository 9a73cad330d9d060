"""A claim says what was expected and found, and its verdict."""

import pytest

from mpad_core.testing.claims import Claim, check


@pytest.mark.parametrize(
    ("found", "verdict"), [(0.0, "holds"), (1e-6, "holds"), (2e-6, "fails"), (float("nan"), "fails")]
)
def test_verdict(found: float, verdict: str) -> None:
    assert Claim(claim="x", source="y", expected=1e-6, found=found).verdict == verdict


def test_a_failed_claim_says_all() -> None:
    with pytest.raises(AssertionError, match=r"symmetric \(Lorentz\): expected at most 1e-06, found 0.5: fails"):
        check("symmetric", "Lorentz", 1e-6, 0.5)
    check("symmetric", "Lorentz", 1e-6, 0.0)
