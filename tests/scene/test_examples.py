"""The examples read with the parts that are installed, not with stand-ins."""

import pytest

from mpad_core.scene.files import parse_scene, resolved_toml


@pytest.mark.parametrize("name", ["recruitment", "capture"])
def test_examples_read_with_installed_parts(name: str, examples: dict[str, str]) -> None:
    scene = parse_scene(examples[name], f"{name}.toml")
    assert scene.solver.name == "rpb"
    assert scene.repulsion is not None
    force = scene.repulsion.instance.force(0.01)
    assert 900 < force < 1100  # pN: the law is calibrated to 1 nN at a tip gap of 10 nm
    assert scene.wall is not None
    assert scene.wall.sites["p-selectin"].instance.densest() == 180
    assert parse_scene(resolved_toml(scene)) == scene
