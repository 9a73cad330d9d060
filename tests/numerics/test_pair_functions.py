"""The two-sphere functions: exact series against other solutions and limits, and the look-up against the series."""

import json
from pathlib import Path

import numpy as np
import pytest

from mpad_core.numerics import pair_series
from mpad_core.numerics.pair_functions import (
    FARTHEST,
    NEAREST,
    PairFunctions,
    _lubrication,
    pair_resistance,
    pair_strain_load,
)
from mpad_core.numerics.wall_functions import FPAR, FPERP, FROT, FSHEAR, TROT, TSHEAR, TSPIN, wall_functions

REFERENCE = json.loads((Path(__file__).parents[1] / "data" / "pair_reference.json").read_text())["pairs"]
PEERS = Path(__file__).parents[2].parent / "shared" / "peer_refs" / "lamb_two_spheres.json"
RATIOS = (1.0, 0.5, 0.1, 0.01)
Z = np.array([0.0, 0.0, 1.0])
SLANTED = np.array([2.0, -3.0, 6.0]) / 7
STRAIN = np.array([[0.3, 0.2, -0.5], [0.2, -0.7, 0.1], [-0.5, 0.1, 0.4]])


def series(ratio, eps):
    return pair_series.pair_series(ratio, eps)


def resistance(f, ratio, e=Z, a=1.0, viscosity=1.0):
    out = np.full((12, 12), np.nan)
    pair_resistance(f, e, a, ratio * a, viscosity, out)
    return out


def strain_load(f, strain, e=Z, a=1.0, viscosity=1.0):
    out = np.full(12, np.nan)
    pair_strain_load(f, e, a, viscosity, strain, out)
    return out


def mobility(matrix):
    """Invert, scaled: entries differ by the cube of the ratio of radii."""
    unit = 1 / np.sqrt(np.diag(matrix))
    return np.outer(unit, unit) * np.linalg.inv(matrix * np.outer(unit, unit))


def energy_error(got, wanted):
    """Largest |eigenvalue| of wanted^-1/2 (got - wanted) wanted^-1/2."""
    unit = 1 / np.sqrt(np.diag(wanted))
    values, vectors = np.linalg.eigh(wanted * np.outer(unit, unit))
    root = vectors / np.sqrt(values)
    return np.abs(np.linalg.eigvalsh(root.T @ ((got - wanted) * np.outer(unit, unit)) @ root)).max()


def reduced_gap(gap, a, b):
    return gap * (a + b) / (2 * a * b)


def distance(ratio, eps):
    return 1 + ratio + 2 * ratio * eps / (1 + ratio)


# The series


@pytest.mark.parametrize("pair", REFERENCE, ids=lambda pair: pair["id"])
def test_mobility_of_the_reference(pair):
    a, b = pair["a"]
    f = series(b / a, reduced_gap(pair["gap12"], a, b))
    got = mobility(resistance(f, b / a, np.array(pair["direction"]), a))
    wanted = np.array(pair["M"])
    assert energy_error(got, (wanted + wanted.T) / 2) < 3 * pair["err"]


@pytest.mark.parametrize("pair", REFERENCE, ids=lambda pair: pair["id"])
def test_free_motion_in_shear_of_the_reference(pair):
    a, b = pair["a"]
    e = np.array(pair["direction"])
    f = series(b / a, reduced_gap(pair["gap12"], a, b))
    flow = np.zeros(12)
    flow[[4, 10]] = 0.5
    flow[6] = (a + b + pair["gap12"]) * e[2]
    strain = np.array([[0, 0, 0.5], [0, 0, 0], [0.5, 0, 0]])
    velocity = flow + mobility(resistance(f, b / a, e, a)) @ strain_load(f, strain, e, a)
    np.testing.assert_allclose(velocity, pair["V_shear"], rtol=0, atol=3 * pair["err"])


def lamb_rows():
    return json.loads(PEERS.read_text())["rows"] if PEERS.is_file() else []


def lamb_motion(row):
    """Give (12,) by our solution: sphere 1 at the origin, sphere 2 at positive x, each case as the file has it."""
    radii, case = [row["r1"], row["r2"]], row["case"]
    a, b, first = max(radii), min(radii), int(np.argmax(radii))
    e = np.array([1.0 - 2 * first, 0.0, 0.0])
    f = series(b / a, reduced_gap((row["s_prime"] - 2) * (a + b) / 2, a, b))
    load, strain = np.zeros(12), np.zeros((3, 3))
    if case[0] == "E":  # less the ambient flow, in the opposite of a unit strain
        strain = {"E1": np.diag([1, -0.5, -0.5]), "E4": np.eye(3)[[1, 0, 2]] - np.diag([0, 0, 1])}.get(case, strain)
        load = -strain_load(f, strain, e, a)
    else:
        load[6 * ((int(case[1]) - 1) ^ first) + 3 * (case[0] == "T") + int(case[2]) - 1] = 1
    matrix = resistance(f, b / a, e, a)
    return np.roll(mobility(matrix) @ load, 6 * first), np.roll(1 / np.sqrt(np.diag(matrix)), 6 * first), load


