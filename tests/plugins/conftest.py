"""Make-believe distributions, installed by lying on the path, and the command line called in this process."""

import os
import sys
from pathlib import Path

import pytest


@pytest.fixture
def distribution(tmp_path, monkeypatch):
    """Install a distribution: one module, with entry points of the group ``mpad`` that all lead to it.

    A single module, not a package: packages of plugins name the cache of compiled kernels, and each would compile anew.
    """
    folder = tmp_path / "site"
    folder.mkdir()
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setenv("PYTHONPATH", str(folder), prepend=os.pathsep)
    modules = set()

    def install(name, parts, source, version="1.0", value=None):
        module = name.replace("-", "_")
        modules.add(module)
        sys.modules.pop(module, None)
        (folder / f"{module}.py").write_text(source)
        info = folder / f"{module}-{version}.dist-info"
        info.mkdir(exist_ok=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
        lines = "\n".join(f"{part} = {value or module}" for part in parts)
        (info / "entry_points.txt").write_text(f"[mpad]\n{lines}\n")
        return module

    yield install
    for module in modules:
        sys.modules.pop(module, None)


@pytest.fixture(scope="session")
def recruitment():
    return Path(__file__).parents[2] / "examples" / "recruitment.toml"
