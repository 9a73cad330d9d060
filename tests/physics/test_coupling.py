"""The frozen coupling: C + r = M⁻¹, held cells struck from the resistance, and distant cells by one load."""

from typing import Any

import numpy as np
import pytest
from attrs import evolve

from mpad_core.interfaces.errors import PartError, RefusedError
from mpad_core.interfaces.values import Configuration, Motion, Report, Setting, SolverTraits
from mpad_core.physics import coupling
from mpad_core.physics.couplers import coupler
from mpad_core.physics.coupling import free_motion, group_cells, lone_cell, typical_speed
from mpad_core.physics.questions import constrained_motion, mobility_matrix, unit_load, velocities

CENTRES = [[0, 0, 5.3], [10.8, 1, 6.0], [-3, 12, 7.5], [2, 1, 17.5]]
SHEAR, VISCOSITY = 80.0, 1e-3


def weights(n: int) -> Any:
    loads = np.random.default_rng(4).normal(size=(n, 6)) * [1, 1, 1, 5, 5, 5]
    loads[:, 2] -= 0.3
    return loads


def at(asked: Any) -> Configuration:
    return Configuration(centres=asked.start, radii=asked.radii)


def lone(asked: Any, cell: int) -> tuple[Any, Any]:
    height = float(asked.start[cell, 2])
    return lone_cell(asked.setting, float(asked.radii[cell]), height, height - float(asked.radii[cell]))


def frozen_velocities(asked: Any, found: Any, loads: Any) -> Any:
    """Solve r U + C U = F + f + k + g, group by group, by numpy."""
    velocity = np.zeros((len(asked.radii), 6))
    for group, matrix in zip(found.groups, found.matrices, strict=True):
        total, right = matrix.copy(), np.zeros(6 * len(group))
        for place, cell in enumerate(group):
            resistance, ambient = lone(asked, int(cell))
            own = slice(6 * place, 6 * place + 6)
            total[own, own] += resistance
            right[own] = loads[cell] + ambient + found.loads[cell]
        velocity[group] = np.linalg.solve(total, right).reshape(-1, 6)
    return velocity


def asked_directly(asked: Any, loads: Any, held: Any = ()) -> Any:
    fluid = asked.setting
    given = {"viscosity": fluid.viscosity, "shear_rate": fluid.shear_rate, "wall": fluid.wall}
    return velocities(
        asked.solver, asked.start, asked.radii, forces=loads[:, :3], torques=loads[:, 3:], held=held, **given
    )


def close(found: Any, expected: Any, tolerance: float) -> None:
    """Velocities and surface speeds of rotation, against the largest of them."""
    scale = np.array([1, 1, 1, 5, 5, 5])
    assert np.abs((found - expected) * scale).max() < tolerance * np.abs(expected * scale).max()


def test_coupling_and_lone_resistance_invert_the_mobility(problem: Any) -> None:
    asked = problem(CENTRES)
    found = coupler(asked).at(at(asked), np.zeros((4, 6)), None)
    (group,), (matrix,) = found.groups, found.matrices
    assert group.tolist() == [0, 1, 2, 3]
    total = matrix.copy()
    for cell in range(4):
        total[6 * cell : 6 * cell + 6, 6 * cell : 6 * cell + 6] += lone(asked, cell)[0]
    mobility = mobility_matrix(asked.solver, CENTRES, 5.0, viscosity=VISCOSITY)
    scale = np.sqrt(np.diag(mobility))  # each velocity in its own unit
    product = (mobility @ total) / scale[:, None] * scale
    np.testing.assert_allclose(product, np.eye(24), rtol=0, atol=1e-9)
    assert (matrix == matrix.T).all()


def test_frozen_equation_gives_the_full_solve(problem: Any) -> None:
    asked = problem(CENTRES)
    loads = weights(4)
    found = coupler(asked).at(at(asked), np.zeros((4, 6)), None)
    close(frozen_velocities(asked, found, loads), asked_directly(asked, loads), 1e-9)


