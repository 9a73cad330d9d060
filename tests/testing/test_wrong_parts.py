"""The laws find what is wrong with each of the wrong parts, and nothing with the right one."""

import importlib.util
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from mpad_core.interfaces.values import Configuration
from mpad_core.testing import BondModelContract, MobilitySolverContract, SurfaceContract
from mpad_core.testing.asking import Place
from mpad_core.testing.exact import lone
from mpad_core.testing.reproducing import place_of, scene_text
from mpad_core.testing.suite.cases import Case

PAIR = Configuration(centres=[[0.0, 0.0, 9.0], [2.5, 1.0, 9.5]], radii=[1.0, 0.8])
THREE = Configuration(centres=[[0, 0, 1.1], [3, 1, 2.5], [-1, 4, 1.3]], radii=[1.0, 1.5, 0.7])


@pytest.fixture(scope="module")
def parts() -> ModuleType:
    path = Path(__file__).parent / "wrong_parts" / "mpad_wrong_parts.py"
    spec = importlib.util.spec_from_file_location("mpad_wrong_parts", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def one(test: Any, **given: Any) -> None:
    """Run a Hypothesis test on one example."""
    test.hypothesis.inner_test(test.__self__, **given)


def asking(solver: Any) -> MobilitySolverContract:
    contract = MobilitySolverContract()
    contract.solver, contract.claimed = solver, solver.traits.levels[0].error
    return contract


LAWS: list[tuple[str, str, Callable[[MobilitySolverContract], None]]] = [
    ("WrongSign", "two spheres are as good", lambda c: one(c.test_two_spheres_are_as_good_as_claimed, at=PAIR)),
    ("WrongSign", "squeezing", lambda c: one(c.test_squeezing_spheres_gets_harder, wall=False, ratio=1, angle=0)),
    ("WrongDrag", "a lone sphere is as good", lambda c: c.test_lone_sphere_is_as_good_as_claimed(True, 0.3)),
    ("WrongSymmetry", "mobility is symmetric", lambda c: one(c.test_symmetric, wall=True, at=THREE)),
    ("WrongSymmetry", "two loads are reciprocal", lambda c: one(c.test_reciprocal, wall=True, at=THREE, seed=1)),
    ("SaysNothing", "the claim says something", lambda c: c.test_claims_something(True, lone(1.0))),
    ("Pads", "claims are not padded", lambda c: c.test_claims_are_not_padded()),
    ("Boasts", "a lone sphere is as good", lambda c: c.test_lone_sphere_is_as_good_as_claimed(True, 0.3)),
]  # fmt: skip


@pytest.mark.parametrize(("name", "claim", "law"), LAWS)
def test_wrong_solvers_fail_by_the_claim(parts: ModuleType, name: str, claim: str, law: Any) -> None:
    law(asking(parts.Right()))
    with pytest.raises(AssertionError, match=claim):
        law(asking(getattr(parts, name)()))


def test_wrong_bonds_and_surfaces_fail(parts: ModuleType) -> None:
    shares, bond, surface = np.linspace(0, 1, 41), BondModelContract(), SurfaceContract()
    bond.model = parts.WrongRate(rest_length=0.03)
    with pytest.raises(AssertionError):
        one(bond.test_finite_and_not_negative, compression="slack", shares=shares)
    bond.model = parts.WrongShape(rest_length=0.03)
    with pytest.raises(AssertionError):
        one(bond.test_elementwise, shares=shares)
    surface.surface = parts.WrongBound()
    with pytest.raises(AssertionError):
        one(surface.test_bounded, places=np.linspace(-9.0, 9.0, 80).reshape(-1, 2))


def test_a_failure_is_a_scene_at_which_it_fails_again(parts: ModuleType) -> None:
    """The place that a law has asked goes into a scene and comes back to the bit."""
    from mpad_core.scene.files import parse_scene

    contract = asking(parts.WrongSymmetry())
    with pytest.raises(AssertionError) as failure:
        one(contract.test_symmetric, wall=True, at=THREE)
    assert isinstance(contract.asked, Place)
    text = scene_text(Case(kind="solver", name="rpb"), contract.asked, "wrong: symmetric", str(failure.value))
    assert "expected at most" in text.splitlines()[1]
    place = place_of(parse_scene(text))
    assert place.setting == contract.asked.setting
    assert (place.at.centres == THREE.centres).all()
    assert (place.at.radii == THREE.radii).all()
    again = asking(parts.WrongSymmetry())
    again.only = place
    with pytest.raises(AssertionError, match="mobility is symmetric"):
        one(again.test_symmetric, wall=True, at=PAIR)
