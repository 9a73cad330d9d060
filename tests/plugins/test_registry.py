"""Parts are found by name and loaded one at a time; every fault names the distribution it comes from."""

import json
import os
import subprocess
import sys

import pytest

from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.plugins.registry import KINDS, find, installed, load, nearest

BOND = '''\
"""A stranger's bond."""
from typing import ClassVar
import numpy as np
from attrs import frozen
from mpad_core import hookimpl

@frozen(kw_only=True)
class {name}:
    """A bond that {name} brings."""
    name: ClassVar[str] = "{part}"
    stiffness: float
    rest_length: float
    def tension(self, length): return self.stiffness * (length - self.rest_length)
    def off_rate(self, length): return np.ones_like(length)
    def breakpoints(self): return (self.rest_length,)

@hookimpl
def mpad_bond_models(): return [{name}]
'''
HOOK = "from mpad_core import hookimpl\n@hookimpl\n"
BROKEN = {
    "fails to import": ("raise RuntimeError('no such library: libfoo')", "RuntimeError: no such library: libfoo"),
    "has a syntax error": ("def (:", "SyntaxError"),
    "needs what is absent": ("import no_such_module_at_all", "no_such_module_at_all"),
    "leaves the process": ("import sys\nsys.exit(0)", "SystemExit"),
    "has no hook": ("x = 1", "gives 0 parts"),
    "has an empty hook": (HOOK + "def mpad_bond_models(): return []", "gives 0 parts"),
    "has a hook that gives None": (HOOK + "def mpad_bond_models(): pass", "0 parts"),
    "has a hook that gives a number": (
        HOOK + "def mpad_bond_models(): return 7", "not iterable"),
    "has a hook that raises": (
        HOOK + "def mpad_bond_models(): raise KeyError('gone')", "KeyError: 'gone'"),
    "has a misspelt hook": (
        HOOK + "def mpad_bond_model(): return []", "unknown hook"),
    "has a hook that wants arguments": (
        HOOK + "def mpad_bond_models(scene): return []", "scene"),
    "offers another name": (BOND.format(name="Other", part="other"), "gives 0 parts of that name"),
    "offers the name twice": (
        BOND.format(name="Odd", part="odd").replace("return [Odd]", "return [Odd, Odd]"), "gives 2 parts"),
    "lacks members": (
        BOND.format(name="Odd", part="odd").replace("def off_rate", "def of_rate").replace("def breakp", "def breqp"),
        "lacks off_rate, breakpoints"),
}  # fmt: skip
SCENE = """\
solver = "isolated"
stop = { time = "1 ms" }
fluid = { viscosity = "1 mPa s" }
wall = { sites = { w = { layout = "uniform", density = "1 1/um^2" } } }
[kinds.bead]
radius = "5 um"
sites = { s = { density = "1 1/um^2" } }
[cells.a]
kind = "bead"
height = "6 um"
[bonds.b]
between = ["s", "w"]
model = "odd"
on_rate = { value = "1 1/s", at_density = "1 1/um^2" }
length = "30 nm"
stiffness = "1 pN/nm"
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


def test_names_are_listed_without_importing_any_part(distribution):
    distribution("mpad-bomb", ["bond.bomb", "solver.bomb"], "raise RuntimeError('was imported')")
    code = (
        "import sys, json; from mpad_core.plugins.registry import installed;"
        "names = [(p.kind, p.name, p.distribution, p.version) for p in installed()];"
        "print(json.dumps([names, sorted(sys.modules)]))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    names, modules = json.loads(found.stdout)
    assert ["bond", "bomb", "mpad-bomb", "1.0"] in names
    assert ["solver", "rpb", "mpad-rpb", "0.1.0"] in names
    assert not {m for m in modules if m.partition(".")[0] in {"mpad_bomb", "mpad_rpb", "mpad_bell", "numba", "scipy"}}


def test_own_parts_all_load():
    parts = installed()
    assert {part.kind for part in parts} <= set(KINDS)
    for part in parts:
        loaded = load(part.kind, part.name)
        assert loaded.name == part.name


def test_only_the_part_named_is_imported(distribution):
    distribution("mpad-bomb", ["bond.bomb"], "raise RuntimeError('was imported')")
    assert load("bond", "bell").name == "bell"
    assert "mpad_bomb" not in sys.modules


def test_two_distributions_with_one_name(distribution, mpad, scene):
    distribution("mpad-first", ["bond.odd"], BOND.format(name="Odd", part="odd"))
    distribution("mpad-second", ["bond.odd"], BOND.format(name="Odd", part="odd"), version="2.5")
    with pytest.raises(InputError, match=r"mpad-first 1\.0 and mpad-second 2\.5; uninstall one"):
        load("bond", "odd")
    code, _, err = mpad("check", scene)
    assert code == 2
    assert err.startswith(f"{scene}:")
    assert "bonds.b.model" in err
    assert "mpad-second 2.5" in err
    code, out, _ = mpad("parts")
    assert code == 0
    assert out.count("BROKEN") == 2
    assert "bell" in out


def test_an_outsiders_part_works(distribution, mpad, scene):
    distribution("mpad-odd", ["bond.odd"], BOND.format(name="Odd", part="odd"))
    code, out, err = mpad("check", scene)
    assert (code, err) == (0, "")
    assert "odd (mpad-odd 1.0)" in out


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_part_names_its_distribution(what, distribution, mpad, scene):
    source, said = BROKEN[what]
    distribution("mpad-odd", ["bond.odd"], source)
    with pytest.raises(PartError, match=r"of mpad-odd 1\.0") as refused:
        load("bond", "odd")
    assert said in str(refused.value)
    code, _, err = mpad("check", scene)
    assert code == 70
    assert "mpad-odd 1.0" in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("what", BROKEN)
def test_the_listing_survives_a_broken_part_and_shows_it(what, distribution, mpad):
    source, _ = BROKEN[what]
    distribution("mpad-odd", ["bond.odd"], source)
    code, out, _ = mpad("parts")
    assert code == 0
    assert any("odd  (mpad-odd 1.0)  BROKEN" in line for line in out.splitlines())
    assert "rpb" in out
    assert "electrostatic" in out


@pytest.mark.parametrize("value", ["", ":", "a b c", "mpad_odd:no_such_thing", "no_such_module"])
def test_a_malformed_entry_point_harms_nobody_else(value, distribution, mpad, tmp_path):
    distribution("mpad-odd", ["bond.odd"], "x = 1", value=value or " ")
    code, out, _ = mpad("parts")
    assert code == 0
    assert "rpb" in out
    code = "import mpad_core.numerics.compiled"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_an_entry_point_of_an_unknown_kind_is_passed_over(distribution, mpad):
    distribution("mpad-odd", ["wobble.odd", "odd"], "raise RuntimeError('was imported')")
    code, out, _ = mpad("parts")
    assert code == 0
    assert "wobble" not in out
    assert "mpad_odd" not in sys.modules


@pytest.mark.parametrize(("kind", "name", "hint"), [("bond", "bel", "bell"), ("solver", "rbp", "rpb"),
                                                    ("surface", "unifrom", "uniform")])  # fmt: skip
def test_an_unknown_name_gets_the_nearest_hint(kind, name, hint):
    with pytest.raises(InputError, match=f"no {kind} '{name}' is installed; did you mean '{hint}'"):
        find(kind, name)


def test_an_unknown_name_with_nothing_near_gets_the_list():
    with pytest.raises(InputError, match=r"no solver 'zzz' is installed \(installed: .*rpb"):
        find("solver", "zzz")
    assert nearest("zzz", ["rpb"]) == ""


def test_no_part_of_a_kind():
    with pytest.raises(InputError, match="is installed"):
        find("observer", "zzz")


def test_a_part_that_is_no_attrs_class(distribution, mpad, scene):
    source = BOND.format(name="Odd", part="odd").replace("@frozen(kw_only=True)\n", "")
    distribution("mpad-odd", ["bond.odd"], source)
    code, _, err = mpad("check", scene)
    assert code == 70
    assert "attrs" in err
    code, out, _ = mpad("parts")
    assert code == 0
    assert "odd" in out


def test_the_last_of_a_distributions_files_may_lack_a_version(distribution, mpad, tmp_path):
    distribution("mpad-odd", ["bond.odd"], BOND.format(name="Odd", part="odd"))
    (tmp_path / "site" / "mpad_odd-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\n")
    code, out, _ = mpad("parts")
    assert code == 0
    assert "bell" in out


COMMAND = """\
import click
from mpad_core import hookimpl

