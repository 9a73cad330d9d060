"""A stranger's package is installed as a stranger would install it, and works: the tutorial, from its own folder."""

import ast
import os
import shutil
import subprocess
import sys
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TUTORIAL = ROOT / "docs" / "tutorial"
MODULE = TUTORIAL / "mpad_dembo_spring.py"
NEEDED = ("mpad-bell", "mpad-isolated", "mpad-surfaces")
MOST_LINES = 25

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(900),
]  # installs numpy, scipy and numba anew, and compiles the kernels


def code_lines(file: Path) -> set[int]:
    """Give the lines that hold code: neither blank, nor comment, nor docstring."""
    silent = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    with file.open("rb") as source:
        tokens = [t for t in tokenize.tokenize(source.readline) if t.type not in silent | {tokenize.ENCODING}]
    lines = {line for token in tokens for line in range(token.start[0], token.end[0] + 1)}
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
            lines -= set(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    return lines


def test_the_module_is_short() -> None:
    assert len(code_lines(MODULE)) <= MOST_LINES


def test_the_test_is_short() -> None:
    tests = list((TUTORIAL / "tests").glob("*.py"))
    assert len(tests) == 1
    assert len(tests[0].read_text(encoding="utf-8").splitlines()) <= 6


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make an environment outside the workspace that holds the core, three plugins and the tutorial's package."""
    home = tmp_path_factory.mktemp("stranger")
    shutil.copytree(TUTORIAL, home / "package", ignore=shutil.ignore_patterns("__pycache__", ".*"))
    subprocess.run([sys.executable, "-m", "venv", home / "venv"], check=True, timeout=120)
    packages = [f"{ROOT}[testing]", *(str(ROOT / "plugins" / name) for name in NEEDED), str(home / "package")]
    done = run(home, "python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *packages)
    assert done.returncode == 0, done.stderr[-3000:]
    return home


def run(home: Path, program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a program of the environment, in its folder, with nothing of this process's own environment."""
    own = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV", "UV_"))}
    own["NUMBA_CACHE_DIR"] = str(home / "kernels")
    tools = home / "venv" / ("Scripts" if os.name == "nt" else "bin")
    command = [str(tools / program), *arguments]
    return subprocess.run(command, cwd=home, env=own, capture_output=True, text=True, timeout=800)


def test_parts_lists_it(environment: Path) -> None:
    done = run(environment, "mpad", "parts")
    assert done.returncode == 0, done.stderr
    assert "dembo-spring  (mpad-dembo-spring 0.1.0)" in done.stdout
    assert str(ROOT / "src") not in run(environment, "python", "-c", "import mpad_core as m; print(m.__file__)").stdout


def test_its_scene_is_checked_and_runs(environment: Path) -> None:
    scene = str(environment / "package" / "rolling.toml")
    checked = run(environment, "mpad", "check", scene)
    assert checked.returncode == 0, checked.stderr
    assert "bond tether: dembo-spring (mpad-dembo-spring 0.1.0)" in checked.stdout
    ran = run(environment, "mpad", "run", scene, "-o", "out", "--set", 'stop.time="50 ms"')
    assert ran.returncode == 0, ran.stderr
    assert (environment / "out" / "trajectory.h5").exists()
    assert " 0 bonds" not in ran.stdout


def test_its_own_test_passes(environment: Path) -> None:
    done = run(
        environment,
        "python",
        "-m",
        "pytest",
        "-q",
        "-W",
        "error",
        "-p",
        "no:cacheprovider",
        str(environment / "package"),
    )
    assert done.returncode == 0, done.stdout[-3000:]
    assert " passed" in done.stdout
