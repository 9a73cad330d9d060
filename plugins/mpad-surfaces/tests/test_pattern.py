"""The surface `pattern`: its four laws at known places, contracts, and what it refuses."""

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from mpad_core.plugins.registry import load
from mpad_core.testing import SurfaceContract
from mpad_surfaces.pattern import Pattern

STRIPES: dict[str, Any] = {"kind": "stripes", "high": 180.0, "low": 20.1, "period": 10.0}
BOARD: dict[str, Any] = {"kind": "checkerboard", "high": 180.0, "period": 4.0}
GRADIENT: dict[str, Any] = {"kind": "gradient", "high": 180.3, "low": 0.1, "start": -50.0, "end": 150.0}


class TestStripes(SurfaceContract):
    surface = Pattern(**STRIPES, duty=0.3, angle=17.0, offset=3.3)


class TestInvertedStripes(SurfaceContract):
    surface = Pattern(kind="stripes", high=0.0, low=180.0, period=0.7)


class TestCheckerboard(SurfaceContract):
    surface = Pattern(**BOARD, angle=30.0)


class TestGradient(SurfaceContract):
    surface = Pattern(**GRADIENT, angle=-72.0)


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    """Three columns and two rows: black, grey, white above; white, black, black below."""
    path = tmp_path / "mask.png"
    Image.fromarray(np.array([[0, 51, 255], [255, 0, 0]], np.uint8)).save(path)
    return path


class TestMask(SurfaceContract):
    @pytest.fixture(autouse=True, params=["low", "repeat"])
    def _surface(self, request: Any, picture: Path) -> None:
        self.surface = Pattern(
            kind="mask", high=180.3, low=0.1, image=str(picture), pixel=7.0, origin=(3.0, -9.0), outside=request.param
        )


def at(surface: Any, *places: tuple[float, float]) -> list[float]:
    x, y = np.array(places).T
    found: list[float] = surface.density(x, y).tolist()
    return found


def test_comes_in_by_the_front_door() -> None:
    assert load("surface", "pattern") is Pattern


def test_stripes_across_the_flow() -> None:
    surface = Pattern(**STRIPES, duty=0.3, offset=1.0)
    places = [(1.0, 5.0), (3.999, -7.0), (4.001, 0.0), (10.999, 3.0), (11.0, 3.0), (-5.0, 0.0), (-8.9, 0.0)]
    assert at(surface, *places) == [180, 180, 20.1, 20.1, 180, 20.1, 180]


def test_stripes_along_the_flow_and_tilted() -> None:
    along = Pattern(**STRIPES, angle=90.0)
    assert at(along, (1234.5, 4.9), (-77.0, 5.1), (0.3, -0.1)) == [180, 20.1, 20.1]
    tilted = Pattern(**STRIPES, angle=30.0)
    forward = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])
    assert at(tilted, tuple(4.9 * forward), tuple(5.1 * forward), tuple(-0.1 * forward)) == [180, 20.1, 20.1]


def test_share_of_a_tilted_pattern_is_its_duty() -> None:
    """Over many periods, at 1e6 random places: five standard deviations of a binomial, passed once in 2e6 seeds."""
    x, y = np.random.default_rng(1).uniform(-1e4, 1e4, (2, 1_000_000))
    for surface, share in ((TestStripes.surface, 0.3), (TestCheckerboard.surface, 0.5)):
        dense = (surface.density(x, y) == 180).mean()
        assert abs(dense - share) < 5 * np.sqrt(share * (1 - share) / 1e6)


def test_checkerboard() -> None:
    surface = Pattern(**BOARD)
    places = [(1.0, 1.0), (3.0, 1.0), (1.0, 3.0), (3.0, 3.0), (-1.0, 1.0), (-1.0, -1.0)]
    assert at(surface, *places) == [180, 0, 0, 180, 0, 180]


def test_gradient() -> None:
    surface = Pattern(**GRADIENT)
    assert at(surface, (-1e5, 0.0), (-50.0, 9.0), (150.0, 0.0), (1e5, 0.0)) == [0.1, 0.1, 180.3, 180.3]
    assert at(surface, (50.0, 3.0), (0.0, 3.0)) == pytest.approx([90.2, 0.75 * 0.1 + 0.25 * 180.3], rel=1e-14)
    turned = Pattern(**GRADIENT, angle=180.0)
    assert at(turned, (-150.0, 0.0), (50.0, 0.0)) == pytest.approx([180.3, 0.1], rel=1e-12)