@pytest.mark.skipif(not PEERS.is_file(), reason=f"no reference numbers beside the clone: {PEERS}")
def test_lamb_solution_of_another_code():
    """All forces, torques and strains of both spheres, size ratios 1 and 10, printed to 7 digits."""
    worst = 0.0
    for row in lamb_rows():
        values = row["values"]
        wanted = np.array(values[0:3] + values[6:9] + values[3:6] + values[9:12])
        got, unit, load = lamb_motion(row)
        size = unit * (
            unit.min() if row["case"][0] == "E" else np.roll(unit, 6 * (row["r1"] < row["r2"]))[load != 0][0]
        )
        worst = max(worst, np.abs((got - wanted) / size).max())
    assert worst < 5e-5


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("eps", [1e-5, 1e-3, 0.3, 100.0])
def test_series_is_reciprocal(ratio, eps):
    _, along, across = pair_series.loads(ratio, eps)
    scale = 6 * np.pi * np.array([1, ratio, 4 / 3, 4 / 3 * ratio**3])
    unit = np.sqrt(np.outer(scale, scale)) * max(1, np.log(1 / eps))
    assert np.abs((across[:4] - across[:4].T) / unit).max() < 1e-15 / eps + 1e-14
    squeeze = pair_series.squeeze_amplitude(ratio) / eps
    assert along[1, 0] == pytest.approx(along[0, 1] - along[1, 1], abs=(squeeze + 1) * 1e-13)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("eps", [1e-4, 0.1, 1e4])
def test_series_has_converged(ratio, eps, monkeypatch):
    short = series(ratio, eps)
    monkeypatch.setattr(pair_series, "REACH", 1.5 * pair_series.REACH)
    assert energy_error(resistance(short, ratio), resistance(series(ratio, eps), ratio)) < 1e-15 / eps + 1e-13


@pytest.mark.parametrize("eps", [1e-6, 1e-3, 0.1, 30.0])
def test_equal_spheres_may_be_exchanged(eps):
    f = series(1.0, eps)
    exchanged = [2, 1, 0, 5, 4, 3, 10, 7, 12, 11, 6, 9, 8, 15, 14, 13, 17, 16, 19, 18, 21, 20]
    sign = np.ones(22)
    sign[[8, 9, 11, 12, 16, 17, 18, 19]] = -1
    np.testing.assert_allclose(f, sign * f[exchanged], rtol=1e-9, atol=1e-10)


def test_far_apart():
    """First reflections of Stokeslet, rotlet and stresslet with Faxen's laws (Kim & Karrila 1991, chapter 8)."""
    ratio, eps = 0.5, 3e4
    f, r = series(ratio, eps), distance(ratio, eps)
    drag, torque, cube = 6 * np.pi, 8 * np.pi, ratio**3
    leading = {
        0: drag, 1: -1.5 * drag * ratio / r, 2: drag * ratio,
        3: torque, 4: -torque * cube / r**3, 5: torque * cube,
        6: drag, 7: -0.75 * drag * ratio / r, 9: drag * cube / r**2, 10: drag * ratio, 11: -drag * ratio / r**2,
        13: torque, 14: torque * cube / 2 / r**3, 15: torque * cube,
        16: 2.5 * drag * cube / r**2, 17: -2.5 * drag * ratio / r**2,
        18: drag * (ratio**5 + 5 / 3 * cube) / r**4, 19: -drag * ratio * (1 + 5 / 3 * ratio**2) / r**4,
        20: 2.5 * torque * cube / r**3, 21: 2.5 * torque * cube / r**3,
    }  # fmt: skip
    np.testing.assert_allclose(f[list(leading)], list(leading.values()), rtol=10 / r)


