"""A run whose wall is a picture: the run directory has all that it needs."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from matplotlib import image

from mpad_core import load_scene, run
from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.scene.spec import Scene
from recorded import datasets

pytestmark = pytest.mark.slow

UNIFORM = 'layout = "uniform", density = "180 1/um^2"'
MASK = 'layout = "pattern", kind = "mask", high = "180 1/um^2", image = "grey.png", pixel = "2 um", outside = "repeat"'
QUICK = ('stop.time="2 ms"', 'cells.roller.start.rolling_alone="0 ms"', "passage.control=false", "passage.seeds=1")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    text = (Path(__file__).parents[2] / "examples" / "capture.toml").read_text(encoding="utf-8")
    text, _, _ = text.partition("[provenance]")  # which names a value that patterns do not have
    assert UNIFORM in text
    home = tmp_path / "home"
    home.mkdir()
    (home / "s.toml").write_text(text.replace(UNIFORM, MASK), encoding="utf-8")
    image.imsave(home / "grey.png", np.arange(12.0).reshape(3, 4), cmap="gray")
    return home


def quick(path: Path) -> Scene:
    return load_scene(path, QUICK)


def test_a_run_directory_needs_no_other_file(folder: Path, tmp_path: Path) -> None:
    run(quick(folder / "s.toml"), folder / "run")
    (folder / "grey.png").unlink()
    moved = folder.rename(tmp_path / "moved")
    run(load_scene(moved / "run" / "scene.toml"), moved / "run", resume=True)
    run(load_scene(moved / "run" / "scene.toml"), moved / "again")
    one, other = (datasets(moved / name / "trajectory.h5") for name in ("run", "again"))
    assert one == other
    assert (moved / "run" / "scene.toml").read_bytes() == (moved / "again" / "scene.toml").read_bytes()


def test_it_is_resumed_with_the_same_picture_only(folder: Path, tmp_path: Path) -> None:
    run(quick(folder / "s.toml"), tmp_path / "run")
    shutil.copytree(folder, tmp_path / "elsewhere")
    run(quick(tmp_path / "elsewhere" / "s.toml"), tmp_path / "run", resume=True)
    image.imsave(folder / "grey.png", np.eye(3), cmap="gray")
    with pytest.raises(InputError, match="is of another scene or of other settings"):
        run(quick(folder / "s.toml"), tmp_path / "run", resume=True)


def test_a_picture_that_changes_between_reading_and_running_is_refused(folder: Path, tmp_path: Path) -> None:
    scene = quick(folder / "s.toml")
    image.imsave(folder / "grey.png", np.eye(3), cmap="gray")
    with pytest.raises(PartError, match=r"surface 'pattern' failed: .* is not the one that this scene was made with"):
        run(scene, tmp_path / "run")
