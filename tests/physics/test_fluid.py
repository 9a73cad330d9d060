"""The fluid's velocity as a plain question: on surfaces, off them, and where there is no fluid."""

import numpy as np
import pytest

from mpad_core import InputError, RefusedError, fluid_velocities, solver, velocities

PAIR = [[0, 0, 1.5], [2.5, 0, 1.6]]
SHEAR = {"viscosity": 1.0, "shear_rate": 1.0}


def around(number=30):
    k = np.arange(number) + 0.5
    z, angle = 1 - 2 * k / number, np.pi * (1 + 5**0.5) * k
    return np.column_stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z])


@pytest.mark.parametrize("parameters", [{}, {"discretisation": "elements", "elements": 24}])
def test_at_a_surface_the_fluid_moves_as_it_does(parameters):
    chosen, arms = solver("cdl-biem", **parameters), around()
    own = velocities(chosen, PAIR, 1.0, **SHEAR)[1]
    surface = own[:3] + np.cross(own[3:], arms)
    for away, allowed in ((0.0, 1e-14), (1e-9, 1e-7), (1e-6, 1e-4)):
        found = fluid_velocities(chosen, PAIR, 1.0, PAIR[1] + (1 + away) * arms, **SHEAR)
        assert np.abs(found - surface).max() < allowed


def test_a_lone_sphere_that_falls_drags_the_fluid_as_stokes_has_it():
    """u = (3/4r + 1/4r³) U + (3/4r − 3/4r³) (U·n) n, at any distance."""
    chosen, force = solver("cdl-biem"), np.array([[0.3, -0.2, 1.0]])
    speed = force[0] / (6 * np.pi)
    for r in (1 + 1e-9, 1.01, 1.1, 2.0, 10.0):
        n = around()
        expected = (0.75 / r + 0.25 / r**3) * speed + (0.75 / r - 0.75 / r**3) * (n @ speed)[:, None] * n
        found = fluid_velocities(chosen, [[0, 0, 0]], 1.0, r * n, viscosity=1.0, forces=force, wall=False)
        assert found == pytest.approx(expected, abs=1e-8)


def test_where_there_is_no_fluid_it_is_refused():
    chosen = solver("cdl-biem")
    with pytest.raises(RefusedError, match=r"point 1 is in sphere 1, 1e-06 below its surface"):
        fluid_velocities(chosen, PAIR, 1.0, [[0, 5, 1], [2.5, 0, 2.6 - 1e-6]], **SHEAR)
    with pytest.raises(RefusedError, match=r"point 0 is below the wall"):
        fluid_velocities(chosen, PAIR, 1.0, [[0, 5, -1e-3]], **SHEAR)
    with pytest.raises(InputError, match="points must be"):
        fluid_velocities(chosen, PAIR, 1.0, [[0, 5]], **SHEAR)


@pytest.mark.parametrize("name", ["isolated", "rpb", "sd"])
def test_solvers_without_flow_are_refused_by_name(name):
    with pytest.raises(RefusedError, match=rf"solver '{name}' has no flow"):
        fluid_velocities(solver(name), PAIR, 1.0, [[0, 5, 1]], **SHEAR)