@pytest.mark.parametrize("ratio", [1.0, 0.5, 0.1])
def test_lubrication_logarithms(ratio):
    """Factors of ln(1/eps) from Jeffrey & Onishi (1984): g2 of X^A, Y^A, Y^B, Y^C; none of X^C and of rigid motion."""
    constant, logarithm, *_ = _lubrication(ratio)
    one = 1 + ratio
    force, torque = 6 * np.pi, 8 * np.pi
    wanted = np.zeros(22)
    wanted[1] = force * ratio * (1 + 7 * ratio + ratio**2) / (5 * one**3)
    wanted[6] = wanted[10] = force * 4 * ratio * (2 + ratio + 2 * ratio**2) / (15 * one**3)
    wanted[7] = -wanted[6]
    wanted[8] = 4 * np.pi * ratio * (4 + ratio) / (5 * one**2)
    wanted[12] = -4 * np.pi * ratio**2 * (1 + 4 * ratio) / (5 * one**2)
    wanted[9], wanted[11] = -wanted[12], -wanted[8]
    wanted[13] = torque * 2 * ratio / (5 * one)
    wanted[14], wanted[15] = wanted[13] * ratio / 4, wanted[13] * ratio**2
    np.testing.assert_allclose(logarithm[:16], wanted[:16], rtol=0, atol=1e-6)
    assert np.abs(constant).max() < 100


def test_lubrication_constants_of_equal_spheres():
    """Constants of X^A, Y^A, Y^B, X^C, Y^C as tabulated by Jeffrey & Onishi (1984) and Kim & Karrila (1991, 11.4)."""
    constant = _lubrication(1.0)[0]
    force, cross, torque = 6 * np.pi, 4 * np.pi, 8 * np.pi
    zeta_of_3 = 1.2020569031595942
    assert constant[1] / force == pytest.approx(0.9954, abs=5e-5)
    assert constant[0] / force == pytest.approx(0.9954 - 0.3502, abs=1e-4)
    assert constant[[6, 7]] / force == pytest.approx([0.9983, -0.2737], abs=5e-5)
    assert constant[[8, 9]] / cross == pytest.approx([-0.2390, -0.0017], abs=5e-5)
    assert constant[[3, 4]] / torque == pytest.approx([7 / 8 * zeta_of_3, -zeta_of_3 / 8], abs=1e-9)
    assert constant[[13, 14]] / torque == pytest.approx([0.7028, -0.0274], abs=1e-4)


@pytest.mark.parametrize("eps_wall", [1e-4, 0.01, 0.5])
def test_beside_a_huge_sphere_as_beside_a_wall(eps_wall):
    """Sphere 2 as beside a plane, but for terms of the order of the ratio, which are taken out by extrapolation."""
    wall = np.empty(8)
    wall_functions(eps_wall, wall)
    relative = []
    for ratio in (2e-4, 1e-4):
        eps = eps_wall * (1 + ratio) / 2
        f = series(ratio, eps)
        drag, height = 6 * np.pi * ratio, ratio * (1 + eps_wall)
        got = [
            f[2] / (drag * wall[FPERP]),
            f[10] / (drag * wall[FPAR]),
            f[15] / (8 * np.pi * ratio**3 * wall[TROT]),
            f[5] / (8 * np.pi * ratio**3 * wall[TSPIN]),
            -f[12] / (drag * ratio * wall[FROT]),
            # at the pole of a sphere held in the strain (z, 0, x) the flow is a shear of rate 5
            (f[10] * distance(ratio, eps) + f[19]) / (drag * height * 5 * wall[FSHEAR]),
            (f[12] * distance(ratio, eps) + f[21]) / (4 * np.pi * ratio**3 * 5 * wall[TSHEAR]),
        ]
        relative.append(np.array(got))
    np.testing.assert_allclose(relative[1], 1, rtol=3e-3)
    np.testing.assert_allclose(2 * relative[1] - relative[0], 1, rtol=2e-6)


@pytest.mark.parametrize("ratio", [0.0, -0.5, 1.1, np.nan])
def test_ratio_out_of_range_is_refused(ratio):
    with pytest.raises(ValueError, match=r"must be in \(0, 1\], got"):
        series(ratio, 0.1)
    with pytest.raises(ValueError, match=r"must be in \(0, 1\], got"):
        PairFunctions(ratio)


def test_series_refuses_an_overlap():
    with pytest.raises(ValueError, match=r"positive, got -0\.1"):
        series(1.0, -0.1)


# The look-up


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize(
    ("low", "high", "bar"), [(1e-6, 1e-4, 3e-10), (1e-4, 1e-2, 1e-10), (1e-2, 1.0, 1e-10), (1.0, 1e3, 1e-10)]
)
def test_look_up_equals_the_series(ratio, low, high, bar):
    look_up = PairFunctions.of(ratio)
    for eps in np.geomspace(low, high, 14):
        got, wanted = look_up(eps), series(ratio, eps)
        matrix = resistance(wanted, ratio, SLANTED)
        assert energy_error(resistance(got, ratio, SLANTED), matrix) < bar
        slip = mobility(matrix) @ strain_load(got - wanted, STRAIN, SLANTED)
        slip[6:9] /= ratio  # rates of strain times radius are the unit
        assert np.abs(slip).max() < bar


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("octave", [NEAREST, -10, -3, 0, 4, 10])
def test_look_up_is_continuous_between_its_pieces(ratio, octave):
    look_up = PairFunctions.of(ratio)
    below, above = look_up(np.nextafter(2.0**octave, 0)), look_up(2.0**octave)
    matrix = resistance(above, ratio)
    assert energy_error(resistance(below, ratio), matrix) < 1e-10 + 1e-15 / 2.0**octave
    slip = mobility(matrix) @ strain_load(above - below, STRAIN)
    assert np.abs(slip / np.repeat([1, ratio], 6)).max() < 1e-8


