"""Scenes are read with defaults and inner units, refused line by line, and written so that they read the same."""

import subprocess
import sys
from pathlib import Path

import pytest
import tomli_w

from mpad_core.interfaces.errors import InputError
from mpad_core.scene.files import load_scene, parse_scene, resolved_toml
from mpad_core.scene.spec import CellSites, Condition, Flow, Passage

pytestmark = pytest.mark.usefixtures("fake_parts")


def refused(text: str, *overrides: str) -> tuple[str, ...]:
    with pytest.raises(InputError) as caught:
        parse_scene(text, "s.toml", overrides)
    assert str(caught.value) == "\n".join(caught.value.lines)
    return caught.value.lines


def test_the_base_case_in_inner_units(examples: dict[str, str]) -> None:
    scene = parse_scene(examples["recruitment"])
    assert scene.fluid.viscosity == 1e-3
    assert scene.fluid.density == 1e-9
    assert scene.gravity.acceleration == (0, 0, -9.81e6)
    assert scene.flow == Flow(kind="shear", rate=80)
    assert scene.kinds["bead"].density == 1.05e-9
    assert scene.kinds["bead"].sites == {"slex": CellSites(density=90)}
    assert scene.bonds["tether"].stiffness == 1e5
    assert scene.bonds["tether"].model.parameters == {"off_rate": 2.0, "reactive_compliance": 4e-5}
    assert scene.stop.when == (Condition(cell="free", quantity="dx", value=60),)
    assert scene.accuracy.position == 1e-4
    assert scene.passage == Passage(cell="free", past=("roller",), also_on_rates=(8.4, 0.84, 0.1))
    assert scene.cells["roller"].start.rolling_alone == 1
    assert not scene.cells["free"].binds


def test_capture_lets_both_cells_bind(examples: dict[str, str]) -> None:
    scene = parse_scene(examples["capture"])
    assert [cell.binds for cell in scene.cells.values()] == [True, True]
    assert scene.passage is not None
    assert scene.passage.seeds == 4
    assert [str(condition) for condition in scene.stop.when] == ["free.caught", "free.dx > 60.0 um"]


def test_heights_from_height_or_overlap(examples: dict[str, str]) -> None:
    scene = parse_scene(examples["recruitment"], overrides=['cells.free.overlap="-20 nm"'])
    assert scene.height_of("roller") == 5.235
    assert scene.height_of("free") == pytest.approx(5 + 0.175 + 0.05 + 0.03 - 0.02, abs=1e-12)
    assert scene.height_of(scene.cells["free"]) == scene.height_of("free")
    assert scene.partner_of("free") == "roller"
    assert scene.partner_of("roller") == "free"


def test_what_is_left_out_is_absent(small: str) -> None:
    scene = parse_scene(small)
    assert scene.wall is None
    assert scene.flow == Flow(kind="none", rate=0)
    assert scene.gravity.acceleration == (0, 0, 0)
    assert not scene.bonds
    assert scene.repulsion is None
    assert scene.kinds["bead"].density == scene.fluid.density == 1e-9
    assert scene.fluid.temperature == 298
    assert scene.record.every.time == 0.01
    assert scene.partner_of("a") is None


def test_a_kind_floats_in_its_fluid_unless_it_says_so(small: str) -> None:
    heavier = small.replace('viscosity = "1 mPa s"', 'viscosity = "1 mPa s", density = "1.2 g/cm^3"')
    assert parse_scene(heavier).kinds["bead"].density == 1.2e-9


@pytest.mark.parametrize("name", ["recruitment", "capture"])
def test_resolved_scenes_read_the_same(name: str, examples: dict[str, str]) -> None:
    scene = parse_scene(examples[name])
    text = resolved_toml(scene)
    assert parse_scene(text) == scene
    assert resolved_toml(parse_scene(text)) == text


def test_resolved_scenes_keep_every_digit(examples: dict[str, str]) -> None:
    scene = parse_scene(examples["capture"], overrides=['cells.free.y="0.30000000000000004 um"', "accuracy.rate=0.1"])
    assert scene.cells["free"].y == 0.30000000000000004
    assert parse_scene(resolved_toml(scene)) == scene


def test_resolved_scenes_hold_the_defaults(small: str) -> None:
    text = resolved_toml(parse_scene(small))
    for line in ('temperature = "298.0 K"', 'coupling = "auto"', 'position = "0.0001 um"', 'time = "0.01 s"'):
        assert line in text
    assert parse_scene(text) == parse_scene(small)


def test_groups_read(small: str) -> None:
    scene = parse_scene(
        small
        + '[groups.crowd]\nkind = "bead"\nnumber = 10\nx = ["0 um", "1 mm"]\ny = ["-5 um", "5 um"]\nheight = "9 um"'
    )
    assert scene.groups["crowd"].x == (0, 1000)
    assert scene.height_of("crowd") == 9