@pytest.mark.parametrize("held", [[0], [1, 3], [0, 1, 2]])
def test_held_cells_are_constrained_motion(problem: Any, held: list[int]) -> None:
    flags = np.isin(np.arange(4), held)
    asked = problem(CENTRES, held=flags)
    loads = weights(4)
    found = coupler(asked).at(at(asked), np.zeros((4, 6)), None)
    expected = asked_directly(asked, loads, held)
    close(frozen_velocities(asked, found, loads), expected, 1e-9)
    assert (expected[held] == 0).all()
    assert (found.loads[held] == 0).all()


@pytest.mark.parametrize("held", [(), (1,)])
@pytest.mark.parametrize("largest", [1, 2])
def test_several_groups_give_the_full_velocities_under_the_mean_loads(
    problem: Any, monkeypatch: pytest.MonkeyPatch, held: tuple[int, ...], largest: int
) -> None:
    monkeypatch.setattr(coupling, "LARGEST_GROUP", largest)
    asked = problem([[0, 0, 5.3], [14, 1, 6.0], [60, 30, 7.5], [74, 31, 6.5]], held=np.isin(np.arange(4), held))
    loads = weights(4)
    found = coupler(asked).at(at(asked), loads, None)
    assert len(found.groups) > 1
    close(frozen_velocities(asked, found, loads), asked_directly(asked, loads, held), 1e-9)


def test_many_cells_far_apart_are_grouped_and_still_right(problem: Any) -> None:
    rng = np.random.default_rng(2)
    centres = [[60.0 * i, 60.0 * j, rng.uniform(5.3, 9)] for i in range(4) for j in range(3)]
    centres += [[x + 11.5, y, z] for x, y, z in centres[:3]]
    asked = problem(centres)
    loads = weights(len(centres))
    found = coupler(asked).at(at(asked), loads, None)
    assert max(len(group) for group in found.groups) <= coupling.LARGEST_GROUP
    assert sorted(np.concatenate(found.groups).tolist()) == list(range(15))
    close(frozen_velocities(asked, found, loads), asked_directly(asked, loads), 1e-8)


