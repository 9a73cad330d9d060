"""The sphere-and-wall functions: exact series against other solutions, and the look-up against the series."""

import json
from pathlib import Path

import mpmath
import numpy as np
import pytest

from mpad_core.numerics import _wall_table
from mpad_core.numerics.wall_functions import (
    FAR,
    FPAR,
    FPERP,
    FROT,
    FSHEAR,
    NAMES,
    NEAR,
    TPAR,
    TROT,
    TSHEAR,
    TSPIN,
    wall_drift,
    wall_functions,
    wall_functions_array,
    wall_mobility,
    wall_resistance,
    wall_shear_load,
    wall_velocity,
)
from mpad_core.numerics.wall_series import SurfaceVelocity, force_and_torque, geometry, wall_series

REFERENCE = json.loads((Path(__file__).parents[1] / "data" / "wall_reference.json").read_text())
SPHERES = REFERENCE["spheres"]
EPS_WIDE = np.geomspace(1e-12, 1e12, 241)


def exact(eps):
    """The series, in 40 digits far from the wall, where the torque under translation cancels."""
    if eps < 10:
        return wall_series(eps).astype(float)
    with mpmath.workdps(40):
        return np.array([float(f) for f in wall_series(mpmath.mpf(eps), digits=38)])


def filled(function, shape, *arguments):
    out = np.full(shape, np.nan)
    function(*arguments, out)
    return out


def matrix_error(got, wanted):
    """Largest difference of two symmetric matrices, each entry in units of its two diagonal ones."""
    unit = np.sqrt(np.diag(wanted))
    return np.abs((got - wanted) / np.outer(unit, unit)).max()


# The series


@pytest.mark.parametrize("sphere", SPHERES, ids=lambda sphere: f"{sphere['gap']:.1e}")
def test_series_gives_the_reference_numbers(sphere):
    wanted = np.array([sphere["resistance"][name] for name in NAMES])
    tolerance = np.full(8, 1e-12)
    tolerance[[TPAR, FROT]] += 1e-17 / wanted[TPAR]  # the reference's own rounding, of functions that fall as (a/h)^4
    np.testing.assert_array_less(np.abs(wall_series(sphere["gap"]).astype(float) / wanted - 1), tolerance)


@pytest.mark.parametrize("row", REFERENCE["harmonics"], ids=lambda row: row[0])
def test_series_gives_the_digits_of_a_spherical_harmonics_solution(row):
    height = float(row[0])
    f = wall_series(height - 1).astype(float)
    velocity = filled(wall_velocity, 6, height, height - 1, 1.0, 1.0, shear_load(height, height - 1))
    got = [height, *f, velocity[0] / height, 2 * velocity[4]]
    for value, printed in zip(got, row, strict=True):
        mantissa, _, exponent = printed.partition("e")
        last_digit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
        assert abs(value - float(printed)) < 0.51 * last_digit


@pytest.mark.parametrize("eps", [1e-4, 1e-2, 1.0, 100.0])
def test_series_keeps_its_digits_in_extended_precision(eps):
    with mpmath.workdps(40):
        wanted = wall_series(mpmath.mpf(eps), digits=38)
        ratio = [float(mpmath.mpf(str(a)) / b - 1) for a, b in zip(wall_series(eps), wanted, strict=True)]
    assert np.abs(ratio).max() < 1e-11


@pytest.mark.parametrize("eps", [1e-6, 1e-3, 0.3, 5.0])
def test_series_is_reciprocal(eps):
    at = geometry(eps)
    one, zero = at.n[1], at.n[0]
    _, torque = force_and_torque(at, SurfaceVelocity(one, zero, zero))
    force, _ = force_and_torque(at, SurfaceVelocity(zero, one, one))
    assert float(torque / force) == pytest.approx(1, rel=1e-11)


def test_series_refuses_an_overlap():
    with pytest.raises(ValueError, match=r"positive, got -0\.1"):
        wall_series(-0.1)


def test_series_refuses_what_it_cannot_resolve():
    with pytest.raises(ValueError, match=r"beyond 1000 cancels, got 1000000\.0"):
        wall_series(1e6)


# The look-up


