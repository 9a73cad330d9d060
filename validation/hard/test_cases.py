"""Every hard case holds with every solver, or is refused in one clear line; `docs/hard-cases.md` is the table."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from hard.cases import FAILS, Case, solvers
from hard.page import FAMILIES, columns_of

PAGE = Path(__file__).parents[2] / "docs/hard-cases.md"
VERY_DEAR = {"10 000 000 sub-steps of one cell", "1000 overlapping above the wall", "shear 10 000 1/s"}


def asked() -> Iterator[Any]:
    """Give every case with every solver; those that take seconds are slow, those that take more are long."""
    for family, cases in FAMILIES.items():
        for case in cases:
            for column in columns_of(family):
                marks = []
                if column == "elements 96" or (case.name in VERY_DEAR and column in case.dear):
                    marks = [pytest.mark.long, pytest.mark.timeout(1200)]
                elif column in case.dear:
                    marks = [pytest.mark.slow]
                yield pytest.param(case, column, marks=marks, id=f"{case.name} | {column}")


@pytest.mark.parametrize(("case", "column"), list(asked()))
def test_it_holds_or_is_refused_clearly(case: Case, column: str) -> None:
    outcome = case.of(solvers()[column])
    assert outcome.verdict != FAILS, outcome.why


def test_the_page_has_every_case_and_no_empty_cell() -> None:
    rows = [line.strip("| ").split(" | ") for line in PAGE.read_text("utf-8").splitlines() if line.startswith("| ")]
    verdicts = {row[0]: row[1:] for row in reversed(rows)}
    for family, case in ((family, case) for family, cases in FAMILIES.items() for case in cases):
        assert len(verdicts[case.name]) == len(columns_of(family)), case.name
        assert all(cell == "holds" or cell.startswith("refused: ") for cell in verdicts[case.name]), case.name
