"""The page of what a validation has found, from its JSON: ``python -m mpad_core.testing.page FOUND.json``."""

import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from mpad_core.testing.report import Validation, from_json, number
from mpad_core.testing.rows import FAILS, LEFT_OUT, Row, Told

_HEAD = """\
# What the parts prove

<!-- written by `python -m mpad_core.testing.page found.json`; do not edit -->

`mpad validate` asks every installed part the laws below: solvers at each of their levels, bond models, surfaces,
force laws, whoever wrote them. A law draws its examples (Hypothesis), the same every time; tables have the worst.

    mpad validate -o found.json
    python -m mpad_core.testing.page found.json > docs/validation.md

`--solver NAME`, `--bond`, `--surface`, `--force` ask these parts only; `--examples 10` takes ten times as many.
If a claim fails, the command ends with code 70, names part and claim, and prints a scene with the smallest example at
which a solver's law has failed, which `-o` also writes beside the JSON; `mpad validate --at SCENE` asks all laws of
that solver there again. [Parts](plugins.md#proof) says how to validate a part of your own.
"""
_KINDS = {"solver": "Solvers", "bond": "Bond models", "surface": "Surfaces", "force": "Force laws"}
_RULES = """\
Errors are relative 2-norms of (U, aΩ); matrices are compared entry by entry in Stokes' units. A solver that iterates
is held to ten times its tolerance, others to 1e-8. Reported errors are estimates: where the exact answer is known the
truth may be twice the report; two solvers may differ by three times the sum of theirs in nine cases of ten, and never
by ten times. From 0.5 on a report says that the answer may be wrong by its own size, and nothing is held to it; a
solver that says so of a lone sphere a radius from the wall, or of two spheres five radii apart, fails. A level's claim
is meant for two to four spheres, gaps from a twentieth of a radius, in shear and under weights as strong; the finest
solver installed judges it. Read a cell as found ≤ allowed, in the worst of all examples.
"""
_BOUND = "≤"


def page(validation: Validation) -> str:
    """Write the page: for each kind of part what its laws mean, then what was found."""
    return "\n".join([_HEAD, *(line for kind in _KINDS for line in _of_kind(validation, kind))])


def _of_kind(validation: Validation, kind: str) -> Iterator[str]:
    told = [one for one in validation.told if one.kind == kind]
    if not told:
        return
    yield f"## {_KINDS[kind]}\n"
    if kind == "solver":
        yield _RULES
    yield from _table(("law", "what it asks", "source"), _meanings(told))
    alone = [one for one in told if " beside " not in one.part and one.law != "loads"]
    yield from _found(alone, lambda one: one.part)
    beside = [one for one in told if " beside " in one.part]
    if beside:
        yield "Solvers beside each other:\n"
        yield from _pairs(beside)


def _meanings(told: Iterable[Told]) -> Iterator[tuple[str, ...]]:
    """Give every law once, with the sources of its claims."""
    sources: dict[tuple[str, str], dict[str, None]] = {}
    for one in told:
        stated = {row.source: None for row in one.rows if row.expected is not None}
        sources.setdefault((one.law, one.meaning), {}).update(stated)
    for (law, meaning), named in sources.items():
        yield law, meaning, "; ".join(named) or "interface"


def _found(told: list[Told], column_of: Callable[[Told], str]) -> Iterator[str]:
    """Yield a table with a line for each claim and a column for each part."""
    columns = list(dict.fromkeys(column_of(one) for one in told))
    cells: dict[str, dict[str, str]] = {}
    for one in told:
        for row in one.rows:
            name = row.claim if row.expected is not None else one.law
            cells.setdefault(name, {})[column_of(one)] = _cell(row)
    yield from _table(
        ("claim", *columns), ((claim, *(by.get(column, "") for column in columns)) for claim, by in cells.items())
    )


def _pairs(told: list[Told]) -> Iterator[str]:
    """Yield a table with a line for each pair of solvers and a column for each claim."""
    laws = list(dict.fromkeys(one.law for one in told))
    pairs: dict[str, dict[str, str]] = {}
    for one in told:
        pairs.setdefault(one.part, {})[one.law] = "; ".join(dict.fromkeys(_cell(row) for row in one.rows))
    yield from _table(("solvers", *laws), ((pair, *(by.get(law, "") for law in laws)) for pair, by in pairs.items()))


def _cell(row: Row) -> str:
    if row.verdict == LEFT_OUT:
        return f"not asked: {row.reason}"
    said = f"{number(row.found)} {_BOUND} {number(row.expected)}" if row.expected is not None else row.verdict
    return f"**fails**: {row.reason or said}" if row.verdict == FAILS else said


def _table(heads: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> Iterator[str]:
    yield "| " + " | ".join(heads) + " |"
    yield "| " + " | ".join("---" for _ in heads) + " |"
    for row in rows:
        yield "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in row) + " |"
    yield ""


if __name__ == "__main__":
    print(page(from_json(Path(sys.argv[1]).read_text(encoding="utf-8"))), end="")
