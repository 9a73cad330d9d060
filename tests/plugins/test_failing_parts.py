"""A part that fails in the middle of a run: caught, named with the step, and the run goes on with a good one."""

import pytest

from recorded import assert_same, datasets

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("default"),
]  # as a user has them: a warning must not do the work of a check

SOLVER = '''\
"""A solver that is good or bad as a variable of the environment says, once a cell has passed x = 0.5 um."""
import os
import sys
from typing import ClassVar
import numpy as np
from attrs import evolve, frozen
from mpad_core import Motion, hookimpl
from mpad_rpb import RotnePragerBlake

def nan_in_flow(v):
    v[..., -1] = np.nan
    return v

def nan_in_one(v):
    v[0, 2, 2] = np.nan
    return v

def lopsided(v):
    v[0, 1, 0] += 0.3 * v[0, 0, 0]
    return v

def leave(v):
    sys.exit(0)

def fail(v):
    raise ZeroDivisionError("nought below the line")

def stop(v):
    raise KeyboardInterrupt

FAULTS = {
    "raises": fail,
    "leaves": leave,
    "nan": lambda v: np.full_like(v, np.nan),
    "nan in the flow": nan_in_flow,
    "nan in one place": nan_in_one,
    "infinite": lambda v: v * np.inf,
    "one column": lambda v: v[..., 0],
    "one column short": lambda v: v[..., :-1],
    "one sphere short": lambda v: v[:-1],
    "axes moved": lambda v: np.ascontiguousarray(np.moveaxis(v, -1, 0)),
    "axes swapped": lambda v: np.ascontiguousarray(np.swapaxes(v, 0, 1)),
    "flat": lambda v: v.ravel(),
    "complex": lambda v: v * (1 + 1e-3j),
    "text": lambda v: "fast",
    "none": lambda v: None,
    "lopsided": lopsided,
    "indefinite": lambda v: v[..., -1:] - (v - v[..., -1:]),
    "nothing moves": lambda v: np.zeros_like(v),
}

@frozen(kw_only=True)
class Fickle:
    name: ClassVar[str] = "fickle"
    traits = RotnePragerBlake.traits
    def plan(self, setting): return RotnePragerBlake().plan(setting)
    def prepare(self, plan, configuration, guess=None):
        fault = os.environ.get("FICKLE", "") if configuration.centres[:, 0].max() > 0.5 else ""
        if fault == "prepare raises": fail(None)
        if fault == "prepare gives none": return None
        if fault == "writes to its input": configuration.centres[:], configuration.radii[:] = 1.0, 7.0
        return RotnePragerBlake().prepare(plan, configuration, guess), fault
    def solve(self, prepared, loads):
        prepared, fault = prepared
        motion = RotnePragerBlake().solve(prepared, loads.copy())
        if fault == "writes to its loads": loads[:] = 1e9
        if fault == "answers none": return None
        if fault in FAULTS: return evolve(motion, velocity=FAULTS[fault](motion.velocity.copy()))
        return motion

@hookimpl
def mpad_mobility_solvers(): return [Fickle]
'''
SCENE = """\
solver = "fickle"
stop = { time = "6 ms" }
fluid = { viscosity = "1 mPa s" }
flow = { kind = "shear", rate = "80 1/s" }
wall = {}
record = { every = { time = "1 ms" } }
[kinds.bead]
radius = "5 um"
[cells.a]
kind = "bead"
height = "5.4 um"
[cells.b]
kind = "bead"
x = "-12 um"
height = "6 um"
"""
FAULTS = [
    "raises", "leaves", "nan", "nan in the flow", "nan in one place", "infinite", "one column", "one column short",
    "one sphere short", "axes moved", "axes swapped", "flat", "complex", "text", "none", "lopsided", "indefinite",
    "nothing moves", "prepare raises", "prepare gives none", "answers none",
]  # fmt: skip


@pytest.fixture
def scene(tmp_path, distribution):
    distribution("mpad-fickle", ["solver.fickle"], SOLVER)
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


