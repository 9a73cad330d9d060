"""Tables of functions: as good as they say, honest at kinks, zeros and tails, and refused where they cannot follow."""

from typing import Any

import numpy as np
import pytest

from mpad_core.numerics.tables import (
    TableError,
    Tables,
    locate,
    no_tables,
    tabulate,
    together,
    value,
    value_and_slope,
)

ERROR = 1e-6
KINK = 0.3


def kinked(x: Any) -> Any:
    return 1 + 5 * np.abs(x - KINK)


def exploding(x: Any) -> Any:
    return 2 * np.exp(14 * np.abs(x - KINK))


def dying(x: Any) -> Any:
    return np.exp(-40 * x * x)


def stopped(x: Any) -> Any:
    """A rate that ends at the kink by a jump."""
    return np.where(x <= KINK, 3.0 + x, 0.0)


def nothing(x: Any) -> Any:
    return np.zeros_like(x)


FUNCTIONS = [kinked, exploding, dying, stopped, nothing]
EDGES = [0.0, KINK, 1.0]


def made(functions: Any = FUNCTIONS, edges: Any = EDGES, tangents: Any = (0,)) -> Tables:
    return tabulate(functions, edges, error=ERROR, tangents=tangents)


def looked_up(tables: Tables, column: int, x: Any, k: int = 0) -> Any:
    return np.array([value(tables, k, column, float(at)) for at in x])


def relative(found: Any, true: Any) -> float:
    return float(np.max(np.abs(found - true) / np.abs(true)))


@pytest.mark.parametrize("column", [0, 1, 2])
def test_follows_to_the_stated_error(column: int) -> None:
    """The error is measured near its largest values: elsewhere in a cell it is less than twice as large."""
    x = np.concatenate([np.random.default_rng(1).uniform(0, 1, 4000), np.linspace(0, 1, 2001)[:-1]])
    tables = made()
    assert relative(looked_up(tables, column, x), FUNCTIONS[column](x)) < 2 * ERROR


def test_follows_up_to_both_sides_of_a_kink() -> None:
    tables = made()
    for at in (np.nextafter(KINK, 0), KINK, np.nextafter(KINK, 1), KINK - 1e-9, KINK + 1e-9):
        assert value(tables, 0, 0, at) == pytest.approx(float(kinked(at)), rel=ERROR)
        assert value(tables, 0, 1, at) == pytest.approx(float(exploding(at)), rel=ERROR)
    assert value_and_slope(tables, 0, 0, KINK - 1e-9)[1] == pytest.approx(-5, rel=1e-9)
    assert value_and_slope(tables, 0, 0, KINK + 1e-9)[1] == pytest.approx(5, rel=1e-9)


def test_a_jump_stays_on_its_side() -> None:
    tables = made()
    assert value(tables, 0, 3, np.nextafter(KINK, 0)) == pytest.approx(3 + KINK, rel=ERROR)
    assert value(tables, 0, 3, np.nextafter(KINK, 1)) == 0.0


def test_zero_is_exactly_zero() -> None:
    assert (looked_up(made(), 4, np.linspace(-1, 2, 301)) == 0).all()


def test_slope_is_the_derivative() -> None:
    """A cubic is followed without error, and so is its derivative."""
    table = tabulate([lambda x: 2 - x + 3 * x**3], [-1.0, 0.5, 2.0], error=ERROR, tangents=[0])
    for x in np.linspace(-0.99, 1.99, 53):
        found, slope = value_and_slope(table, 0, 0, x)
        assert found == pytest.approx(2 - x + 3 * x**3, rel=1e-13)
        assert slope == pytest.approx(-1 + 9 * x**2, rel=1e-11, abs=1e-11)
        assert found == value(table, 0, 0, x)


