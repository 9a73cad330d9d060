"""The page of the validation is about the laws that there are, and says of the built-in parts that they hold."""

import inspect
import tomllib
from pathlib import Path

import pytest

from mpad_core.plugins.registry import installed
from mpad_core.testing import BondModelContract, FluctuatingContract, GapForceContract, MobilitySolverContract
from mpad_core.testing.between import BesideContract, LevelContract
from mpad_core.testing.claims import Claim, Stated
from mpad_core.testing.page import page
from mpad_core.testing.report import Validation
from mpad_core.testing.rows import FAILS, Told
from mpad_core.testing.suite.cases import KINDS, Chosen, cases
from mpad_core.testing.surfaces import SurfaceContract

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "validation.md"
CONTRACTS = {
    "Solvers": (MobilitySolverContract, FluctuatingContract, BesideContract, LevelContract),
    "Bond models": (BondModelContract,),
    "Surfaces": (SurfaceContract,),
    "Force laws": (GapForceContract,),
}


def laws(*contracts: type) -> set[tuple[str, str]]:
    """Give name and meaning of every law of contracts, as the page has them."""
    found = set()
    for contract in contracts:
        for name, function in inspect.getmembers(contract, inspect.isfunction):
            if name.startswith("test_"):
                meaning = (inspect.getdoc(function) or "").partition("\n")[0]
                found.add((name.removeprefix("test_").replace("_", " "), meaning))
    return found


def sections() -> dict[str, str]:
    text = PAGE.read_text(encoding="utf-8")
    return {part.partition("\n")[0]: part for part in text.split("\n## ")[1:]}


@pytest.mark.parametrize("heading", CONTRACTS)
def test_the_page_has_the_laws_that_there_are(heading: str) -> None:
    rows = [line.strip("| ").split(" | ") for line in sections()[heading].splitlines() if line.startswith("| ")]
    listed = {(row[0], row[1]) for row in rows[: rows.index(next(r for r in rows if r[0] == "claim"))]}
    listed -= {("law", "what it asks"), ("---", "---")}
    assert listed - {("loads", "It can be loaded, and made with its samples or levels.")} == laws(*CONTRACTS[heading])


def test_the_page_has_the_parts_that_are_shipped_and_no_failure() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert "**fails**" not in text
    own = {tomllib.loads(file.read_text())["project"]["name"] for file in ROOT.glob("plugins/*/pyproject.toml")}
    shipped = {part.name for part in installed() if part.distribution in own}
    for kind in KINDS:
        for case in cases(kind, Chosen()):
            if case.name in shipped:
                assert f"| {case.label} |" in text, case


def test_a_page_says_what_fails() -> None:
    stated = Stated(claims=[Claim(claim="symmetric", source="Lorentz", expected=1e-8, found=0.5)])
    told = Told(kind="solver", part="mine", law="symmetric", meaning="It is.").with_claims(stated)
    broken = Told(kind="bond", part="odd", law="pure", meaning="It is.").failed(None, "ValueError: no", "")
    found = Validation.of([broken, told])
    assert [row.verdict for _, row in found.failing] == [FAILS, FAILS]
    assert "| symmetric | **fails**: 0.5 ≤ 1e-08 |" in page(found)
    assert "**fails**: ValueError: no" in page(found)
