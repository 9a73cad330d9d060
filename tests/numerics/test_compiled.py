"""The kernel cache: an edited callee is seen, a damaged file is made anew, and no home is no obstacle."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

_CALLER = """
from mpad_core.numerics.compiled import compiled
from probe_kernels.callee import inner

@compiled
def outer(x):
    return 2.0 * inner(x)
"""
_CALLEE = """
from mpad_core.numerics.compiled import compiled

@compiled
def inner(x):
    return x + {term}
"""
_RUN = """
import numba
from probe_kernels.caller import outer
print(outer(1.0), sum(outer.stats.cache_hits.values()), numba.config.CACHE_DIR)
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """Make an installed plugin of two modules; its kernels call each other."""
    site = tmp_path / "site"
    folder, info = site / "probe_kernels", site / "probe_kernels-1.0.dist-info"
    folder.mkdir(parents=True)
    info.mkdir()
    (folder / "__init__.py").touch()
    (folder / "caller.py").write_text(_CALLER)
    (folder / "callee.py").write_text(_CALLEE.format(term="1.0"))
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: probe_kernels\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[mpad]\nbond.probe = probe_kernels\n")
    return site


def run(site: Path, code: str = _RUN, **environment: str) -> tuple[float, int, str]:
    """Run in a process of its own; give the kernel's answer, the number of cache hits, the cache's place."""
    kept = {name: text for name, text in os.environ.items() if name not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    kept |= {"PYTHONPATH": str(site), "PYTHONDONTWRITEBYTECODE": "1"} | environment
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, env=kept)
    assert done.returncode == 0, done.stderr
    answer, hits, place = done.stdout.split()
    return float(answer), int(hits), place


def test_an_edited_callee_gives_a_new_answer(package: Path, tmp_path: Path) -> None:
    cache = str(tmp_path / "cache")
    answer, hits, place = run(package, XDG_CACHE_HOME=cache)
    assert (answer, hits) == (4.0, 0)
    assert Path(place).parent == tmp_path / "cache" / "mpad"
    assert Path(place).stat().st_mode & 0o077 == 0  # cached kernels are pickles: nobody else may write them
    assert run(package, XDG_CACHE_HOME=cache)[:2] == (4.0, 1)
    (package / "probe_kernels" / "callee.py").write_text(_CALLEE.format(term="2.0"))
    assert run(package, XDG_CACHE_HOME=cache)[0] == 6.0


@pytest.mark.parametrize(("suffix", "damage"), [("nbi", b"no pickle at all"), ("nbc", None)])
def test_a_damaged_file_is_made_anew(package: Path, tmp_path: Path, suffix: str, damage: bytes | None) -> None:
    cache = str(tmp_path / "cache")
    run(package, XDG_CACHE_HOME=cache)
    files = list(Path(cache).rglob(f"*.{suffix}"))
    assert files
    for file in files:
        file.write_bytes(file.read_bytes()[: file.stat().st_size // 2] if damage is None else damage)
    assert run(package, XDG_CACHE_HOME=cache)[:2] == (4.0, 0)
    assert run(package, XDG_CACHE_HOME=cache)[:2] == (4.0, 1)


def test_a_home_that_cannot_be_written_is_no_obstacle(package: Path, tmp_path: Path) -> None:
    answer, _, place = run(package, HOME=os.devnull, TMPDIR=str(tmp_path))
    assert answer == 4.0
    assert tmp_path in Path(place).parents


def test_no_home_at_all_is_no_obstacle(package: Path) -> None:
    """As in a container whose user has neither HOME nor an entry among the users."""
    homeless = "import os, pwd\nos.environ.pop('HOME', None)\n"
    homeless += "def unknown(number):\n    raise KeyError(number)\npwd.getpwuid = unknown\n"
    assert run(package, homeless + _RUN)[0] == 4.0


def test_processes_without_a_home_do_not_fill_the_temporary_directory(package: Path, tmp_path: Path) -> None:
    """Either they share one folder, or each takes its own away again."""
    (tmp_path / "tmp").mkdir()
    for _ in range(2):
        run(package, HOME=os.devnull, TMPDIR=str(tmp_path / "tmp"))
    assert len(list((tmp_path / "tmp").iterdir())) <= 1