@pytest.mark.parametrize("fault", FAULTS)
def test_a_failing_solver_is_named_with_its_step_and_the_run_goes_on(fault, scene, mpad, tmp_path, monkeypatch):
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    assert mpad("run", scene, "-o", whole)[0] == 0
    monkeypatch.setenv("FICKLE", fault)
    code, _, err = mpad("run", scene, "-o", cut, "--checkpoint-every", "0")
    said = [line for line in err.splitlines() if not line.startswith("{")]
    assert code == 70, err
    assert len(said) == 1, err
    assert "fickle" in said[0]
    assert "step" in said[0]
    assert "before step one" not in said[0]
    assert "resume" in said[0]
    monkeypatch.delenv("FICKLE")
    code, _, err = mpad("run", scene, "-o", cut, "--resume")
    assert code == 0, err
    assert_same(whole / "trajectory.h5", cut / "trajectory.h5")


@pytest.mark.parametrize("fault", ["writes to its input", "writes to its loads"])
def test_a_solver_that_writes_to_what_it_is_given_changes_nothing_or_is_caught(
    fault, scene, mpad, tmp_path, monkeypatch
):
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    assert mpad("run", scene, "-o", whole)[0] == 0
    monkeypatch.setenv("FICKLE", fault)
    code, _, err = mpad("run", scene, "-o", cut, "--checkpoint-every", "0")
    if code == 0:
        assert_same(whole / "trajectory.h5", cut / "trajectory.h5")
    else:
        assert code == 70
        assert "fickle" in err


def test_a_solver_that_fails_from_the_start_says_so(scene, mpad, tmp_path, monkeypatch):
    monkeypatch.setenv("FICKLE", "raises")
    code, _, err = mpad("run", scene, "-o", tmp_path / "run", "--set", 'cells.a.x="10 um"')
    assert code == 70
    assert "before step one" in err
    assert "fickle" in err


OBSERVER = """\
import os
from typing import ClassVar
from attrs import frozen
from mpad_core import FieldDeclaration, hookimpl

@frozen(kw_only=True)
class Nosy:
    name: ClassVar[str] = "nosy"
    def fields(self, cells): return (FieldDeclaration(name="sum", unit="um"),)
    def see(self, frame):
        fault = os.environ.get("NOSY", "") if frame.time > 0.0025 else ""
        if fault == "raises": raise LookupError("lost its glasses")
        if fault == "too many": return (1.0, 2.0)
        if fault == "wrong shape": return ([1.0, 2.0],)
        if fault == "none": return None
        if fault == "writes": frame.centres[:] = 0.0
        return (float(frame.centres.sum()),)
    def close(self):
        if os.environ.get("NOSY") == "close raises": raise OSError("door jammed")

@hookimpl
def mpad_observers(): return [Nosy]
"""


@pytest.mark.parametrize("fault", ["raises", "too many", "wrong shape", "none"])
def test_a_failing_observer_is_named_and_the_run_goes_on(fault, scene, distribution, mpad, tmp_path, monkeypatch):
    distribution("mpad-nosy", ["observer.nosy"], OBSERVER)
    watched = ("--set", 'record.observers=["nosy"]')
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    assert mpad("run", scene, "-o", whole, *watched)[0] == 0
    monkeypatch.setenv("NOSY", fault)
    code, _, err = mpad("run", scene, "-o", cut, "--checkpoint-every", "0", *watched)
    assert code == 70, err
    assert "nosy" in err
    assert "before step one" not in err
    monkeypatch.delenv("NOSY")
    code, _, err = mpad("run", scene, "-o", cut, "--resume", *watched)
    assert code == 0, err
    assert_same(whole / "trajectory.h5", cut / "trajectory.h5")


def test_an_observer_that_fails_when_it_closes_loses_nothing(scene, distribution, mpad, tmp_path, monkeypatch):
    distribution("mpad-nosy", ["observer.nosy"], OBSERVER)
    monkeypatch.setenv("NOSY", "close raises")
    code, _, err = mpad("run", scene, "-o", tmp_path / "run", "--set", 'record.observers=["nosy"]')
    assert code == 70, err
    assert "nosy" in err
    monkeypatch.delenv("NOSY")
    code, _, err = mpad("run", scene, "-o", tmp_path / "run", "--resume", "--set", 'record.observers=["nosy"]')
    assert code == 0, err


def test_an_observer_that_writes_to_the_frame_changes_no_run(scene, distribution, mpad, tmp_path, monkeypatch):
    distribution("mpad-nosy", ["observer.nosy"], OBSERVER)
    watched = ("--set", 'record.observers=["nosy"]')
    assert mpad("run", scene, "-o", tmp_path / "whole", *watched)[0] == 0
    monkeypatch.setenv("NOSY", "writes")
    code, _, err = mpad("run", scene, "-o", tmp_path / "cut", *watched)
    whole, cut = (datasets(tmp_path / name / "trajectory.h5") for name in ("whole", "cut"))
    if code == 0:
        name = "mpad/positions"
        assert whole[name] == cut[name]
    else:
        assert "nosy" in err


