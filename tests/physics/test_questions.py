"""The two plain questions: any units, held spheres, and clear refusals."""

from typing import Any

import numpy as np
import pytest

from mpad_core import InputError, RefusedError, mobility_matrix, solver, velocities

CENTRES = np.array([[0, 0, 1.2], [2.4, 0.3, 1.5], [-0.5, 2.6, 3.0]])
RADII = np.array([1.0, 0.8, 1.1])
FORCES = np.array([[1.0, 0.5, -2.0], [0.0, 1.0, 0.3], [-1.0, 0.2, 0.1]])
TORQUES = np.array([[0.1, -0.4, 0.2], [0.3, 0.0, 0.0], [0.0, 0.5, -0.6]])
SOLVERS = pytest.mark.parametrize("name", ["rpb", "isolated"])
MICRO = (1e-6, 1e-12)  # metres in a micrometre, newtons in a piconewton


@SOLVERS
@pytest.mark.parametrize("wall", [True, False])
def test_mobility_does_not_depend_on_the_units(name: str, wall: bool) -> None:
    length, force = MICRO
    inner = mobility_matrix(solver(name), CENTRES, RADII, viscosity=1e-3, wall=wall)
    si = mobility_matrix(solver(name), CENTRES * length, RADII * length, viscosity=1e-3 * force / length**2, wall=wall)
    velocity = np.tile(np.repeat([length, 1.0], 3), 3)
    load = np.tile(np.repeat([force, force * length], 3), 3)
    expected = inner * velocity[:, None] / load
    scale = np.sqrt(np.diag(expected))
    assert (np.abs(si - expected) / np.outer(scale, scale)).max() < 1e-12


@SOLVERS
@pytest.mark.parametrize("held", [(), (0,), (1, 2)])
@pytest.mark.parametrize("loaded", [True, False])
def test_velocities_do_not_depend_on_the_units(name: str, held: tuple[int, ...], loaded: bool) -> None:
    length, force = MICRO
    f, t = (FORCES, TORQUES) if loaded else (None, None)
    inner = velocities(solver(name), CENTRES, RADII, viscosity=1e-3, shear_rate=80.0, forces=f, torques=t, held=held)
    si = velocities(
        solver(name), CENTRES * length, RADII * length, viscosity=1e-3 * force / length**2, shear_rate=80.0,
        forces=FORCES * force if loaded else None, torques=TORQUES * force * length if loaded else None, held=held,
    )  # fmt: skip
    expected = inner * np.repeat([length, 1.0], 3)
    assert si == pytest.approx(expected, rel=1e-9, abs=1e-12 * np.abs(inner).max() * length)


@SOLVERS
def test_velocities_are_the_mobility_times_the_loads(name: str) -> None:
    matrix = mobility_matrix(solver(name), CENTRES, RADII, viscosity=1.3)
    moved = velocities(solver(name), CENTRES, RADII, viscosity=1.3, forces=FORCES, torques=TORQUES)
    loads = np.hstack([FORCES, TORQUES]).ravel()
    assert moved.ravel() == pytest.approx(matrix @ loads, rel=1e-11, abs=1e-12)


def test_held_spheres_take_the_loads_that_stop_them() -> None:
    """Strike held rows from R = M⁻¹, not from M."""
    free, held = 0, [1, 2]
    given: dict[str, Any] = {"viscosity": 1.3, "shear_rate": 2.0}
    matrix = mobility_matrix(solver("rpb"), CENTRES, RADII, viscosity=1.3)
    flow = velocities(solver("rpb"), CENTRES, RADII, **given).ravel()
    resistance = np.linalg.inv(matrix)
    loads = np.concatenate([FORCES[0], TORQUES[0]])
    expected = np.linalg.solve(resistance[:6, :6], loads + resistance[:6] @ flow)
    moved = velocities(solver("rpb"), CENTRES, RADII, forces=FORCES, torques=TORQUES, held=held, **given)
    assert moved[free] == pytest.approx(expected, rel=1e-9)
    assert (moved[held] == 0).all()


def test_held_may_name_a_sphere_twice_and_all_of_them() -> None:
    once = velocities(solver("rpb"), CENTRES, RADII, viscosity=1, shear_rate=1, held=[1])
    assert (once == velocities(solver("rpb"), CENTRES, RADII, viscosity=1, shear_rate=1, held=[1, 1])).all()
    assert (velocities(solver("rpb"), CENTRES, RADII, viscosity=1, shear_rate=1, held=range(3)) == 0).all()


def test_held_alone_in_still_fluid() -> None:
    assert (velocities(solver("rpb"), CENTRES, RADII, viscosity=1.0, held=[0]) == 0).all()


def test_flow_of_either_sign_and_without_a_wall() -> None:
    there, back = (velocities(solver("rpb"), CENTRES, RADII, viscosity=1, shear_rate=s) for s in (2.0, -2.0))
    assert there == pytest.approx(-back)
    lone = velocities(solver("rpb"), [0, 0, -3], 1, viscosity=1, shear_rate=2.0, wall=False)
    assert lone == pytest.approx(np.array([[-6.0, 0, 0, 0, 1, 0]]))