@pytest.mark.parametrize(
    ("low", "high", "bar"), [(1e-6, 1e-4, 1e-11), (1e-4, 1.0, 1e-12), (1.0, 10.0, 1e-12), (10.0, 1e3, 1e-12)]
)
def test_look_up_equals_the_series(low, high, bar):
    eps = np.geomspace(low, high, 20)
    wanted = np.array([exact(e) for e in eps])
    assert np.abs(wall_functions_array(eps) / wanted - 1).max() < bar


@pytest.mark.parametrize("border", [2.0**-octave for octave in range(11)])
def test_look_up_is_continuous_between_its_pieces(border):
    below, above = wall_functions_array(np.array([np.nextafter(border, 0), border]))
    np.testing.assert_allclose(below, above, rtol=1e-12)


def test_look_up_is_monotone_and_positive():
    f = wall_functions_array(EPS_WIDE)
    assert (f > 0).all()
    change = np.diff(f, axis=0)
    for falling in (FPAR, TPAR, FROT, TROT, FPERP, TSPIN, FSHEAR):
        assert (change[:, falling] <= 0).all()
    assert (change[:, TSHEAR] >= 0).all()


def test_look_up_is_reciprocal_to_the_last_bit():
    f = wall_functions_array(EPS_WIDE)
    assert (f[:, FROT] == 4 / 3 * f[:, TPAR]).all()


def test_array_equals_scalar():
    array = wall_functions_array(EPS_WIDE)
    assert (array == [filled(wall_functions, 8, eps) for eps in EPS_WIDE]).all()


@pytest.mark.parametrize("eps", [0.0, -1e-3, np.nan])
def test_no_gap_gives_no_number(eps):
    assert np.isnan(wall_functions_array(np.array([eps]))).all()


def test_unbounded_limit():
    f = wall_functions_array(np.array([1e12, np.inf]))
    np.testing.assert_allclose(f, [[1, 0, 0, 1, 1, 1, 1, 1]] * 2, rtol=0, atol=2e-12)


def test_first_reflections():
    """Faxen's leading terms in a/h (Happel & Brenner 1973, section 7-4); those of shear, Goldman et al. 1967 II."""
    leading = (FAR * (-1.0) ** np.arange(len(FAR))[:, None]).sum(axis=0)
    np.testing.assert_allclose(leading, [9 / 16, 3 / 32, 1 / 8, 5 / 16, 9 / 8, 1 / 8, 9 / 16, -3 / 16], rtol=1e-9)


def test_lubrication_limit():
    """Logarithms of Goldman et al. 1967 I; constants of Cooley & O'Neill 1968, Jeffery 1915, Goldman et al. 1967 II."""
    constant, logarithm = NEAR[0]
    np.testing.assert_allclose(logarithm, [8 / 15, 1 / 10, 2 / 15, 2 / 5, 0, 0, 0, 0])
    next_logarithm = [64 / 375, 43 / 250, 86 / 375, 66 / 125, 1 / 5, -1 / 2, 0, 0]
    np.testing.assert_allclose(NEAR[1, 1], next_logarithm, rtol=0, atol=1e-7)  # fitted, not imposed, but for 1/5
    assert NEAR[2, 1, FPERP] == pytest.approx(1 / 21, abs=1e-5)
    assert NEAR[1, 0, FPERP] == pytest.approx(0.9713, abs=5e-5)
    assert constant[TSPIN] == pytest.approx(float(mpmath.zeta(3)), abs=1e-12)
    assert constant[TROT] == pytest.approx(0.3709, abs=5e-5)
    assert constant[FSHEAR] == pytest.approx(1.7005, abs=2e-4)
    assert constant[TSHEAR] == pytest.approx(0.9440, abs=5e-5)


def test_squeeze_equals_its_law_beside_the_wall():
    f = filled(wall_functions, 8, 1e-3)
    assert f[FPERP] == pytest.approx(1000 + np.log(1000) / 5 + 0.9713, rel=1e-6)
    assert f[FPAR] == pytest.approx(8 / 15 * np.log(1000) + 0.9588, rel=1e-3)


