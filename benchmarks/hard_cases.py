"""Every hard case with every solver: what holds, what is refused, and the numbers. Writes ``docs/hard-cases.md``.

Run as ``python benchmarks/hard_cases.py [--docs PAGE] [--kept FILE] [--columns NAME,NAME]``: a quarter of an hour of
one processor. The cases are those of ``validation/hard``, which the tests ask too. With ``--kept`` outcomes are kept in
a JSON file, and only what is not in it is asked.
"""

import argparse
import json
import math
import sys
from pathlib import Path
from typing import Any

import attrs

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests/tools"), str(ROOT / "validation")]

from hard import page  # noqa: E402
from hard.cases import FAILS, Case, Outcome, solvers  # noqa: E402


def outcomes(families: dict[str, list[Case]], columns: list[str], kept: Path | None) -> dict[str, dict[str, Outcome]]:
    """Ask what has not been asked."""
    known: dict[str, Any] = json.loads(kept.read_text()) if kept and kept.exists() else {}
    chosen = solvers()
    for family, case in ((family, case) for family, cases in families.items() for case in cases):
        row = known.setdefault(case.name, {})
        for name in columns:
            if name not in row and name in page.columns_of(family):
                row[name] = attrs.asdict(case.of(chosen[name]))
                print(f"{case.name} | {name} | {row[name]['verdict']} {row[name]['why'][:90]}", flush=True)
                if kept:
                    kept.write_text(json.dumps(known))
    return {name: {k: Outcome(**v) for k, v in row.items()} for name, row in known.items()}


def main() -> None:
    words = argparse.ArgumentParser(description="every hard case with every solver")
    words.add_argument("--docs", type=Path, help="the page to write")
    words.add_argument("--kept", type=Path, help="a JSON file of outcomes, to go on with")
    words.add_argument("--columns", help="only these solvers, separated by commas; the page is not written")
    asked = words.parse_args()
    columns = asked.columns.split(",") if asked.columns else list(solvers())
    found = outcomes(page.FAMILIES, columns, asked.kept)
    failing = [f"{c}, {s}: {o.why}" for c, row in found.items() for s, o in row.items() if o.verdict == FAILS]
    if asked.docs and not asked.columns:
        asked.docs.write_text(page.written(found), encoding="utf-8")
    spent = sum(o.seconds for row in found.values() for o in row.values() if not math.isnan(o.seconds))
    print(f"{sum(map(len, found.values()))} outcomes, {spent:.0f} s of processor, {len(failing)} fail")
    print(*failing, sep="\n")


if __name__ == "__main__":
    main()