def test_beyond_the_ends_tangents_go_on_and_others_stay() -> None:
    tables = made(tangents=(0, 1))
    for x in (-0.7, -1e-12):
        assert value(tables, 0, 0, x) == pytest.approx(2.5 - 5 * x, rel=1e-9)
        assert value_and_slope(tables, 0, 0, x)[1] == pytest.approx(-5)
        assert value(tables, 0, 2, x) == pytest.approx(1.0, rel=1e-9)
        assert value_and_slope(tables, 0, 2, x)[1] == 0
    for x in (1.0, 1.4, 30.0):
        top = 2 * np.exp(14 * 0.7)
        assert value(tables, 0, 0, x) == pytest.approx(4.5 + 5 * (x - 1), rel=1e-9)
        assert value_and_slope(tables, 0, 1, x)[1] == pytest.approx(14 * top, rel=1e-4)
        assert value(tables, 0, 1, x) == pytest.approx(top * (1 + 14 * (x - 1)), rel=1e-4)
        assert value(tables, 0, 2, x) == pytest.approx(np.exp(-40), rel=1e-5)


@pytest.mark.parametrize("column", [0, 1, 2])
def test_continuous_at_both_ends(column: int) -> None:
    tables = made(tangents=(0, 1))
    for end in (0.0, 1.0):
        inside, outside = value(tables, 0, column, end), value(tables, 0, column, np.nextafter(end, 9 * end - 4))
        assert inside == pytest.approx(outside, rel=1e-12)


def test_tables_put_together_give_the_same_bits() -> None:
    several = [
        made([kinked, nothing]),
        made([dying, exploding], [-1.0, 0.0, 0.1, KINK, 0.9]),
        made([nothing, dying], [0.2, 0.4]),
    ]
    whole = together(several, 2)
    for k, single in enumerate(several):
        for x in np.linspace(-2, 2, 401):
            for column in range(2):
                assert value_and_slope(whole, k, column, x) == value_and_slope(single, 0, column, x)


def test_no_tables() -> None:
    none = together([], 3)
    assert none.coefficients.shape == (0, 3, 4)
    assert none.pieces.size == 0
    assert [part.dtype for part in none] == [part.dtype for part in together([made()], 5)]
    assert [part.ndim for part in no_tables(3)] == [part.ndim for part in made()]


def test_every_place_has_a_row() -> None:
    tables = together([made(), made()], 5)
    rows = len(tables.coefficients)
    found = []
    for k in range(2):
        for x in (-1e300, -1.0, 0.0, *np.linspace(0, 1, 999), 1.0, 1e300, np.inf, -np.inf):
            row, _, _ = locate(tables, k, x)
            assert (0 if k == 0 else rows // 2) <= row < (rows // 2 if k == 0 else rows)
            found.append(row)
    assert min(found) == 0
    assert max(found) == rows - 1


@pytest.mark.parametrize("kink", [0.1234567, 0.51, 1 / 3, 0.9999])
def test_a_missing_breakpoint_is_refused(kink: float) -> None:
    """But for a kink that halving cells happens to meet, which does no harm."""
    with pytest.raises(TableError, match="breakpoint"):
        tabulate([lambda x: 1e-9 + np.abs(x - kink)], [0.0, 1.0], error=ERROR, tangents=[0])


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_finite_is_refused(bad: float) -> None:
    with pytest.raises(TableError, match="not followed"), np.errstate(invalid="ignore"):
        tabulate([lambda x: np.where(x > 0.77, bad, 1.0)], [0.0, 1.0], error=ERROR, tangents=[])


@pytest.mark.parametrize("width", [0.03, 0.01, 0.003])
def test_a_narrow_feature_is_not_overlooked(width: float) -> None:
    """A smooth function, no kink in it, whose feature lies between the points of the coarsest table."""
    centre = 0.293

    def peaked(x: Any) -> Any:
        return 1 + np.exp(-(((x - centre) / width) ** 2))

    table = tabulate([peaked], [0.0, 1.0], error=ERROR, tangents=[])
    x = np.linspace(0, 1, 5001)[:-1]
    assert relative(looked_up(table, 0, x), peaked(x)) < 2 * ERROR
