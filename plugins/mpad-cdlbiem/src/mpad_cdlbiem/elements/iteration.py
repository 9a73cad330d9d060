"""Solving for the density of many right-hand sides at once: least residuals (GMRES), or successive substitution."""

from collections.abc import Callable

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array

DEPENDENT = 1e-10  # singular values, over the largest, of directions that add nothing to those there are
MOST = 200  # products with the operator by GMRES; it takes 5 to 30
MOST_PICARD = 2000  # substitutions; it takes 20 to 60


@frozen(kw_only=True, eq=False)
class Solved:
    """Densities, a column for each right-hand side; and the largest residual over the columns, relative."""

    density: Array
    iterations: int
    residual: float


def _norms(columns: Array) -> Array:
    norms = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    return np.asarray(np.where(norms > 0, norms, 1.0))


def gmres(operator: Array, right: Array, start: Array, tolerance: float) -> Solved:
    """Make the residuals of all columns least over one space, to which each step adds all residuals there are.

    Block GMRES (Saad, Iterative Methods for Sparse Linear Systems, 2nd ed., §6.12) in the form of conjugate residuals:
    `images` is an orthonormal basis of the operator times `space`.

    Parameters
    ----------
    operator : (n, n)
    right, start : (n, k)
    tolerance
        On the norm of each column of the residual over that of `right`.
    """
    scale, density = _norms(right), start.copy()
    residual = right - operator @ density
    space, images = np.empty((len(right), 0)), np.empty((len(right), 0))
    iterations = 0
    while (worst := float((_norms_or_zero(residual) / scale).max())) > tolerance and iterations < MOST:
        new = residual / _norms(residual)
        space, images, added = _extended(space, images, new, operator @ new)
        weights = images[:, -added:].T @ residual
        density += space[:, -added:] @ weights
        residual -= images[:, -added:] @ weights
        iterations += 1
    return Solved(density=density, iterations=iterations, residual=worst)


def _norms_or_zero(columns: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("ij,ij->j", columns, columns)))


def _extended(space: Array, images: Array, new: Array, image: Array) -> tuple[Array, Array, int]:
    """Add directions to the space and their images, orthonormal, to the images; tell how many there were to add."""
    for _ in range(2):  # one pass loses digits
        overlap = images.T @ image
        image, new = image - images @ overlap, new - space @ overlap
    basis, sizes, turned = np.linalg.svd(image, full_matrices=False)
    kept = int((sizes > DEPENDENT * sizes[0]).sum())
    new = new @ (turned[:kept].T / sizes[:kept])
    return np.hstack([space, new]), np.hstack([images, basis[:, :kept]]), kept


def picard(operator: Array, right: Array, start: Array, tolerance: float) -> Solved:
    """Substitute, q <- right - (operator - 1) q; it converges if the spectral radius of operator - 1 is below 1.

    The parameters are those of `gmres`.
    """
    scale, density, iterations = _norms(right), start.copy(), 0
    while True:
        residual = right - operator @ density
        worst = float((_norms_or_zero(residual) / scale).max())
        if not tolerance < worst < 1e10 or iterations == MOST_PICARD:
            return Solved(density=density, iterations=iterations, residual=worst)
        density += residual
        iterations += 1


def direct(operator: Array, right: Array, start: Array, tolerance: float) -> Solved:
    """Eliminate; `start` and `tolerance` do not matter. For all loads of few spheres it is the fastest."""
    return Solved(density=np.asarray(np.linalg.solve(operator, right)), iterations=0, residual=0.0)


Iteration = Callable[[Array, Array, Array, float], Solved]
ITERATIONS: dict[str, Iteration] = {"gmres": gmres, "picard": picard, "direct": direct}
