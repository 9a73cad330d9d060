"""The reference page has every key of the scene, with its unit and default."""

from pathlib import Path
from typing import Any

import attrs
import pytest

from mpad_core.scene import spec
from mpad_core.scene.structure import converter, with_unit

PAGE = (Path(__file__).parents[2] / "docs" / "scene.md").read_text(encoding="utf-8")

SECTIONS = {
    "## Top level": spec.Scene, "## stop": spec.Stop, "## accuracy": spec.Accuracy, "## fluid": spec.Fluid,
    "## flow": spec.Flow, "## gravity": spec.Gravity, "## wall": spec.Wall, "## kinds": spec.Kind,
    "### sites of a kind": spec.CellSites, "## cells": spec.Cell, "### start": spec.Start, "## groups": spec.Group,
    "## bonds": spec.Bond, "### on_rate": spec.OnRate, "### encounter": spec.Encounter,
    "## effects": spec.Effects, "## record": spec.Record,
    "### every": spec.Every, "### caught": spec.Caught, "## passage": spec.Passage,
}  # fmt: skip

INHERITED = {("Kind", "density"), ("Cell", "height"), ("Cell", "overlap"), ("Group", "height"), ("Group", "overlap")}


def rows(section: str) -> dict[str, list[str]]:
    """Give the cells of each row of a section's first table, by key."""
    body = PAGE.split(f"\n{section}\n", 1)[1].split("\n#", 1)[0].split("| meaning |")[1]
    lines = [line for line in body.split("\n\n")[0].split("\n") if line.startswith("| `")]
    cells = [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]
    return {row[0].strip("` "): row for row in cells}


@pytest.mark.parametrize(("section", "table"), SECTIONS.items())
def test_every_key_has_its_row(section: str, table: Any) -> None:
    assert list(rows(section)) == [field.alias for field in attrs.fields(table)]


@pytest.mark.parametrize(("section", "table"), SECTIONS.items())
def test_units_and_defaults_are_true(section: str, table: Any) -> None:
    for field in attrs.fields(table):
        _, unit, default, _ = (piece.strip() for piece in "|".join(rows(section)[field.alias]).split("|", 3))
        assert unit.strip("`") == field.metadata.get("unit", ""), field.alias
        if (table.__name__, field.alias) in INHERITED:
            continue
        assert (default == "required") == (field.default is attrs.NOTHING), field.alias
        if isinstance(field.default, str | int | float):
            said = default.strip("`")
            value = float(said) if not said.startswith('"') and isinstance(field.default, float) else said.strip('"')
            if field.metadata.get("unit"):
                value = converter().structure(said.strip('"'), with_unit(float, field.metadata["unit"]))
            assert str(value).lower() == str(field.default).lower(), field.alias