@click.command()
def greet():
    "Greet."
    click.echo("good day")

@hookimpl
def mpad_commands(): return [greet]
"""


def test_a_plugins_command_runs(distribution, mpad):
    distribution("mpad-greet", ["command.greet"], COMMAND)
    assert mpad("greet") == (0, "good day\n", "")
    code, out, _ = mpad("--help")
    assert code == 0
    assert "Greet." in out


@pytest.mark.parametrize("source", ["raise RuntimeError('broken')", "x = 1"])
def test_a_broken_command_leaves_the_others_alone(source, distribution, mpad):
    distribution("mpad-odd", ["command.odd"], source)
    assert mpad("parts")[0] == 0
    code, _, err = mpad("odd")
    assert code == 70
    assert "mpad-odd 1.0" in err
    code, out, _ = mpad("--help")
    assert code == 0
    assert "run" in out


def test_a_plugin_cannot_take_the_place_of_our_commands(distribution, mpad):
    distribution("mpad-odd", ["command.parts"], COMMAND.replace("greet", "parts"))
    code, out, _ = mpad("parts")
    assert code == 0
    assert "good day" not in out


def test_a_command_that_fails_is_one_line(distribution, tmp_path):
    distribution("mpad-greet", ["command.greet"], COMMAND.replace('click.echo("good day")', "raise KeyError('gone')"))
    done = subprocess.run(
        [sys.executable, "-m", "mpad_core", "greet"], capture_output=True, text=True, check=False, env=dict(os.environ)
    )
    assert done.returncode == 70, done.stderr
    assert "Traceback" not in done.stderr
