"""The surface `pattern` in a scene: read, written, refused at its line."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from matplotlib import image

from mpad_core.interfaces.errors import InputError
from mpad_core.scene.attached import files_of
from mpad_core.scene.compose import compose
from mpad_core.scene.files import load_scene, parse_scene, resolved_toml
from mpad_core.scene.spec import Scene

UNIFORM = 'p-selectin = { layout = "uniform", density = "180 1/um^2" }'
MASK = 'kind = "mask", high = "180 1/um^2", image = "grey.png", pixel = "2 um", origin = ["-5 um", "1 nm"]'
SAID = [
    'kind = "stripes", high = "180 1/um^2", low = "9 1/um^2", period = "20 um", angle = "90 deg", duty = 0.2',
    'kind = "checkerboard", high = "180 1/um^2", period = "20 um"',
    'kind = "gradient", high = "180 1/um^2", start = "-1 mm", end = "1 mm", angle = "0.5 rad"',
    MASK + ', outside = "repeat"',
]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    image.imsave(tmp_path / "grey.png", np.arange(12.0).reshape(3, 4), cmap="gray")
    return tmp_path


def patterned(examples: dict[str, str], said: str) -> str:
    scene, _, _ = examples["capture"].partition("[provenance]")  # which names a value that patterns do not have
    assert UNIFORM in scene
    return scene.replace(UNIFORM, f'p-selectin = {{ layout = "pattern", {said} }}')


@pytest.mark.parametrize("said", SAID)
def test_a_pattern_is_read_and_written_the_same(examples: dict[str, str], folder: Path, said: str) -> None:
    (folder / "s.toml").write_text(patterned(examples, said))
    scene = load_scene(folder / "s.toml")
    text = resolved_toml(scene)
    again = parse_scene(text, folder=with_copies(scene, folder))
    assert resolved_toml(again) == text
    x, y = np.random.default_rng(1).uniform(-9, 9, (2, 50))
    surfaces = [compose(one).species[0].surface for one in (scene, again)]
    assert (surfaces[0].density(x, y) == surfaces[1].density(x, y)).all()


def with_copies(scene: Scene, folder: Path) -> Path:
    """Put copies of a scene's files where its resolved form looks for them."""
    for file in files_of(scene):
        (folder / file.kept_as).parent.mkdir(exist_ok=True)
        shutil.copy(file.path, folder / file.kept_as)
    return folder


def test_a_resolved_scene_with_another_picture_is_refused(examples: dict[str, str], folder: Path) -> None:
    (folder / "s.toml").write_text(patterned(examples, MASK))
    scene = load_scene(folder / "s.toml")
    text = resolved_toml(scene)
    with_copies(scene, folder)
    image.imsave(folder / files_of(scene)[0].kept_as, np.eye(4), cmap="gray", format="png")
    with pytest.raises(InputError, match=r"'pattern' refuses: image '.*' is not the one that this scene was made with"):
        parse_scene(text, folder=folder)


FAULTS = [
    ('kind = "stripes", high = "1 1/um^2"', ".*: 'pattern' refuses: period is missing; kind 'stripes' needs it"),
    (MASK.replace("grey", "gray"), ".*: 'pattern' refuses: image '.*gray.png' cannot be read: there is no such file"),
    (MASK + ", period = '1 um'", ".*: 'pattern' refuses: period is unknown to kind 'mask'"),
    (SAID[1].replace("checkerboard", "chess"), ".kind: must be one of 'stripes', 'checkerboard', 'gradient', 'mask'"),
    (SAID[1] + ", angle = '3 um'", ".angle: '3 um' has the wrong dimension"),
]


@pytest.mark.parametrize(("said", "expected"), FAULTS)
def test_faults_have_their_line(examples: dict[str, str], folder: Path, said: str, expected: str) -> None:
    text = patterned(examples, said)
    line = next(number for number, one in enumerate(text.split("\n"), 1) if "p-selectin = {" in one)
    with pytest.raises(InputError, match=rf"s\.toml:{line}: wall.sites.p-selectin{expected}"):
        parse_scene(text, "s.toml", folder=folder)
