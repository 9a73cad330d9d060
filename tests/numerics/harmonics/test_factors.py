"""Solves with a definite matrix of blocks: dense inverse and sparse factors agree with numpy."""

import numpy as np
import pytest

from mpad_core.numerics.harmonics import factors
from mpad_core.numerics.harmonics.factors import Blocks, factored, solve_factored


def blocks(count, pairs, seed):
    """Give random definite blocks of spheres and pairs, scaled by up to 1e6, as a squeezed gap does."""
    rng = np.random.default_rng(seed)

    def definite(size):
        root = rng.normal(size=(size, size))
        return root @ root.T * 10 ** rng.uniform(-2, 4) + 0.1 * np.eye(size)

    who = np.array([rng.choice(count, 2, replace=False) for _ in range(pairs)], dtype=np.int64).reshape(-1, 2)
    diagonal = np.array([definite(6) for _ in range(count)])
    return Blocks(diagonal, who, np.array([definite(12) for _ in range(pairs)]).reshape(-1, 12, 12))


def matrix_of(given):
    out = np.zeros((6 * len(given.diagonal),) * 2)
    for i, block in enumerate(given.diagonal):
        out[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] += block
    for (i, j), block in zip(given.who, given.added, strict=True):
        at = np.r_[6 * i : 6 * i + 6, 6 * j : 6 * j + 6]
        out[np.ix_(at, at)] += block
    return out


@pytest.mark.parametrize("dense", [0, 10**6], ids=["sparse", "dense"])
@pytest.mark.parametrize(("count", "pairs"), [(1, 0), (2, 1), (9, 14), (40, 60), (40, 400)])
def test_solves(monkeypatch, dense, count, pairs):
    monkeypatch.setattr(factors, "DENSE", dense)
    given = blocks(count, pairs, count + pairs)
    true = matrix_of(given)
    b = np.random.default_rng(1).normal(size=6 * count)
    found, made = np.empty_like(b), factored(given)
    assert (len(made.inverse) > 0) == (dense > 0)
    solve_factored(made, b, found)
    scale = np.sqrt(np.diag(true))  # the digits of Cholesky do not know of the scale of rows
    assert found * scale == pytest.approx(np.linalg.solve(true / np.outer(scale, scale), b / scale), rel=1e-8)


@pytest.mark.parametrize("dense", [0, 10**6], ids=["sparse", "dense"])
def test_says_when_a_matrix_is_not_definite(monkeypatch, dense):
    monkeypatch.setattr(factors, "DENSE", dense)
    given = blocks(5, 6, 3)
    given.diagonal[3] -= 2 * np.linalg.eigvalsh(matrix_of(given))[-1] * np.eye(6)
    with pytest.raises(FloatingPointError, match="not positive definite"):
        factored(given)
