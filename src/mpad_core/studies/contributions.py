"""What the effects contributed to a run: for the summary, and in words."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mpad_core.physics.problem import Problem
from mpad_core.running.accounting import Account

_SHARES = ("velocity_share", "normal_share", "time_share")
_SPENT = ("coupling", "drift", "burst", "recording", "accounting")
_COLUMNS = 4  # cells at most for which there is a column


def described(problem: Problem, account: Account) -> dict[str, Any]:
    """Describe every effect: on or off, why, and its shares."""
    found = {}
    for effect in problem.effects:
        own = account.effects[effect.name]
        shares = dict(zip(_SHARES, (own.velocity, own.normal, own.time), strict=True))
        found[effect.name] = {"on": effect.on, "why": effect.why, **shares}
    return found


def of_cell(account: Account, cell: int) -> dict[str, Any]:
    """Give the shares of the effects in one cell's velocity, and in that normal to the wall."""
    told = {name: own.cells[cell] for name, own in account.effects.items() if own.cells}
    return {name: dict(zip(_SHARES, pair, strict=False)) for name, pair in told.items()}


def spent(account: Account) -> dict[str, Any]:
    """Say where the time went, and how many outer steps stand behind the shares."""
    return {**account.time, "outer_steps": account.steps, "looked_at": account.looked_at}


def effect_lines(summary: dict[str, Any]) -> Iterator[str]:
    """Yield the table of effects that ``mpad run`` prints: of the first run."""
    run = summary["runs"][0]
    if not run["time_shares"]["looked_at"]:
        return
    cells = list(run["cells"]) if len(run["cells"]) <= _COLUMNS else []
    yield "effects, median shares of the velocity | of the velocity normal to the wall:"
    yield f"  {'':<12}{'time':>9}{'all':>20}" + "".join(f"{name[:18]:>20}" for name in cells)
    for name, effect in run["effects"].items():
        own = [run["cells"][cell]["effects"].get(name, {}) for cell in cells]
        columns = "".join(f"{_percent(of, 'velocity_share')} |{_percent(of, 'normal_share')}" for of in (effect, *own))
        yield f"  {name:<12}{_percent(effect, 'time_share')}{columns}" if effect["on"] else f"  {name:<12}{'off':>9}"
    times = run["time_shares"]
    yield "time: " + ", ".join(f"{name} {100 * times[name]:.2g} %" for name in _SPENT)


def _percent(of: dict[str, Any], key: str) -> str:
    share = of.get(key)
    return f"{'-':>9}" if share is None else f"{100 * share:7.2f} %"


def remembered(summary: dict[str, Any], file: Path) -> dict[str, Any]:
    """Take over, for runs that had ended before this process, what an earlier summary says of their effects."""
    try:
        earlier = {run["folder"]: run for run in json.loads(file.read_text())["runs"]}
        for run in summary["runs"]:
            before = earlier.get(run["folder"])
            if before and not run["time_shares"]["outer_steps"]:
                run |= {key: before[key] for key in ("effects", "time_shares")}
                for name, cell in run["cells"].items():
                    cell["effects"] = before["cells"][name]["effects"]
    except (OSError, ValueError, KeyError, TypeError):
        return summary  # there is none, or it is of an older version
    return summary | {"effects": summary["runs"][0]["effects"]}
