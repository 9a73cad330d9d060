"""Imports run one way, and what is light stays light."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HEAVY = ("numba", "scipy", "h5py", "matplotlib", "hypothesis")


def test_contracts_of_the_import_linter() -> None:
    tool = Path(sys.executable).with_name("lint-imports")
    if not tool.exists():
        pytest.skip("import-linter is not installed")
    done = subprocess.run([tool, "--no-cache"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:]


def loaded_by(code: str) -> list[str]:
    """Run code in a new interpreter; give which of the heavy modules it has loaded."""
    tail = f"import sys; print([name for name in {HEAVY} if name in sys.modules], file=sys.stderr)"
    code = f"import atexit\n@atexit.register\ndef _():\n    {tail}\n{code}"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found: list[str] = eval(done.stderr.strip().splitlines()[-1])
    return found


def test_importing_the_core_is_light() -> None:
    assert loaded_by("import mpad_core, mpad_core.cli, mpad_core.interfaces.mobility") == []


@pytest.mark.parametrize("arguments", [["parts"], ["--help"], ["--version"]])
def test_listing_is_light(arguments: list[str]) -> None:
    assert loaded_by(f"from mpad_core import cli\nimport sys\nsys.argv[1:] = {arguments}\ncli.main()") == []


@pytest.mark.parametrize("name", ["recruitment", "capture"])
def test_checking_a_scene_never_loads_numba(name: str) -> None:
    arguments = ["check", f"examples/{name}.toml"]
    found = loaded_by(f"from mpad_core import cli\nimport sys\nsys.argv[1:] = {arguments}\ncli.main()")
    assert "numba" not in found
    assert "h5py" not in found
