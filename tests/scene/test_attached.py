"""Files that a scene's parts are given: found beside the scene, known by their sums, kept in the run directory."""

import hashlib
from pathlib import Path
from typing import Any, ClassVar

import attrs
import pytest
from attrs import frozen

from mpad_core.interfaces.errors import InputError
from mpad_core.scene.attached import files_of
from mpad_core.scene.files import load_scene, parse_scene, resolved_toml

RAW = b"any bytes"


@frozen(kw_only=True)
class Filed:
    """A part that is given a file, as a stranger may write one."""

    name: ClassVar[str] = "filed"
    table: str = attrs.field(metadata={"file": "digest"})
    digest: str | None = attrs.field(default=None)

    @digest.validator
    def _same(self, attribute: object, value: str | None) -> None:
        if value == "0" * 64:
            raise ValueError("another file")


@pytest.fixture
def folder(tmp_path: Path, fake_parts: dict[tuple[str, str], Any], small: str) -> Path:
    """A folder with a scene and its file."""
    for kind in ("solver", "force", "observer", "surface"):
        fake_parts[kind, "filed"] = Filed
    (tmp_path / "table.csv").write_bytes(RAW)
    (tmp_path / "s.toml").write_text('repulsion = { law = "filed", table = "table.csv" }\n' + small)
    return tmp_path


def test_a_file_lies_beside_the_scene_wherever_it_is_read_from(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "elsewhere").mkdir()
    monkeypatch.chdir(folder / "elsewhere")
    for path in (folder / "s.toml", Path("../s.toml")):
        part = load_scene(path).repulsion
        assert part is not None
        assert Path(part.parameters["table"]).samefile(folder / "table.csv")
        assert Path(part.parameters["table"]).is_absolute()
        assert part.parameters["digest"] == hashlib.sha256(RAW).hexdigest()


def test_the_resolved_scene_names_the_copy_and_its_bytes(folder: Path) -> None:
    digest = hashlib.sha256(RAW).hexdigest()
    scene = load_scene(folder / "s.toml")
    text = resolved_toml(scene)
    assert f'table = "files/{digest[:12]}-table.csv"' in text
    assert digest in text
    (file,) = files_of(scene)
    assert (file.path, file.kept_as) == (folder / "table.csv", f"files/{digest[:12]}-table.csv")
    (folder / "files").mkdir()
    (folder / "table.csv").rename(folder / file.kept_as)
    again = parse_scene(text, folder=folder)
    assert resolved_toml(again) == text
    assert [copy.path for copy in files_of(again)] == [folder / file.kept_as]


def test_a_changed_file_makes_another_scene(folder: Path) -> None:
    text = resolved_toml(load_scene(folder / "s.toml"))
    (folder / "table.csv").write_bytes(RAW + b"!")
    assert resolved_toml(load_scene(folder / "s.toml")) != text  # so --resume refuses it


def test_a_files_part_refuses_at_its_line(folder: Path) -> None:
    path = folder / "s.toml"
    path.write_text(path.read_text().replace('"table.csv"', f'"table.csv", digest = "{"0" * 64}"'))
    with pytest.raises(InputError) as caught:
        load_scene(path)
    assert caught.value.lines == (f"{path}:1: repulsion.digest: 'filed' refuses: another file",)


def test_in_every_place_of_a_part(folder: Path) -> None:
    text = (folder / "s.toml").read_text().replace('solver = "isolated"', 'solver = { name = "filed", table = "a" }')
    text = text.replace("[kinds.bead]", 'wall.sites.p = { layout = "filed", table = "table.csv" }\n[kinds.bead]')
    text = text.replace('height = "0 um"', 'height = "9 um"')
    text += '[record]\nobservers = ["watcher", { name = "filed", table = "/table.csv" }]'
    scene = parse_scene(text, folder=folder)
    assert scene.solver.parameters == {"table": str(folder / "a")}  # there is no such file, as the part may say
    assert scene.wall is not None
    assert scene.wall.sites["p"].parameters["digest"] == hashlib.sha256(RAW).hexdigest()
    assert scene.record.observers[1].parameters["table"] == "/table.csv"
    assert [file.path.name for file in files_of(scene)] == ["table.csv"] * 2  # of the wall and of the repulsion


@pytest.mark.parametrize(
    "wrong", ["wall = 3", "wall.sites = 3", "bonds = [1]", "record.observers = [[]]", "record = 1"]
)
def test_tables_that_are_none_are_left_to_their_own_fault(folder: Path, wrong: str) -> None:
    with pytest.raises(InputError):
        parse_scene(f"{wrong}\n" + (folder / "s.toml").read_text(), folder=folder)


def test_devices_are_not_read(folder: Path) -> None:
    path = folder / "s.toml"
    path.write_text(path.read_text().replace('"table.csv"', '"/dev/zero"'))
    part = load_scene(path).repulsion
    assert part is not None
    assert "digest" not in part.parameters