LAWS = """\
from typing import ClassVar
import numpy as np
from attrs import frozen
from mpad_core import hookimpl, quantity

FAULT = "{fault}"

@frozen(kw_only=True)
class Odd:
    name: ClassVar[str] = "odd"
    stiffness: float
    rest_length: float
    def tension(self, length):
        if FAULT == "tension raises": raise ArithmeticError("too tense")
        if FAULT == "tension is nan": return np.full_like(length, np.nan)
        if FAULT == "tension of wrong shape": return np.ones(3)
        return self.stiffness * (length - self.rest_length)
    def off_rate(self, length):
        if FAULT == "off-rate below zero": return -np.ones_like(length)
        if FAULT == "off-rate infinite": return np.full_like(length, np.inf)
        return np.ones_like(length)
    def breakpoints(self):
        if FAULT == "breakpoint nan": return (np.nan,)
        if FAULT == "breakpoints none": return None
        return (self.rest_length,)

@frozen(kw_only=True)
class Push:
    name: ClassVar[str] = "odd"
    def force(self, gap):
        if FAULT == "force raises": raise ArithmeticError("too tense")
        if FAULT == "force is nan": return np.full_like(gap, np.nan)
        return 1.0 - gap
    def gaps(self):
        if FAULT == "gaps reversed": return (1.0, 0.01)
        if FAULT == "gaps nan": return (np.nan, 1.0)
        return (0.01, 1.0)

@frozen(kw_only=True)
class Bare:
    name: ClassVar[str] = "odd"
    def density(self, x, y):
        if FAULT == "density raises": raise ArithmeticError("too dense")
        if FAULT == "density nan": return np.full_like(x, np.nan)
        if FAULT == "density below zero": return np.full_like(x, -1.0)
        return np.full_like(x, 100.0)
    def densest(self):
        if FAULT == "densest raises": raise ArithmeticError("too dense")
        if FAULT == "densest nan": return np.nan
        return 100.0

@hookimpl
def mpad_bond_models(): return [Odd]
@hookimpl
def mpad_force_laws(): return [Push]
@hookimpl
def mpad_surfaces(): return [Bare]
"""
BINDING = """\
solver = "isolated"
stop = { time = "2 ms" }
fluid = { viscosity = "1 mPa s" }
flow = { kind = "shear", rate = "80 1/s" }
wall = { sites = { w = { layout = "odd" } } }
repulsion = { law = "odd" }
[kinds.bead]
radius = "1 um"
sites = { s = { density = "20 1/um^2" } }
[cells.a]
kind = "bead"
overlap = "-10 nm"
[bonds.b]
between = ["s", "w"]
model = "odd"
on_rate = { value = "10 1/s", at_density = "100 1/um^2" }
length = "30 nm"
stiffness = "10 pN/nm"
"""


def binding(fault, distribution, tmp_path):
    distribution("mpad-odd", ["bond.odd", "force.odd", "surface.odd"], LAWS.replace("{fault}", fault))
    path = tmp_path / "scene.toml"
    path.write_text(BINDING)
    return path


def test_the_strangers_laws_run_when_they_are_good(distribution, mpad, tmp_path):
    code, out, err = mpad("run", binding("", distribution, tmp_path), "-o", tmp_path / "run")
    assert code == 0, err
    assert "ended by time" in out


@pytest.mark.parametrize("fault", [
    "tension raises", "tension is nan", "tension of wrong shape", "off-rate below zero", "off-rate infinite",
    "breakpoint nan", "breakpoints none", "force raises", "force is nan", "gaps reversed", "gaps nan",
    "density raises", "density nan", "density below zero", "densest raises", "densest nan",
])  # fmt: skip
def test_a_failing_law_is_named(fault, distribution, mpad, tmp_path):
    scene = binding(fault, distribution, tmp_path)
    code, _, err = mpad("check", scene)
    assert code in (0, 70), err
    if code:
        assert "odd" in err
    code, _, err = mpad("run", scene, "-o", tmp_path / "run")
    said = [line for line in err.splitlines() if not line.startswith("{")]
    assert code == 70, err
    assert len(said) == 1
    assert "odd" in said[0]