FAULTS = [
    ("seed = true", "s.toml:1: seed: must be a whole number, not true"),
    ("seed = -1", "s.toml:1: seed: must be at least 0"),
    ("seed = 1.0", "s.toml:1: seed: must be a whole number, not 1.0"),
    ("title = 7", "s.toml:1: title: must be text in quotes, not 7"),
    ("titel = 'x'", "s.toml:1: titel: unknown key; did you mean 'title'?"),
    ("accuracy = { rate = inf }", "s.toml:1: accuracy.rate: must be a finite number, not inf"),
    ("accuracy = { rate = nan }", "s.toml:1: accuracy.rate: must be a finite number, not nan"),
    ("accuracy = { rate = '1e-3' }", "s.toml:1: accuracy.rate: must be a number without units, not '1e-3'"),
    ("accuracy = { rate = 0 }", "s.toml:1: accuracy.rate: must be above 0 and at most 1, not 0"),
    ("accuracy = { position = 0.1 }", 's.toml:1: accuracy.position: must be a quantity with units, such as "2 um"'),
    ("accuracy = { position = '0.1 s' }", "s.toml:1: accuracy.position: '0.1 s' has the wrong dimension"),
    ("accuracy = { position = '1e999 um' }", "s.toml:1: accuracy.position: must be a finite number, not '1e999 um'"),
    ("accuracy = 'high'", "s.toml:1: accuracy: must be a table, not 'high'"),
    ("effects = { thermal = true }", "s.toml:1: effects.thermal: must be one of 'auto', 'on', 'off', not true"),
    (
        "effects = { thermal = 'of' }",
        "s.toml:1: effects.thermal: must be one of 'auto', 'on', 'off', not 'of'; did you",
    ),
    ("gravity = { acceleration = ['0 m/s^2'] }", "s.toml:1: gravity.acceleration: must be a list of 3, not of 1"),
    (
        "gravity = { acceleration = ['0 m/s^2', 3, '0 m'] }",
        's.toml:1: gravity.acceleration[1]: must be a quantity with units, such as "2 um/s^2", not 3',
    ),
    ("gravity = { acceleration = '9 m/s^2' }", "s.toml:1: gravity.acceleration: must be a list in brackets"),
    ("record = { what = ['overlap', 'bond'] }", "s.toml:1: record.what[1]: must be one of 'overlap', 'velocity'"),
    ("flow = { rate = '80 1/s' }", 's.toml:1: flow.rate: a flow of kind "none" has no rate; write kind'),
    ("flow = { kind = 'shear' }", 's.toml:1: flow.rate: missing (shear rate); write rate = "80 1/s"'),
    ("[cells.'a b']", 's.toml:9: cells."a b": a name has only letters, digits, - and _'),
    ("passage = { cell = 'b', past = 'a' }", "s.toml:1: passage.cell: no cell 'b' in this scene (there are: a)"),
    ("passage = { cell = 'a', past = 'a' }", "s.toml:1: passage.past[0]: cell 'a' cannot pass itself"),
    ("passage = { cell = 'a', past = [] }", "s.toml:1: passage.past: names no cell"),
    ("[wall]\nroughness = '-1 nm'", "s.toml:10: wall.roughness: must be at least 0 and at most 100 um, not -0.001 um"),
]


@pytest.mark.parametrize(("said", "line"), FAULTS)
def test_each_fault_has_its_line(said: str, line: str, small: str) -> None:
    lines = refused(f"{small}{said}\n" if said.startswith("[") else f"{said}\n{small}")
    assert any(found.startswith(line) for found in lines), lines


def test_all_faults_at_once_sorted_by_line(small: str) -> None:
    text = small.replace('"5 um"', '"5 kg"').replace('"isolated"', '"isolatd"').replace('kind = "bead"', 'kind = "bed"')
    lines = refused(text.replace("height", "hight"))
    assert [line.split(": ")[:2] for line in lines] == [
        ["s.toml:1", "solver"],
        ["s.toml:5", "kinds.bead.radius"],
        ["s.toml:6", "cells.a"],
        ["s.toml:7", "cells.a.kind"],
        ["s.toml:8", "cells.a.hight"],
    ]
    assert lines[0].endswith("did you mean 'isolated'?")


def test_what_is_missing_is_named_with_an_example(small: str) -> None:
    assert refused("") == tuple(
        f"s.toml:1: {rest}"
        for rest in (
            "solver: missing (the mobility solver)",
            "stop: missing (when the run ends)",
            "fluid: missing (the fluid)",
            "kinds: missing (kinds of cells, by name)",
            "cells: there is no cell; add a table such as [cells.free] with kind and height",
        )
    )
    assert refused(small.replace('radius = "5 um"', "")) == (
        's.toml:4: kinds.bead.radius: missing (radius of the smooth sphere); write radius = "2 um"',
    )


def test_a_fluid_density_gone_wrong_is_told_once(small: str) -> None:
    assert len(refused(small.replace('viscosity = "1 mPa s"', 'viscosity = "1 mPa s", density = 3'))) == 1


def test_many_faults_are_cut_off() -> None:
    lines = refused("".join(f"key{number} = 1\n" for number in range(1000)))
    assert len(lines) == 51
    assert lines[-1] == "s.toml: and more"


