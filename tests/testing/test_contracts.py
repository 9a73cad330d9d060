"""The contracts find faults: parts with one thing wrong each, and the test of the contract that says so."""

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest
from attrs import evolve, frozen

from mpad_core import solver
from mpad_core.arrays import Array
from mpad_core.interfaces.errors import PartError
from mpad_core.interfaces.values import Configuration, Motion, Report, Setting, SolverTraits
from mpad_core.testing import (
    BondModelContract,
    FluctuatingContract,
    GapForceContract,
    MobilitySolverContract,
    SurfaceContract,
    typical,
)

REST, STIFF = 0.03, 1e4


@frozen(kw_only=True)
class Spring:
    """A bond without a fault."""

    name: ClassVar[str] = "spring"
    rest_length: float = REST
    fault: str = ""

    def tension(self, length: Array) -> Array:
        if self.fault == "writes to its input":
            length -= self.rest_length
        rest = 0.0 if self.fault in ("pulls at rest", "writes to its input") else self.rest_length
        crowded = 1.0 if self.fault == "sums" and length.size > 1 else 0.0
        tension: Array = STIFF * (length - rest) + crowded
        return tension

    def off_rate(self, length: Array) -> Array:
        stretch = length - self.rest_length
        rates = {
            "negative": -1.0 + 0 * length,
            "not finite": np.where(stretch > 0.01, np.nan, 1.0),
            "hidden kink": 1.0 + np.maximum(stretch - 0.00123, 0) * 1e4,
            "dice": np.random.Generator(np.random.PCG64()).uniform(size=np.shape(length)),
            "one number": 2.0,
        }
        rate: Array = np.asarray(rates.get(self.fault, 2.0 + 0 * length))
        return rate

    def breakpoints(self) -> tuple[float, ...]:
        return (0.5 * self.rest_length,) if self.fault == "no node at rest" else (self.rest_length,)


def bond_of(fault: str) -> BondModelContract:
    contract = BondModelContract()
    contract.model = Spring(fault=fault)
    return contract


SHARES = np.linspace(0.0, 1.0, 41)


def one(test: Any, **given: Any) -> None:
    """Run a Hypothesis test on one example; finding a fault anew each time would take its time."""
    test.hypothesis.inner_test(test.__self__, **given)


BOND_FAULTS: list[tuple[str, Callable[[BondModelContract], None]]] = [
    ("writes to its input", lambda c: c.test_pure()),
    ("pulls at rest", lambda c: c.test_unstressed_at_the_rest_length()),
    ("sums", lambda c: one(c.test_elementwise, shares=SHARES)),
    ("negative", lambda c: one(c.test_finite_and_not_negative, compression="slack", shares=SHARES)),
    ("not finite", lambda c: c.test_ends_with_a_number()),
    ("hidden kink", lambda c: one(c.test_followed_by_tables, compression="slack", shares=SHARES)),
    ("dice", lambda c: c.test_pure()),
    ("one number", lambda c: one(c.test_elementwise, shares=SHARES)),
    ("no node at rest", lambda c: c.test_breakpoints_hold_the_rest_length()),
]


@pytest.mark.parametrize(("fault", "law"), BOND_FAULTS, ids=[fault for fault, _ in BOND_FAULTS])
def test_faulty_bonds_are_found(fault: str, law: Callable[[BondModelContract], None]) -> None:
    law(bond_of(""))
    with pytest.raises((AssertionError, ValueError, PartError)):
        law(bond_of(fault))


class TestSpring(BondModelContract):
    """The spring itself is whole."""

    model = Spring()


@frozen(kw_only=True)
class Skewed:
    """The solver `rpb`, with its answers spoilt."""

    name: ClassVar[str] = "skewed"
    traits: ClassVar[SolverTraits] = SolverTraits()
    fault: str = ""

    def plan(self, setting: Setting) -> Any:
        return setting

    def prepare(self, plan: Any, configuration: Configuration, guess: Array | None = None) -> Any:
        inner = solver("rpb")
        at = configuration
        if self.fault == "feels the place":
            at = Configuration(centres=at.centres, radii=at.radii * (1 - 1e-3 * np.tanh(at.centres[0, 0])))
        if self.fault == "answers NaN" and not np.isfinite(at.centres).all():
            at = Configuration(centres=[[0, 0, 3.0], [5, 0, 3.0]], radii=[1.0, 1.0])
        return inner, inner.prepare(inner.plan(plan), at), guess

    def solve(self, prepared: Any, loads: Array) -> Motion:
        inner, ready, guess = prepared
        answer: Motion = inner.solve(ready, loads)
        velocity = answer.velocity.copy()
        if self.fault == "skew":
            velocity[:, 0] += 1e-4 * loads[:, 1]
        if self.fault == "indefinite":
            velocity -= 1e-1 * loads
        if self.fault == "not linear":
            velocity += 1e-3 * np.abs(loads)
        if self.fault == "believes its guess":
            velocity += 0.0 if guess is None else 1e-3
        if self.fault == "boasts":
            velocity = 1.01 * velocity
            return evolve(answer, velocity=velocity, report=Report(error=1e-6))
        if self.fault == "first column only" and velocity.ndim == 3:
            velocity[...] = velocity[..., :1]
        return evolve(answer, velocity=velocity, guess=velocity)


def solver_of(fault: str) -> MobilitySolverContract:
    contract = MobilitySolverContract()
    contract.solver = Skewed(fault=fault)
    return contract