def test_table_is_of_its_shape():
    for name in ("NEAR", "MIDDLE", "FAR"):
        assert len(getattr(_wall_table, name)) == np.prod(getattr(_wall_table, f"{name}_SHAPE"))


# The sphere


def shear_load(height, gap):
    return filled(wall_shear_load, 6, height, gap, 1.0, 1.0, 1.0)


@pytest.mark.parametrize("sphere", SPHERES, ids=lambda sphere: f"{sphere['gap']:.1e}")
def test_mobility_and_free_motion_of_the_reference(sphere):
    place = (1 + sphere["gap"], sphere["gap"], 1.0, 1.0)
    mobility = filled(wall_mobility, (6, 6), *place)
    bar = 10 * sphere["err"]
    assert matrix_error(mobility, np.array(sphere["M"])) < bar
    velocity = filled(wall_velocity, 6, *place, shear_load(*place[:2]))
    np.testing.assert_allclose(velocity, sphere["V_shear"], rtol=0, atol=bar * place[0])


@pytest.mark.parametrize("eps", [1e-12, 1e-6, 1e-3, 0.1, 1.0, 30.0, 1e12])
def test_mobility_inverts_resistance(eps):
    place = (1 + eps, eps, 1.0, 1.0)
    resistance = filled(wall_resistance, (6, 6), *place)
    product = filled(wall_mobility, (6, 6), *place) @ resistance
    np.testing.assert_allclose(product, np.eye(6), rtol=0, atol=1e-13)


def test_resistance_is_symmetric_positive_definite():
    for eps in EPS_WIDE:
        resistance = filled(wall_resistance, (6, 6), 1 + eps, eps, 1.0, 1.0)
        assert (resistance == resistance.T).all()
        unit = np.sqrt(np.diag(resistance))
        assert np.linalg.eigvalsh(resistance / np.outer(unit, unit)).min() > 0.5


def test_units():
    """A cell of 5 um in water: as the unit sphere, times the powers of radius and viscosity of each block."""
    radius, viscosity, eps = 5e-6, 1e-3, 0.05
    unit = filled(wall_resistance, (6, 6), 1 + eps, eps, 1.0, 1.0)
    power = np.array([0, 0, 0, 1, 1, 1])
    place = (radius * (1 + eps), radius * eps, radius, viscosity)
    cell = filled(wall_resistance, (6, 6), *place)
    np.testing.assert_allclose(cell, unit * viscosity * radius ** (1 + np.add.outer(power, power)), rtol=1e-12)
    load = filled(wall_shear_load, 6, *place, 100.0)
    np.testing.assert_allclose(load, shear_load(1 + eps, eps) * viscosity * 100 * radius ** (2 + power), rtol=1e-12)


def test_lone_cell_in_shear():
    """A cell of 5 um at z = 5.255 um moves with 0.665687934 of the flow there (mpad reference numbers)."""
    place = (5.255e-6, 0.255e-6, 5e-6, 1e-3)
    velocity = filled(wall_velocity, 6, *place, filled(wall_shear_load, 6, *place, 100.0))
    assert velocity[0] / (100 * 5.255e-6) == pytest.approx(0.665687934, abs=1e-9)
    assert velocity[4] > 0


@pytest.mark.parametrize("eps", [1e-5, 5e-4, 1.7e-3, 0.03, 0.4, 0.999, 1.3, 20.0, 500.0])
def test_drift_is_the_slope_of_the_mobility_by_the_series(eps):
    a, eta, share = 1.4, 0.8, 0.01
    steps = share * np.array([-2.0, -1.0, 1.0, 2.0])
    mobility = [1 / float(wall_series(eps * (1 + s))[FPERP]) for s in steps]
    slope = (mobility[0] - 8 * mobility[1] + 8 * mobility[2] - mobility[3]) / (12 * share * eps)
    expected = slope / (6 * np.pi * eta * a * a)
    assert wall_drift(a * eps, a, eta) == pytest.approx(expected, rel=3e-7 if eps < 100 else 1e-4)


@pytest.mark.parametrize("eps", [0.0, -1e-9, np.nan])
def test_no_drift_at_contact(eps):
    assert np.isnan(wall_drift(eps, 1.0, 1.0))