SYNTAX = [
    ("a = \n", "s.toml:1: not TOML: Invalid value in column 5; check quotes"),
    ("a = 1\na = 2\n", "s.toml:2: not TOML: Cannot overwrite a value"),
    ("a = 1\n\nb = [1,", "s.toml:3: not TOML: "),
    ("a = 1\n" + "b." * 300 + "c = 1", "s.toml:2: nested deeper than 32"),
    ("a = " + "[" * 100, "s.toml:1: nested deeper than 32"),
    ("a" * 300 + " = 1", "s.toml:1: a key or number has more than 200 characters"),
    ("#" * 1_000_001, "s.toml: is larger than 1 MB"),
]


@pytest.mark.parametrize(("text", "line"), SYNTAX)
def test_syntax_has_its_line(text: str, line: str) -> None:
    (found,) = refused(text)
    assert found.startswith(line)


def test_keys_with_control_characters_stay_on_one_line() -> None:
    assert all(line.isprintable() for line in refused('"a\\nb\\u202e" = 1\n[cells."\\u0007"]\nkind = "\\r\\n"'))


def test_files_that_cannot_be_read(tmp_path: Path, small: str) -> None:
    path = tmp_path / "scene.toml"
    cases = {
        str(tmp_path / "none.toml"): "cannot be read: No such file or directory; name a scene file",
        str(tmp_path): "cannot be read: Is a directory; name a scene file",
        "nul\0byte": "cannot be read: embedded null byte; name a scene file",
        str(path): "is larger than 1 MB",
    }
    path.write_bytes(b"#" * 2_000_000)
    for name, message in cases.items():
        with pytest.raises(InputError, match=message):
            load_scene(name)
    path.write_bytes(small.encode() + b"\n# \xff")
    with pytest.raises(InputError) as caught:
        load_scene(path)
    assert caught.value.lines == (f"{path}:10: byte 0xff is not UTF-8; save the file as UTF-8",)


def test_a_byte_order_mark_and_windows_line_ends_are_fine(tmp_path: Path, small: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\xef\xbb\xbf" + small.replace("\n", "\r\n").encode())
    assert load_scene(path) == parse_scene(small)


def test_overrides_take_the_files_place(small: str) -> None:
    scene = parse_scene(small, overrides=['cells.a.x="7.5 um"', 'cells.b={kind="bead", height="20 um"}', "seed=4"])
    assert scene.cells["a"].x == 7.5
    assert list(scene.cells) == ["a", "b"]
    assert scene.seed == 4


OVERRIDES = [
    ("cells.a.x=7.5 um", "--set: cells.a.x: 'cells.a.x=7.5 um' cannot be read; write a path and a TOML value"),
    ("cells.a.x", "--set: cells.a.x: 'cells.a.x' cannot be read"),
    ("", "--set: '': no path is given"),
    ("a=1\nb=2", "--set: a: has more than one line"),
    ("a" * 300 + "=1", "--set: aaaaa"),
    ("solver.name.x=1", "--set: solver.name.x: solver is no table; set the whole of it"),
    ('cells.a.x="7.5 s"', "--set: cells.a.x: '7.5 s' has the wrong dimension"),
    ("cells.a.z=1", "--set: cells.a.z: unknown key"),
    ('cells.b.x="1 um"', "--set: cells.b: height or overlap is missing"),
    ('cells.a.overlap="0 um"', "--set: cells.a.overlap: needs a wall; give height instead"),
]


@pytest.mark.parametrize(("override", "line"), OVERRIDES)
def test_overrides_are_named_in_errors(override: str, line: str, small: str) -> None:
    lines = refused(small, override)
    assert any(found.startswith(line) for found in lines), lines


QUIET = """
import sys
from mpad_core.plugins import registry
from attrs import frozen
Lone = frozen(type("Lone", (), {"name": "lone"}))
registry.load = lambda kind, name: Lone
from mpad_core.scene.files import parse_scene, resolved_toml
assert "pint" not in sys.modules, "pint at import"
assert "scipy" not in sys.modules, "scipy at import"
scene = parse_scene(sys.argv[1])
again = parse_scene(resolved_toml(scene))
assert again == scene
names = {name.split(".")[1] for name in sys.modules if name.startswith("scipy.")}
heavy = names & {"linalg", "sparse", "special", "integrate", "interpolate", "optimize", "spatial"}
assert not heavy, heavy  # pint itself imports the bare package scipy, a few milliseconds
assert "numba" not in sys.modules
"""


def test_reading_imports_nothing_heavy(small: str) -> None:
    done = subprocess.run([sys.executable, "-c", QUIET, small], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_inner_units_need_no_pint(small: str) -> None:
    text = resolved_toml(parse_scene(small))
    code = QUIET + "\nassert 'pint' not in sys.modules, 'pint for inner units'"
    done = subprocess.run([sys.executable, "-c", code, text], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_resolved_text_escapes_what_toml_must(small: str) -> None:
    title = 'a "quoted"\n\\title\u0007'
    scene = parse_scene(small, overrides=[tomli_w.dumps({"title": title}).strip()])
    assert scene.title == title
    assert parse_scene(resolved_toml(scene)) == scene
