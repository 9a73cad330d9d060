"""The page on bonds lists every preset that is shipped, with its numbers and whether it was read."""

from pathlib import Path
from typing import Any

import pytest

from mpad_core.plugins.registry import installed, load

PAGE = (Path(__file__).parents[2] / "docs" / "bonds.md").read_text(encoding="utf-8")
SHIPPED = ("mpad-bell", "mpad-catch")
MODELS = [part.name for part in installed("bond") if part.distribution in SHIPPED]
PRESETS = [(model, name) for model in MODELS for name in getattr(load("bond", model), "presets", {})]


def said(preset: Any) -> str:
    """Give a preset's values as the page writes them: rates in 1/s, compliances in angstrom."""
    rates = [f"{value:g} 1/s" for key, value in preset.parameters.items() if "rate" in key]
    lengths = [f"{1e4 * value:g} Å" for key, value in preset.parameters.items() if "compliance" in key]
    return "; ".join(f"{rate}, {length}" for rate, length in zip(rates, lengths, strict=True))


@pytest.mark.parametrize(("model", "name"), PRESETS)
def test_each_preset_has_its_row(model: str, name: str) -> None:
    preset = load("bond", model).presets[name]
    (row,) = [line for line in PAGE.splitlines() if line.startswith(f"| `{model}` | `{name}` |")]
    _, _, _, values, source, provenance, _ = (cell.strip() for cell in row.split("|"))
    assert values == said(preset)
    assert provenance == preset.provenance
    assert source.split()[0] == preset.source.split()[0]


def test_no_row_is_made_up() -> None:
    rows = [line for line in PAGE.splitlines() if line.endswith(("| published |", "| recalled |"))]
    assert len(rows) == len(PRESETS) == 11


@pytest.mark.parametrize("model", MODELS)
def test_each_model_has_its_row(model: str) -> None:
    assert f"\n| `{model}` | " in PAGE.split("## Inner states")[0]