def test_one_radius_for_all() -> None:
    one = mobility_matrix(solver("rpb"), CENTRES, 0.7, viscosity=1)
    assert (one == mobility_matrix(solver("rpb"), CENTRES, [0.7] * 3, viscosity=1)).all()


BAD: dict[str, dict[str, Any]] = {
    "no centres": {"centres": []},
    "two coordinates": {"centres": [[0, 2]]},
    "ragged centres": {"centres": [[0, 0, 2], [1, 2]]},
    "words for centres": {"centres": "abc"},
    "nan centre": {"centres": [[0, 0, np.nan], [3, 0, 2], [6, 0, 2]]},
    "below the wall": {"centres": [[0, 0, 2], [3, 0, -2], [6, 0, 2]]},
    "too many radii": {"radii": [1, 1, 1, 1]},
    "negative radius": {"radii": [1, -1, 1]},
    "zero radius": {"radii": 0},
    "infinite radius": {"radii": np.inf},
    "zero viscosity": {"viscosity": 0},
    "negative viscosity": {"viscosity": -1.0},
    "nan viscosity": {"viscosity": np.nan},
    "nan shear": {"shear_rate": np.nan},
    "infinite shear": {"shear_rate": np.inf},
    "one force": {"forces": [0, 0, 1]},
    "ragged forces": {"forces": [[0, 0, 1], [0, 1]]},
    "nan force": {"forces": np.full((3, 3), np.nan)},
    "six torques": {"torques": np.zeros((3, 6))},
    "held beyond": {"held": [3]},
    "held negative": {"held": [-1]},
    "held by a mask": {"held": [False, True, False]},
    "held by a fraction": {"held": [0.5]},
}


@pytest.mark.parametrize("fault", BAD)
def test_what_makes_no_sense_is_an_input_error(fault: str) -> None:
    given: dict[str, Any] = {"centres": [[0, 0, 2], [3, 0, 2], [6, 0, 2]], "radii": 1.0, "viscosity": 1.0}
    given |= BAD[fault]
    with pytest.raises(InputError):
        velocities(solver("rpb"), given.pop("centres"), given.pop("radii"), **given)


def test_input_errors_name_what_is_wrong() -> None:
    with pytest.raises(InputError, match=r"forces must be \(1, 3\), not \(3,\)"):
        velocities(solver("rpb"), [[0, 0, 2]], 1, viscosity=1, forces=[0, 0, 1])
    with pytest.raises(InputError, match="sphere 1 has its centre at z = -2"):
        mobility_matrix(solver("rpb"), [[0, 0, 2], [0, 0, -2]], 1, viscosity=1)
    with pytest.raises(InputError, match=r"rpb.*nonsense"):
        solver("rpb", nonsense=1)
    with pytest.raises(InputError, match="no solver 'rbp'"):
        solver("rbp")


class Limited:
    """A solver that can treat next to nothing; asking it anything more is refused before it is asked."""

    name = "limited"

    def __init__(self, **traits: Any) -> None:
        from mpad_core import SolverTraits

        self.traits = SolverTraits(**traits)

    def plan(self, setting: Any) -> None:
        raise AssertionError("must not be asked")


@pytest.mark.parametrize(
    ("lacking", "need", "words"),
    [
        ({"wall": False}, "a wall", {}),
        ({"unbounded": False}, "an unbounded fluid", {"wall": False}),
        ({"unequal_radii": False}, "unequal radii", {}),
        ({"ambient_flow": False}, "ambient flow", {"shear_rate": 1.0}),
        ({"largest_number": 2}, "3 cells", {}),
    ],
)
def test_what_a_solver_cannot_treat_is_refused_before_any_solve(lacking: Any, need: str, words: Any) -> None:
    with pytest.raises(InputError, match=f"limited.*{need}"):
        velocities(Limited(**lacking), CENTRES, RADII, viscosity=1.0, **words)


def test_a_solver_without_torques_is_not_asked_for_them() -> None:
    with pytest.raises(InputError, match=r"limited.*torque"):
        velocities(Limited(torques=False), CENTRES, RADII, viscosity=1.0, torques=TORQUES)


def test_held_spheres_in_one_place_are_refused_by_name() -> None:
    """Their mobility is singular, and what a solve would give for the loads that hold them means nothing."""
    bare = solver("rpb", lone_sphere="blake")
    with pytest.raises(RefusedError, match=r"solver 'rpb': the mobility of the held spheres 0, 1 is singular"):
        velocities(bare, [[0, 0, 1.5], [0, 0, 1.5], [2.5, 0, 1.5]], 1.0, viscosity=1.0, shear_rate=1.0, held=[0, 1])


def test_held_spheres_of_any_size_are_not_refused() -> None:
    """The check is in units in which the mobility is symmetric, whatever the radius."""
    speeds = []
    for radius in (1e-2, 1.0, 5.0, 300.0):
        at = radius * np.array([[0, 0, 1.001], [2.001, 0, 1.001], [1, 2.2, 1.3]])
        moved = velocities(solver("rpb"), at, radius, viscosity=1.0, shear_rate=1.0, held=[0, 1])
        speeds.append(moved[2, 0] / radius)
    assert speeds == pytest.approx([speeds[0]] * 4, rel=1e-9)