def test_an_unsolved_guess_does_not_matter(problem: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(coupling, "LARGEST_GROUP", 2)
    asked = problem(CENTRES)
    cold = coupler(asked).at(at(asked), weights(4), None)
    warm = coupler(asked).at(at(asked), weights(4), cold.guess)
    np.testing.assert_allclose(warm.loads, cold.loads, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("gap", [1e-4, 0.235, 3.0, 500.0])
def test_one_cell_has_no_coupling(problem: Any, gap: float) -> None:
    """The solver treats a lone sphere exactly, so all that is left is rounding."""
    asked = problem([[0, 0, 5 + gap]])
    found = coupler(asked).at(at(asked), np.zeros((1, 6)), None)
    resistance, ambient = lone(asked, 0)
    scale = np.sqrt(np.diag(resistance))
    assert (np.abs(found.matrices[0]) / np.outer(scale, scale)).max() < 1e-9
    assert np.abs(found.loads / ([1] * 3 + [5] * 3)).max() < 1e-8 * np.abs(ambient).max()


def test_no_coupling_gives_zero(problem: Any) -> None:
    asked = problem(CENTRES, solver="isolated", held=np.array([False, True, False, False]))
    found = coupler(asked).at(at(asked), weights(4), None)
    assert [group.tolist() for group in found.groups] == [[0], [2], [3]]
    assert all((matrix == 0).all() for matrix in found.matrices)
    assert (found.loads == 0).all()


def test_unbounded_fluid_gives_stokes(problem: Any) -> None:
    for height in (-40.0, 0.0, 3.0):
        fluid = Setting(viscosity=VISCOSITY, shear_rate=SHEAR, wall=False)
        resistance, load = lone_cell(fluid, 5.0, height, height - 5.0)
        drag, torque = 6 * np.pi * VISCOSITY * 5, 8 * np.pi * VISCOSITY * 125
        assert resistance == pytest.approx(np.diag([drag] * 3 + [torque] * 3), rel=1e-11, abs=1e-11)
        expected = [drag * SHEAR * height, 0, 0, 0, torque * SHEAR / 2, 0]
        assert load == pytest.approx(expected, rel=1e-11, abs=1e-9)
        asked = problem([[0, 0, height]], setting=fluid)
        found = coupler(asked).at(at(asked), np.zeros((1, 6)), None)
        moved = frozen_velocities(asked, found, np.zeros((1, 6)))
        assert moved[0] == pytest.approx([SHEAR * height, 0, 0, 0, SHEAR / 2, 0], rel=1e-9, abs=1e-9)


def test_all_cells_held(problem: Any) -> None:
    asked = problem(CENTRES, held=np.ones(4, bool))
    found = coupler(asked).at(at(asked), np.zeros((4, 6)), None)
    assert found.groups == ()
    assert (found.loads == 0).all()


def test_groups_by_gap_and_by_touch(problem: Any) -> None:
    centres = [[22.0 * i, 0, 6] for i in range(12)]  # gaps of 12 µm = 2.4 radii: in one chain, or all alone
    chain = Configuration(centres=centres, radii=np.full(12, 5.0))
    held = np.zeros(12, bool)
    assert [group.tolist() for group in group_cells(chain, held, 0.4)] == [[i] for i in range(12)]
    touching = group_cells(chain, held, 12.5)  # cells in contact stay together whatever their number
    assert [group.tolist() for group in touching] == [list(range(12))]
    held[5] = True
    broken = group_cells(chain, held, 12.5)
    assert [group.tolist() for group in broken] == [list(range(5)), list(range(6, 12))]
    assert group_cells(chain, np.ones(12, bool), 0.4) == ()


def test_free_motion_keeps_the_digits_of_both(problem: Any) -> None:
    asked = problem(CENTRES)
    plan = asked.solver.plan(asked.setting)
    mobility, free, _ = free_motion(
        asked.solver, asked.solver.prepare(plan, at(asked)), asked.setting, asked.radii, typical_speed(asked)
    )
    expected = mobility_matrix(asked.solver, CENTRES, 5.0, viscosity=VISCOSITY)
    scale = np.sqrt(np.diag(expected))
    assert (np.abs(mobility - expected) / np.outer(scale, scale)).max() < 1e-10
    close(free.reshape(4, 6), asked_directly(asked, np.zeros((4, 6))), 1e-12)


class Broken:
    """A solver whose mobility is not what a mobility can be."""

    name = "broken"
    traits = SolverTraits()

    def __init__(self, matrix: Any) -> None:
        self.matrix = matrix

    def plan(self, setting: Setting) -> None:
        return None

    def prepare(self, plan: Any, configuration: Configuration, guess: Any = None) -> None:
        return None

    def solve(self, prepared: Any, loads: Any) -> Motion:
        n = loads.shape[0]
        return Motion(velocity=(self.matrix @ loads.reshape(6 * n, -1)).reshape(loads.shape), report=Report(error=0))


def test_a_mobility_that_is_not_definite_is_refused_by_name(problem: Any) -> None:
    matrix = np.diag([1.0] * 11 + [-1.0])
    asked = problem(CENTRES[:2])
    bad = coupling.SolverCoupling(problem=evolve(asked, solver=Broken(matrix)), plan=None, speed=1.0, touching=0.0)
    with pytest.raises(RefusedError, match=r"broken.*c0, c1"):
        bad.at(at(asked), np.zeros((2, 6)), None)


def test_a_mobility_that_is_not_symmetric_is_a_fault_of_the_part() -> None:
    matrix = np.eye(6)
    matrix[0, 4] = 0.5
    with pytest.raises(PartError, match="broken"):
        free_motion(Broken(matrix), None, Setting(viscosity=1.0), np.array([5.0]), 1.0)


def test_constrained_motion_ignores_loads_on_held_cells(problem: Any) -> None:
    asked = problem(CENTRES)
    prepared = asked.solver.prepare(asked.solver.plan(asked.setting), at(asked))
    loads, unit = weights(4), unit_load(VISCOSITY, 5.0, 400.0)
    one = constrained_motion(asked.solver, prepared, loads, np.array([1]), unit).velocity
    loads[1] = 1e3
    other = constrained_motion(asked.solver, prepared, loads, np.array([1]), unit).velocity
    close(one, other, 1e-12)
    assert (one[1] == 0).all()
    assert np.abs(one).max() > 0