THREE = Configuration(centres=[[0, 0, 1.1], [3, 1, 2.5], [-1, 4, 1.3]], radii=[1.0, 1.5, 0.7])
AT: dict[str, Any] = {"wall": True, "at": THREE}

SOLVER_FAULTS: list[tuple[str, Callable[[MobilitySolverContract], None]]] = [
    ("skew", lambda c: one(c.test_symmetric, **AT)),
    ("skew", lambda c: one(c.test_mirrored, **AT)),
    ("skew", lambda c: one(c.test_turns_with_the_configuration, **AT, angle=0.7)),
    ("indefinite", lambda c: one(c.test_positive_definite, **AT)),
    ("indefinite", lambda c: one(c.test_scales, **AT, length=3.0, viscosity=0.2, rate=7.0)),
    ("feels the place", lambda c: one(c.test_same_anywhere_along_the_wall, **AT, x=3.0, y=-2.0)),
    ("feels the place", lambda c: one(c.test_names_of_spheres_do_not_matter, **AT, seed=0)),
    ("not linear", lambda c: one(c.test_superposes, **AT)),
    ("first column only", lambda c: one(c.test_block_is_its_columns, **AT)),
    ("believes its guess", lambda c: c.test_warm_start_changes_nothing(True)),
    ("boasts", lambda c: c.test_lone_sphere_is_as_good_as_claimed(True, 0.3)),
]


@pytest.mark.parametrize(("fault", "law"), SOLVER_FAULTS)
def test_faulty_solvers_are_found(fault: str, law: Callable[[MobilitySolverContract], None]) -> None:
    law(solver_of(""))
    with pytest.raises(AssertionError):
        law(solver_of(fault))


def test_answering_what_is_no_number_is_found() -> None:
    solver_of("").test_refuses_what_is_no_number()
    with pytest.raises(pytest.fail.Exception, match="DID NOT RAISE"):
        solver_of("answers NaN").test_refuses_what_is_no_number()


@frozen(kw_only=True)
class Shaken(Skewed):
    """The solver `rpb`, with its thermal motion spoilt."""

    def root(self, prepared: Any, noise: Array) -> Array:
        inner, ready, _ = prepared
        root: Array = inner.root(ready, noise)
        if self.fault == "too hot":
            root *= 1.001
        if self.fault == "one temper each":
            root *= 1 + 1e-5 * np.linalg.norm(noise)
        return root

    def drift(self, prepared: Any, noise: Array | None = None) -> Array:
        inner, ready, _ = prepared
        drift: Array = inner.drift(ready, noise)
        if self.fault == "does not drift":
            drift *= 0.0
        if self.fault == "estimates twice" and noise is not None:
            drift *= 2.0
        return drift


def shaken(fault: str) -> FluctuatingContract:
    contract = FluctuatingContract()
    contract.solver = Shaken(fault=fault)
    return contract


THERMAL_FAULTS: list[tuple[str, Callable[[FluctuatingContract], None]]] = [
    ("too hot", lambda c: one(c.test_root_is_one_of_the_mobility, **AT)),
    ("too hot", lambda c: c.test_root_of_many(True)),
    ("one temper each", lambda c: c.test_root_is_linear(True)),
    ("does not drift", lambda c: c.test_drift_is_the_divergence(True, THREE)),
    ("estimates twice", lambda c: c.test_random_drift_is_right_in_the_mean(True, THREE.part(np.arange(2)))),
]


@pytest.mark.parametrize(("fault", "law"), THERMAL_FAULTS)
def test_faulty_thermal_motion_is_found(fault: str, law: Callable[[FluctuatingContract], None]) -> None:
    law(shaken(""))
    with pytest.raises(AssertionError):
        law(shaken(fault))


@frozen(kw_only=True)
class Striped:
    """A surface whose bound is too low, or is not."""

    name: ClassVar[str] = "striped"
    bound: float = 200.0

    def density(self, x: Array, y: Array) -> Array:
        return np.broadcast_arrays(100.0 * (1 + np.sin(x)), y)[0]

    def densest(self) -> float:
        return self.bound


def test_surface_above_its_bound_is_found() -> None:
    contract = SurfaceContract()
    contract.surface = Striped()
    places = np.linspace(-9.0, 9.0, 80).reshape(-1, 2)
    one(contract.test_bounded, places=places)
    contract.surface = Striped(bound=150.0)
    with pytest.raises(AssertionError):
        one(contract.test_bounded, places=places)


@frozen(kw_only=True)
class Ramp:
    """A force law that ends abruptly, or pulls."""

    name: ClassVar[str] = "ramp"
    slope: float = -1.0
    end: float = 1.0

    def force(self, gap: Array) -> Array:
        return self.slope * (gap - self.end)

    def gaps(self) -> tuple[float, float]:
        return 0.1, 1.0


def test_faulty_forces_are_found() -> None:
    contract = GapForceContract()
    contract.force = Ramp()
    contract.test_ends_in_nothing()
    contract.test_keeps_surfaces_apart()
    contract.force = Ramp(end=1.5)
    with pytest.raises(AssertionError, match="vanishes"):
        contract.test_ends_in_nothing()
    contract.force = Ramp(slope=1.0)
    with pytest.raises(AssertionError):
        contract.test_keeps_surfaces_apart()


def test_typical_takes_defaults_and_what_is_given() -> None:
    assert typical(Spring) == Spring()
    assert typical(Spring, rest_length=0.05).rest_length == 0.05
    assert typical(Ramp, end=2.0).end == 2.0
