"""The summary of a run in words."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mpad_core.studies.contributions import effect_lines


def summary_lines(summary: dict[str, Any], directory: Path) -> Iterator[str]:
    """Yield what ``mpad run`` prints at the end."""
    for run in summary["runs"]:
        what = "control" if run["control"] else "run"
        yield f"{what} {run['folder']} (seed {run['seed']}): t = {run['time_s']:.4g} s, ended by {run['ended']}"
        for name, cell in run["cells"].items():
            yield f"  {name}: {_cell(cell)}"
    if "passage" in summary:
        yield from _passage_lines(summary["passage"])
    if "solver_choice" in summary:
        yield f"solver chosen: {summary['solver_choice']['reason']}"
    yield from effect_lines(summary)
    yield f"written to {directory}"


def _cell(cell: dict[str, Any]) -> str:
    parts = [f"mean speed {cell['mean_speed_um_per_s']:.4g} um/s"] if cell["mean_speed_um_per_s"] is not None else []
    if cell["mean_speed_over_gamma_a"] is not None:
        parts.append(f"= {cell['mean_speed_over_gamma_a']:.4g} gamma a")
    parts.append(f"mean height {cell['mean_height_um']:.4f} um, {cell['bonds_at_end']} bonds at the end")
    return ", ".join(parts)


def _passage_lines(passage: dict[str, Any]) -> Iterator[str]:
    past = ", ".join(passage["past"])
    first = passage["passages"][0]
    yield f"passage of {passage['cell']} past {past}:"
    if first["free_stream_U_over_gamma_z"] is not None:
        yield f"  free stream: U/(gamma z) = {first['free_stream_U_over_gamma_z']:.6f}"
    for side in ("upstream", "downstream"):
        found = first[f"least_overlap_{side}"]
        if found:
            yield f"  least overlap {side}: {_least(found)}"
    for odds in first.get("capture_odds_were_it_free_to_bind", ()):
        rate = odds["on_rate_per_s"]
        rates = "/".join(f"{r:g}" for r in rate) if isinstance(rate, list) else f"{rate:g}"
        where = "" if odds["median_dx_um"] is None else f", half of them before dx = {odds['median_dx_um']:.1f} um"
        yield f"  were it free to bind at {rates} 1/s: probability of a first bond {odds['probability']:.3g}{where}"
    control = (
        ""
        if passage["caught_in_control"] is None
        else f"; in the control without {past}: {passage['caught_in_control']}"
    )
    yield f"  caught: {passage['caught']} of {passage['of']}{control}"
    for described in passage["passages"]:
        if described["caught"]:
            where = f"bound at dx = {described['bound_dx_um']:.2f} um, caught at {described['caught_dx_um']:.2f} um"
            yield f"    {where}, t = {described['caught_at_s']:.4g} s"


def _least(found: dict[str, Any]) -> str:
    text = f"{found['delta_nm']:.2f} nm at dx = {found['dx_um']:.1f} um"
    marks = [name.replace("_", " ") for name in ("at_edge_of_range", "rests_on_contact") if found[name]]
    if marks:
        text += f" ({', '.join(marks)})"
    if "alone_nm" in found and found["alone_nm"] is not None:
        other = found["contribution_of_the_other_nm"]
        text += f"; alone {found['alone_nm']:.2f} nm, so the other cell contributed {other:+.2f} nm"
    return text