@pytest.mark.parametrize("ratio", RATIOS)
def test_below_the_last_octave_the_lubrication_form_goes_on(ratio):
    for eps in (9e-7, 3e-7, 1e-7):
        error = energy_error(resistance(PairFunctions.of(ratio)(eps), ratio), resistance(series(ratio, eps), ratio))
        assert error < 2e-15 / eps


@pytest.mark.parametrize("ratio", [1.0, 0.1])
def test_very_far_spheres_are_alone(ratio):
    wanted = np.zeros(22)
    wanted[[0, 6]], wanted[[2, 10]] = 6 * np.pi, 6 * np.pi * ratio
    wanted[[3, 13]], wanted[[5, 15]] = 8 * np.pi, 8 * np.pi * ratio**3
    for eps in (np.nextafter(2.0**FARTHEST, 0), 2.0**FARTHEST, np.inf):
        np.testing.assert_allclose(PairFunctions.of(ratio)(eps), wanted, rtol=1e-11, atol=1e-10)


def test_order_of_asking_does_not_matter():
    eps = np.geomspace(1e-3, 10, 12)
    forwards, backwards = PairFunctions(0.7), PairFunctions(0.7)
    one = [forwards(e) for e in eps]
    two = [backwards(e) for e in eps[::-1]][::-1]
    assert (np.array(one) == np.array(two)).all()


def test_shared_by_ratio():
    assert PairFunctions.of(0.25) is PairFunctions.of(0.25)
    assert repr(PairFunctions.of(0.25)) == "PairFunctions(0.25)"


@pytest.mark.parametrize("eps", [0.0, -1e-3, np.nan])
def test_no_gap_gives_no_number(eps):
    assert np.isnan(PairFunctions.of(1.0)(eps)).all()


# The matrix


@pytest.mark.parametrize("ratio", RATIOS)
def test_resistance_is_symmetric_positive_definite(ratio):
    for eps in np.geomspace(1e-8, 1e10, 37):
        matrix = resistance(PairFunctions.of(ratio)(eps), ratio, SLANTED)
        np.testing.assert_array_equal(matrix, matrix.T)
        unit = 1 / np.sqrt(np.diag(matrix))
        assert np.linalg.eigvalsh(matrix * np.outer(unit, unit)).min() > 0.5 * min(eps, 1)


def test_matrix_turns_with_the_pair():
    f = series(0.3, 0.02)
    turn = 2 * np.outer(Z + SLANTED, Z + SLANTED) / (2 + 2 * Z @ SLANTED) - np.eye(3)  # half a turn takes z to e
    whole = np.kron(np.eye(4), turn)
    np.testing.assert_allclose(resistance(f, 0.3, SLANTED), whole @ resistance(f, 0.3) @ whole.T, rtol=0, atol=1e-10)
    turned = strain_load(f, turn @ STRAIN @ turn.T, SLANTED)
    np.testing.assert_allclose(turned, whole @ strain_load(f, STRAIN), rtol=0, atol=1e-10)


def test_signs_across_the_line():
    """Spheres on z: pulling sphere 1 along x drags sphere 2 along and turns it about -y (the far side lags)."""
    motion = mobility(resistance(series(1.0, 1.0), 1.0)) @ np.eye(12)[0]
    assert motion[6] > 0
    assert motion[10] < 0


def test_units():
    """Cells of 5 and 2 um in water: as spheres of radius 1 and 0.4, times the powers of radius and viscosity."""
    f, radius, viscosity = series(0.4, 0.05), 5e-6, 1e-3
    power = np.tile([0, 0, 0, 1, 1, 1], 2)
    unit = viscosity * radius ** (1 + np.add.outer(power, power))
    cell = resistance(f, 0.4, SLANTED, radius, viscosity)
    np.testing.assert_allclose(cell, resistance(f, 0.4, SLANTED) * unit, rtol=1e-12)
    load = strain_load(f, 100 * STRAIN, SLANTED, radius, viscosity)
    np.testing.assert_allclose(
        load, strain_load(f, STRAIN, SLANTED) * viscosity * 100 * radius ** (2 + power), rtol=1e-12
    )
