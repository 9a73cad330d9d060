"""GMRES against dense solves."""

import numpy as np
import pytest

from mpad_core.numerics.krylov import gmres


def system(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return np.eye(n) + 0.5 * rng.normal(size=(n, n)) / np.sqrt(n), rng.normal(size=n)


@pytest.mark.parametrize("restart", [7, 40])
def test_solves(restart: int) -> None:
    matrix, b = system(120, 1)
    found = gmres(lambda v: matrix @ v, b, tolerance=1e-11, restart=restart)
    assert found.residual <= 1e-11
    assert np.linalg.norm(matrix @ found.x - b) < 2e-11 * np.linalg.norm(b)
    assert found.x == pytest.approx(np.linalg.solve(matrix, b), abs=1e-9)


def test_counts_its_products() -> None:
    matrix, b = system(50, 2)
    count = 0

    def apply(v: np.ndarray) -> np.ndarray:
        nonlocal count
        count += 1
        return matrix @ v

    assert gmres(apply, b, start=b, restart=10).products == count


def test_warm_start_changes_the_work_not_the_answer() -> None:
    matrix, b = system(80, 3)
    cold = gmres(lambda v: matrix @ v, b)
    warm = gmres(lambda v: matrix @ v, b, start=cold.x * (1 + 1e-6))
    assert warm.products < cold.products
    assert warm.x == pytest.approx(cold.x, abs=1e-8)
    assert gmres(lambda v: matrix @ v, b, start=cold.x).products <= 2


def test_identity_takes_one_product_and_nothing_none() -> None:
    b = np.arange(5.0)
    assert gmres(lambda v: v, b).products == 1
    assert (gmres(lambda v: v, 0 * b).x == 0).all()


def test_says_when_it_has_not_converged() -> None:
    turn = np.roll(np.eye(60), 1, axis=0)  # GMRES makes no headway on a shift until the last vector
    found = gmres(lambda v: turn @ v, np.eye(60)[0], restart=20, most=50)
    assert found.residual > 0.1


def test_singular_system_does_not_give_nan() -> None:
    found = gmres(lambda v: 0 * v, np.ones(3), restart=2, most=4)
    assert np.isfinite(found.x).all()
    assert found.residual == 1.0
