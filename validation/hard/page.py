"""The page of hard cases: a table of verdicts, one of numbers, and what refusals say."""

import math
from collections.abc import Iterator

from hard.cases import FAILS, HOLDS, Case, Outcome, solvers
from hard.configurations import BEYOND, CONTACT
from hard.held import HELD
from hard.runs import RUNS
from hard.tracers import TRACERS

FAMILIES: dict[str, list[Case]] = {
    "At contact": CONTACT,
    "Beyond contact": BEYOND,
    "Held spheres": HELD,
    "Tracers": TRACERS,
    "Runs": RUNS,
}
_SHORT = {  # of what a refusal says, the first that fits
    "has no flow": "no flow",
    "there is no fluid": "no fluid",
    "driven through": "driven through",
    "at the start": "overlap",
    "singular": "singular",
    "not positive definite": "not definite",
    "balances the loads": "no balance",
    "touches or cuts the wall": "wall",
    "wall cuts it": "wall",
    "not above the wall": "wall",
    "touch or overlap": "contact",
    "overlap": "overlap",
    "too small beside": "unresolved",
}
_HEAD = """\
# Hard cases

What solvers and runs do where they are pushed to, and over, the edge: the radius is a, gaps are between smooth
surfaces. Every case is asked of every built-in solver (`auto` answers by one of them); what must hold is in the first
column of the tables below. A case *holds*, or is *refused* in one clear line that names the sphere or cell and the
number, before anything wrong is computed or stored. `pytest validation/hard` asks the cheap ones,
`benchmarks/hard_cases.py --docs docs/hard-cases.md` asks all and writes this page.

The mobility counts in Stokes' units, 1/(6πηa) and 1/(8πηa³). Spheres are free in shear, pulled down by a weight as
strong as the shear. The error found is that against `cdl-biem` at 1e-4; it must be within three times what the solver
reports for this very solve, or within what its level claims, plus the error of the comparison itself. Where spheres
touch or overlap there is no exact answer to compare with.

**In runs** no step carries smooth spheres through each other, or through the wall: each outer step is looked at along
all of its way, and one that would is taken again at half the length. If cells meet however short the step, which
without repulsion is what solvers without lubrication make them do, the run stops with a line that names them, the
gap, the time and the remedy. Runs whose cells overlap at the start are refused before step one.

"""


def written(found: dict[str, dict[str, Outcome]]) -> str:
    """Write the page of all outcomes, by case and column."""
    return _HEAD + "\n".join([*_verdicts(found), *_numbers(found), *_refusals(found)]) + "\n"


def columns_of(family: str) -> list[str]:
    """Give the solvers that a family's cases are asked of; boundary elements take too long for runs."""
    return [name for name in solvers() if family != "Runs" or not name.startswith("elements")]


def _row(*cells: str) -> str:
    return "| " + " | ".join(cells) + " |"


def _verdict(outcome: Outcome) -> str:
    if outcome.verdict in (HOLDS, FAILS):
        return outcome.verdict if outcome.verdict == HOLDS else "**fails**"
    return "refused: " + next((short for said, short in _SHORT.items() if said in outcome.why), "see below")


def _verdicts(found: dict[str, dict[str, Outcome]]) -> Iterator[str]:
    yield "## What holds\n"
    for family, cases in FAMILIES.items():
        columns = columns_of(family)
        yield f"**{family}**\n"
        for must in dict.fromkeys(case.must for case in cases):
            yield _row(f"must: {must}", *columns)
            yield _row(*["---"] * (1 + len(columns)))
            for case in cases:
                if case.must == must:
                    yield _row(case.name, *(_verdict(found[case.name][name]) for name in columns))
            yield ""
    fails = [f"- {c}, `{s}`: {o.why}" for c, row in found.items() for s, o in row.items() if o.verdict == FAILS]
    if fails:
        yield "**What fails, and why**\n"
        yield from fails
        yield ""


def _number(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.0e}"


def _numbers(found: dict[str, dict[str, Outcome]]) -> Iterator[str]:
    yield "## Numbers\n"
    yield (
        "Condition number of the mobility / its lowest eigenvalue; iterations for one right-hand side; error\n"
        "claimed → found, – where there is nothing to compare with. What was refused has none.\n"
    )
    for family in ("At contact", "Beyond contact"):
        columns = columns_of(family)
        yield _row(family, *columns)
        yield _row(*["---"] * (1 + len(columns)))
        for case in FAMILIES[family]:
            yield _row(case.name, *(_of_mobility(found[case.name][name]) for name in columns))
        yield ""
    yield (
        "Held spheres: iterations; what they move by under the loads that hold them, in units of the flow. Tracers:\n"
        "how far the fluid moves against the surface. Runs: outer steps; then the least gap on the way in µm, the\n"
        "growth of energy, the bonds left, or the relative error of the place, whichever it is that must hold.\n"
    )
    for family in ("Held spheres", "Tracers", "Runs"):
        columns = columns_of(family)
        yield _row(family, *columns)
        yield _row(*["---"] * (1 + len(columns)))
        for case in FAMILIES[family]:
            yield _row(case.name, *(_of_rest(found[case.name][name]) for name in columns))
        yield ""


def _of_mobility(outcome: Outcome) -> str:
    if math.isnan(outcome.condition):
        return "refused"
    error = f"{_number(outcome.claimed)} → {_number(outcome.found) or '–'}"
    return f"{_number(outcome.condition)} / {_number(outcome.lowest)}; {outcome.iterations}; {error}"


def _of_rest(outcome: Outcome) -> str:
    if math.isnan(outcome.found):
        return "refused" if outcome.verdict != FAILS else "fails"
    return f"{outcome.iterations}; {_number(outcome.found)}" if outcome.iterations >= 0 else _number(outcome.found)


def _refusals(found: dict[str, dict[str, Outcome]]) -> Iterator[str]:
    """Give one refusal of each sort as it is printed."""
    yield "## What refusals say\n"
    first: dict[tuple[str, str], str] = {}
    for row in found.values():
        for column, outcome in row.items():
            if outcome.verdict not in (HOLDS, FAILS):
                first.setdefault((_verdict(outcome), column.split()[0]), outcome.why)
    yield _row("", "solver", "line")
    yield _row("---", "---", "---")
    for (short, column), line in sorted(first.items()):
        yield _row(short.removeprefix("refused: "), f"`{column}`", line)
