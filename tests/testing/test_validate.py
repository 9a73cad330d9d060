"""`mpad validate` finds what is wrong with parts, by name, and says where."""

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

from mpad_core.scene.files import parse_scene
from mpad_core.testing.report import from_json, json_text, table_lines

pytestmark = pytest.mark.timeout(600)

WRONG = Path(__file__).parent / "wrong_parts"
SOLVERS = {
    "wrong-sign": "two spheres are as good as claimed",
    "wrong-drag": "a lone sphere is as good as claimed",
    "wrong-symmetry": "mobility is symmetric",
    "says-nothing": "the claim says something",
    "pads": "claims are not padded",
    "boasts": "a lone sphere is as good as claimed",
}
OTHERS = {
    ("bond", "wrong-rate"): "Tension and rates are finite, rates are not negative",
    ("bond", "wrong-shape"): "Every element of an array is treated alone",
    ("surface", "wrong-bound"): "The density lies between zero and the bound",
}


def installed_at(folder: Path) -> dict[str, str]:
    """Install the wrong parts by lying on the path; give the environment that sees them."""
    project = tomllib.loads((WRONG / "pyproject.toml").read_text())["project"]
    info = folder / f"mpad_wrong_parts-{project['version']}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    lines = [f"{name} = {value}" for name, value in project["entry-points"]["mpad"].items()]
    (info / "entry_points.txt").write_text("\n".join(["[mpad]", *lines, ""]))
    (folder / "mpad_wrong_parts.py").write_bytes((WRONG / "mpad_wrong_parts.py").read_bytes())
    return os.environ | {"PYTHONPATH": str(folder)}


def validate(folder: Path, env: dict[str, str], *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mpad_core", "validate", *words]
    return subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, timeout=550, check=False)


@pytest.fixture(scope="module")
def wrong(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str], Any]:
    """Validate all wrong parts, and the right one, in one go."""
    folder = tmp_path_factory.mktemp("wrong")
    env = installed_at(folder / "site")
    solvers = [word for name in ("right", "raises", *SOLVERS) for word in ("--solver", name)]
    others = [word for kind, name in OTHERS for word in (f"--{kind}", name)]
    return folder, env, validate(folder, env, *solvers, *others, "--examples", "0.4", "-o", "found.json")


def failing(folder: Path) -> dict[str, list[str]]:
    """Give the failing claims by part."""
    found: dict[str, list[str]] = {}
    for told in json.loads((folder / "found.json").read_text())["told"]:
        for row in told["rows"]:
            if row["verdict"] == "FAILS":
                found.setdefault(told["part"], []).append(f"{row['claim']} {row['reason']}")
    return found


@pytest.mark.long
def test_wrong_parts_are_found_by_name(wrong: Any) -> None:
    folder, _, done = wrong
    assert done.returncode == 70, done.stderr
    assert done.stderr.count("\n") == 1
    found = failing(folder)
    for name, claim in SOLVERS.items():
        assert any(claim in each for each in found.get(name, [])), (name, found.get(name))
        assert f"solver {name}: " in done.stderr
    for (kind, name), claim in OTHERS.items():
        assert any(claim in each for each in found.get(name, [])), (name, found.get(name))
        assert f"{kind} {name}: " in done.stderr
    assert any("ZeroDivisionError: no more than two" in each for each in found["raises"])


@pytest.mark.long
def test_the_right_one_is_right(wrong: Any) -> None:
    """What the wrong ones are wrapped in is not what is found."""
    folder, _, _ = wrong
    found = failing(folder)
    assert "right" not in found
    rights = {name for name in found if "right" in name.split(" beside ")}
    assert all(set(name.split(" beside ")) & {"raises", *SOLVERS} for name in rights), rights
    assert "two spheres are as good as claimed" not in " ".join(found["pads"])


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "law"),
    [
        ("wrong-symmetry", "symmetric"),
        ("wrong-sign", "two-spheres-are-as-good-as-claimed"),
        ("wrong-drag", "lone-sphere-is-as-good-as-claimed"),
    ],
)
def test_a_scene_reproduces_the_failure(wrong: Any, name: str, law: str) -> None:
    folder, env, first = wrong
    path = folder / f"{name}-{law}.toml"
    text = path.read_text()
    assert text.startswith(f"# {name}: ")
    assert "expected at most" in text
    parse_scene(text.replace(f'name = "{name}"', 'name = "rpb"'))
    assert path.name in first.stdout
    again = validate(folder, env, "--at", str(path))
    assert again.returncode == 70
    assert f"solver {name}: " in again.stderr
    assert SOLVERS[name] in again.stderr


@pytest.mark.slow
def test_isolated_from_end_to_end(tmp_path: Path) -> None:
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = --no-such-option\n")  # the user's own, not ours
    (tmp_path / "conftest.py").write_text("raise RuntimeError('not ours')\n")
    done = validate(tmp_path, dict(os.environ), "--solver", "isolated", "--examples", "0.2", "-o", "found.json")
    assert done.returncode == 0, done.stderr
    assert "two spheres are as good as claimed" in done.stdout
    assert "FAILS" not in done.stdout
    found = from_json((tmp_path / "found.json").read_text())
    assert json_text(found) == (tmp_path / "found.json").read_text()
    assert list(table_lines(found)) == done.stdout.splitlines()[: len(list(table_lines(found)))]


@pytest.mark.slow
def test_what_is_not_installed_is_said(tmp_path: Path) -> None:
    done = validate(tmp_path, dict(os.environ), "--solver", "isolate")
    assert done.returncode == 2
    assert "no solver 'isolate' is installed; did you mean 'isolated'?" in done.stderr
    assert done.stderr.count("\n") == 1
