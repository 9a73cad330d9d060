"""A stranger's solver whose errors are known exactly, and small scenes."""

import sys

import pytest

from mpad_core.scene.files import parse_scene

GRADED = '''\
"""A solver that is wrong by as much as it says; its finest level may refuse."""
from typing import ClassVar
from attrs import evolve, field, frozen, validators
from mpad_core import AccuracyLevel, RefusedError, SolverTraits, hookimpl
from mpad_isolated import Isolated

@frozen(kw_only=True)
class Graded:
    name: ClassVar[str] = "graded"
    traits: ClassVar[SolverTraits] = SolverTraits(
        coupling=False,
        levels=tuple(AccuracyLevel(parameters=(("accuracy", x),), error=x) for x in (1e-1, 1e-2)),
    )
    accuracy: float = field(default=1e-2, validator=validators.ge(1e-3))
    def plan(self, setting):
        return Isolated().plan(setting)
    def prepare(self, plan, configuration, guess=None):
        return Isolated().prepare(plan, configuration, guess)
    def solve(self, prepared, loads):
        motion = Isolated().solve(prepared, loads)
        return evolve(motion, velocity=motion.velocity * (1 + self.accuracy))

@frozen(kw_only=True)
class Refusing(Graded):
    name: ClassVar[str] = "refusing"
    traits: ClassVar[SolverTraits] = SolverTraits(
        coupling=False, levels=(AccuracyLevel(parameters=(), error=1e-3),)
    )
    def prepare(self, plan, configuration, guess=None):
        raise RefusedError("sphere 0 is not to its taste")

@hookimpl
def mpad_mobility_solvers():
    return [Graded, Refusing]
'''

SCENE = """\
title = "two cells, no bonds"
solver = "isolated"
stop = { time = "20 ms" }
fluid = { viscosity = "1 mPa s" }
flow = { kind = "shear", rate = "80 1/s" }
wall = {}
[kinds.bead]
radius = "5 um"
[cells.a]
kind = "bead"
height = "5.4 um"
[cells.b]
kind = "bead"
x = "-14 um"
y = "11 um"
height = "6 um"
"""


@pytest.fixture
def strangers(tmp_path, monkeypatch):
    """Install solvers ``graded`` and ``refusing``, as strangers would."""
    folder = tmp_path / "site"
    info = folder / "graded_solver-1.0.dist-info"
    info.mkdir(parents=True)
    (folder / "graded_solver.py").write_text(GRADED)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: graded-solver\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[mpad]\nsolver.graded = graded_solver\nsolver.refusing = graded_solver\n")
    monkeypatch.syspath_prepend(str(folder))
    yield ("graded", "refusing")
    sys.modules.pop("graded_solver", None)


@pytest.fixture
def two_cells():
    return parse_scene(SCENE)


@pytest.fixture
def scene_file(tmp_path):
    path = tmp_path / "two.toml"
    path.write_text(SCENE)
    return path