def test_mask_lies_as_the_picture_is_seen(picture: Path) -> None:
    surface = Pattern(kind="mask", high=255.0, image=str(picture), pixel=2.0, origin=(-3.0, 10.0))
    lower, upper = [(-2.9, 10.1), (-1.1, 11.9), (-0.9, 11.0), (2.9, 11.0)], [(-2.0, 12.1), (0.0, 13.0), (2.0, 13.9)]
    assert at(surface, *lower) == [255, 255, 0, 0]
    assert at(surface, *upper) == [0, 51, 255]
    assert at(surface, (3.1, 13.0), (2.0, 14.1), (-3.1, 11.0), (-2.0, 9.9)) == [0, 0, 0, 0]


def test_mask_repeats(picture: Path) -> None:
    given: dict[str, Any] = {"kind": "mask", "high": 255.0, "image": str(picture), "pixel": 2.0}
    single, tiled = Pattern(**given), Pattern(**given, outside="repeat")
    x, y = np.random.default_rng(2).uniform(0, [[6], [4]], (2, 200))
    assert (tiled.density(x - 600, y + 40) == single.density(x, y)).all()
    assert tiled.density(x, y).max() == 255


def test_depth_and_colour_of_a_picture(tmp_path: Path, picture: Path) -> None:
    eight = np.asarray(Image.open(picture))
    deep, coloured = tmp_path / "deep.png", tmp_path / "coloured.png"
    Image.fromarray(eight.astype(np.uint16) * 257).save(deep)
    Image.fromarray(np.stack([eight] * 3, axis=-1)).save(coloured)
    for path in (deep, coloured):
        surface = Pattern(kind="mask", high=255.0, image=str(path), pixel=2.0)
        assert at(surface, (1.0, 1.0), (3.0, 3.0), (5.0, 3.0)) == pytest.approx([255, 51, 255], rel=1e-14)


def test_resolution(picture: Path) -> None:
    assert Pattern(**STRIPES).resolution() == 0.05
    assert Pattern(**STRIPES | {"period": 1.0}).resolution() == pytest.approx(0.02)
    assert Pattern(kind="mask", high=1.0, image=str(picture), pixel=0.06).resolution() == pytest.approx(0.03)


def test_a_changed_picture_is_refused(picture: Path) -> None:
    given: dict[str, Any] = {"kind": "mask", "high": 255.0, "image": str(picture), "pixel": 2.0}
    kept = Pattern(**given, sha256=hashlib.sha256(picture.read_bytes()).hexdigest())
    assert kept.densest() == 255
    Image.fromarray(np.zeros((2, 3), np.uint8)).save(picture)
    with pytest.raises(ValueError, match=r"mask\.png' is not the one that this scene was made with \(SHA-256"):
        Pattern(**given, sha256=kept.sha256)


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"kind": "stripes"}, "period is missing; kind 'stripes' needs it"),
    (STRIPES | {"pixel": 2.0}, "pixel is unknown to kind 'stripes' .its parameters: period, duty, angle, offset"),
    (STRIPES | {"period": 0.0}, "period must be positive, but is 0"),
    (STRIPES | {"duty": 1.0}, "duty must lie between 0 and 1, but is 1"),
    (STRIPES | {"low": -1.0}, "must not be negative, but is -1"),
    (BOARD | {"duty": 0.5}, "duty is unknown to kind 'checkerboard'"),
    (GRADIENT | {"end": -60.0}, "end must lie behind start, -50 um, but is -60 um"),
    ({"kind": "spots"}, "kind must be one of stripes, checkerboard, gradient, mask, not 'spots'"),
    ({"kind": "mask", "pixel": 1.0}, "image is missing"),
    ({"kind": "mask", "image": "/nowhere/a.png", "pixel": 1.0}, "image '/nowhere/a.png' cannot be read: there is no"),
    ({"kind": "mask", "image": "/dev/zero", "pixel": 1.0}, "cannot be read: there is no such file"),
    ({"kind": "mask", "image": "a\0b", "pixel": 1.0}, "cannot be read"),
]


@pytest.mark.parametrize(("given", "says"), REFUSED)
def test_refuses(given: dict[str, Any], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        Pattern(**{"high": 180.0} | given)


def test_refuses_what_is_no_picture(tmp_path: Path, picture: Path) -> None:
    path = tmp_path / "broken.png"
    for raw in (b"", b"no picture", picture.read_bytes()[:40]):
        path.write_bytes(raw)
        with pytest.raises(ValueError, match=r"broken\.png' is no picture that can be read"):
            Pattern(kind="mask", high=1.0, image=str(path), pixel=1.0)
