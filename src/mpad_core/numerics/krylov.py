"""A linear solver that knows its matrix only by its products: GMRES, for operators close to the identity.

Saad and Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856. Preconditioning is the caller's: hand over the operator and
the right-hand side of the system that is close to the identity.
"""

from collections.abc import Callable

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array

Operator = Callable[[Array], Array]


@frozen(kw_only=True, eq=False)
class Solution:
    """What GMRES found: ``residual`` is |b - A x| / |b| as the recursion knows it; ``products`` counts those with A."""

    x: Array
    residual: float
    products: int


@frozen(kw_only=True, eq=False)
class _Basis:
    """The Krylov basis (rows) and A's projection on it, triangular by rotations; the first `used` rows count."""

    vectors: Array
    triangle: Array
    rotations: Array
    right: Array  # the residual in the rotated basis; its last entry is the residual's norm


def _started(residual: Array, norm: float, length: int) -> _Basis:
    vectors = np.empty((length + 1, residual.size))
    vectors[0] = residual / norm
    right = np.zeros(length + 1)
    right[0] = norm
    return _Basis(vectors=vectors, triangle=np.zeros((length, length)), rotations=np.zeros((length, 2)), right=right)


def _extend(basis: _Basis, k: int, image: Array) -> None:
    """Add A v_k, made orthogonal twice (one pass loses digits), and rotate its projection into the triangle."""
    known = basis.vectors[: k + 1]
    column = known @ image
    image = image - column @ known
    again = known @ image
    image -= again @ known
    column += again
    below = float(np.linalg.norm(image))
    for i, (c, s) in enumerate(basis.rotations[:k]):
        column[i], column[i + 1] = c * column[i] + s * column[i + 1], c * column[i + 1] - s * column[i]
    length = float(np.hypot(column[k], below))
    c, s = (column[k] / length, below / length) if length > 0 else (0.0, 1.0)  # A v = 0 helps nothing
    column[k] = length
    basis.rotations[k] = c, s
    basis.triangle[: k + 1, k] = column
    basis.right[k + 1] = -s * basis.right[k]
    basis.right[k] *= c
    basis.vectors[k + 1] = image / below if below > 0 else 0.0


def _combined(basis: _Basis, used: int) -> Array:
    weights = np.zeros(used)
    for i in range(used - 1, -1, -1):
        left = basis.right[i] - basis.triangle[i, i + 1 : used] @ weights[i + 1 :]
        weights[i] = left / basis.triangle[i, i] if basis.triangle[i, i] != 0 else 0.0
    return weights @ basis.vectors[:used]


def _cycle(apply: Operator, residual: Array, goal: float, length: int) -> tuple[Array, float, int]:
    """Give one cycle's correction, the norm of the residual it leaves, and the number of products."""
    basis = _started(residual, float(np.linalg.norm(residual)), length)
    used = 0
    while used < length and abs(basis.right[used]) > goal:
        _extend(basis, used, apply(basis.vectors[used]))
        used += 1
    return _combined(basis, used), float(abs(basis.right[used])), used


def gmres(
    apply: Operator,
    b: Array,
    *,
    start: Array | None = None,
    tolerance: float = 1e-10,
    restart: int = 40,
    most: int = 400,
) -> Solution:
    """Solve A x = b.

    Parameters
    ----------
    apply
        The product with A: (n,) to (n,).
    b : (n,)
        Right-hand side.
    start : (n,), optional
        First guess; it changes the work, and the answer by no more than the tolerance.
    tolerance
        On |b - A x| / |b|.
    restart
        Length of a cycle, that is the number of vectors kept.
    most
        Products after which to give up; the caller must look at ``residual``.

    Returns
    -------
    Solution
    """
    scale = float(np.linalg.norm(b))
    if scale == 0.0:
        return Solution(x=np.zeros_like(b), residual=0.0, products=0)
    x = np.zeros_like(b) if start is None else start.copy()
    residual = b.copy() if start is None else b - apply(x)
    products = 0 if start is None else 1
    norm = float(np.linalg.norm(residual))
    while norm > tolerance * scale and products < most:
        correction, expected, used = _cycle(apply, residual, tolerance * scale, restart)
        x += correction
        products += used
        if expected <= tolerance * scale:  # the recursion's residual is the true one, for a basis orthogonalised twice
            return Solution(x=x, residual=expected / scale, products=products)
        residual = b - apply(x)
        products += 1
        norm = float(np.linalg.norm(residual))
    return Solution(x=x, residual=norm / scale, products=products)
