"""Rows of the validation table: what a law has told of a part, and the verdict."""

from collections.abc import Iterable
from math import inf, isnan
from typing import Any

from attrs import evolve, field, frozen

from mpad_core.testing.claims import Claim, Stated

HOLDS, FAILS, LEFT_OUT = "holds", "FAILS", "not asked"


@frozen(kw_only=True)
class Row:
    """One claim about one part, over all examples.

    Attributes
    ----------
    claim, source
        As `Claim` has them; a law that states no number has its own first line for a claim.
    expected, found
        Of the worst example: the largest deviation at which the claim holds, and the deviation. None: no number.
    examples
        How often the claim was stated.
    verdict
        `HOLDS`, `FAILS` or `LEFT_OUT`.
    reason
        Why it fails, if no number says it, or why it was not asked.
    """

    claim: str
    source: str
    expected: float | None = None
    found: float | None = None
    examples: int = 0
    verdict: str = HOLDS
    reason: str = ""


@frozen(kw_only=True)
class Told:
    """What one law has told of one part."""

    kind: str
    part: str
    law: str
    meaning: str
    rows: tuple[Row, ...] = field(default=())
    scene: str = ""  # text of a scene that reproduces a failure

    def with_claims(self, stated: Stated) -> "Told":
        """Take up the claims that a law has stated, the worst of each; it was not asked if it has withheld all."""
        grouped: dict[tuple[str, str], list[Claim]] = {}
        if stated.withheld and not stated.claims:
            return evolve(self, rows=(self._whole(verdict=LEFT_OUT, reason=stated.withheld[0]),))
        for claim in stated.claims:
            grouped.setdefault((claim.claim, claim.source), []).append(claim)
        return evolve(self, rows=tuple(_worst(claims) for claims in grouped.values()) or (self._whole(),))

    def _whole(self, **said: Any) -> Row:
        """Give the row of a law that states no number."""
        return Row(claim=self.meaning.rstrip("."), source="interface", examples=1, **said)

    def left_out(self, reason: str) -> "Told":
        """Say that a law was not asked; what it had stated before stays."""
        stated = tuple(row for row in self.rows if row.expected is not None)
        return evolve(self, rows=stated or (self._whole(verdict=LEFT_OUT, reason=reason),))

    def failed(self, broken: Claim | None, reason: str, scene: str) -> "Told":
        """Say that a law has failed: by a claim, which its row says, or otherwise."""
        rows = tuple(row for row in self.rows if row.expected is not None)
        if broken is None:
            rows = (*rows, self._whole(verdict=FAILS, reason=reason))
        return evolve(self, rows=rows, scene=scene)


def _worst(claims: list[Claim]) -> Row:
    worst = max(claims, key=_excess)
    return Row(
        claim=worst.claim, source=worst.source, expected=worst.expected, found=worst.found, examples=len(claims),
        verdict=HOLDS if all(claim.verdict == "holds" for claim in claims) else FAILS,
    )  # fmt: skip


def _excess(claim: Claim) -> float:
    """Give how far a claim is from failing; what is no number is worst."""
    if isnan(claim.found):
        return inf
    if claim.expected > 0:
        return claim.found / claim.expected
    return inf if claim.found > claim.expected else claim.found


def told_of(plain: dict[str, Any]) -> Told:
    """Make what travelled with a report whole again."""
    return Told(**{**plain, "rows": tuple(Row(**row) for row in plain["rows"])})


def merged(tolds: Iterable[Told]) -> list[Told]:
    """Put together what one law has told of one part under several headings, such as with a wall and without."""
    found: dict[tuple[str, str, str], Told] = {}
    for told in tolds:
        key = (told.kind, told.part, told.law)
        found[key] = told if key not in found else _both(found[key], told)
    return list(found.values())


def _both(one: Told, two: Told) -> Told:
    rows = {(row.claim, row.source): row for row in one.rows if row.verdict != LEFT_OUT}
    for row in two.rows:
        key = (row.claim, row.source)
        if row.verdict != LEFT_OUT:
            rows[key] = _sum(rows[key], row) if key in rows else row
    aside = {row.reason: row for row in (*one.rows, *two.rows) if row.verdict == LEFT_OUT}
    kept = (*rows.values(), *aside.values())
    return evolve(one, rows=kept, scene=one.scene or two.scene)


def _sum(one: Row, two: Row) -> Row:
    """Keep the worse of two rows, with the examples of both."""
    first, second = sorted((one, two), key=lambda row: (row.verdict == FAILS, _ratio(row)))
    return evolve(second, examples=first.examples + second.examples)


def _ratio(row: Row) -> float:
    if row.expected is None or row.found is None:
        return inf if row.verdict == FAILS else -inf
    return _excess(Claim(claim="", source="", expected=row.expected, found=row.found))
