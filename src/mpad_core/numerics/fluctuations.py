r"""Thermal motion asks two things of a mobility M(x): a root B, B·Bᵀ = M, and its divergence ∇·M.

Roots. Few degrees of freedom: Cholesky's factor. Many: Lanczos. In the Krylov space of A and b, with orthonormal basis
V and A's projection T = Vᵀ A V, A^½ b ≈ |b| V T^½ e₁ (Ando, Chow, Saad and Skolnick, J. Chem. Phys. 137 (2012) 064106);
it converges as conjugate gradients do, so with G Gᵀ close to M the root taken is (Chow and Saad, SIAM J. Sci. Comput.
36 (2014) A588)

    B = G (G⁻¹ M G⁻ᵀ)^½,    B·Bᵀ = M,    G = blockdiag(Cholesky factors of the lone spheres' mobilities).

Divergence. Entry i of ∇·M is Σ_j ∂M_ij/∂x_j over the 3N coordinates of the centres; it belongs to the columns of
forces, since the mobility of spheres does not change as they turn. Along a direction w of the 3N-dimensional space, s
the lengths over which M changes and W = w/s,

    [M(x + δ s w) − M(x − δ s w)] W / (2δ)  =  Σ_jk ∂M_ij/∂x_k s_k w_k w_j/s_j + O(δ²).

Summed over the unit vectors w it is the divergence; for independent w of mean 0 and variance 1 its mean is (Delong,
Balboa Usabiaga and Donev, J. Chem. Phys. 140 (2014) 134110; Sprinkle, Balboa Usabiaga, Patankar and Donev, J. Chem.
Phys. 147 (2017) 244103). Any consistent units.
"""

from collections.abc import Callable

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array

Operator = Callable[[Array], Array]
ProductAt = Callable[[Array, Array], Array]

STEP = 1e-3
"""Of the room to move: δ² = 1e-6 is left out, and a product that is good to ε gives the divergence to ε/δ."""


@frozen(kw_only=True, eq=False)
class Root:
    """A root of an operator times a vector; ``change``: relative, by the last of so many ``products``."""

    x: Array
    change: float
    products: int


def _root_of_projection(diagonal: Array, beside: Array) -> Array:
    """Give the first column of the root of the symmetric tridiagonal matrix."""
    from scipy.linalg import eigh_tridiagonal

    values, vectors = eigh_tridiagonal(diagonal, beside)
    column: Array = vectors @ (np.sqrt(np.maximum(values, 0.0)) * vectors[0])
    return column


def lanczos_root(apply: Operator, b: Array, *, tolerance: float, most: int = 200) -> Root:
    """Give A^½ b for a symmetric positive definite A that is known by its products.

    Parameters
    ----------
    apply
        The product with A: (n,) to (n,).
    b : (n,)
        What the root is multiplied with.
    tolerance
        On the relative 2-norm by which one more product changes the answer.
    most
        Products after which to give up; the caller must look at ``change``.
    """
    norm = float(np.linalg.norm(b))
    if norm == 0.0:
        return Root(x=np.zeros_like(b), change=0.0, products=0)
    most = min(most, b.size)
    basis = np.empty((most + 1, b.size))
    basis[0] = b / norm
    diagonal, beside = np.zeros(most), np.zeros(most)
    last, change, used = np.zeros(0), np.inf, 0
    while used < most and change > tolerance:
        image = apply(basis[used])
        diagonal[used] = basis[used] @ image
        for _ in range(2):  # against all vectors, twice: the three-term recursion loses orthogonality
            image = image - (basis[: used + 1] @ image) @ basis[: used + 1]
        beside[used] = np.linalg.norm(image)
        used += 1
        column = _root_of_projection(diagonal[:used], beside[: used - 1])
        change = float(np.linalg.norm(column - np.append(last, 0.0)) / np.linalg.norm(column))
        last = column
        if used == b.size or beside[used - 1] <= 1e-14 * diagonal[:used].max():  # the space is invariant
            change = 0.0
            break
        basis[used] = image / beside[used - 1]
    return Root(x=norm * (last @ basis[:used]), change=change, products=used)


def _in_columns(noise: Array) -> Array:
    """Give noise (N, 6) or (N, 6, k) as (k, N, 6)."""
    columns = np.asarray(noise, dtype=np.float64).reshape(*np.shape(noise)[:2], -1)
    return np.ascontiguousarray(np.moveaxis(columns, 2, 0))


def dense_root(mobility: Array, noise: Array) -> Array:
    """Give Cholesky's factor of a mobility (6N, 6N) times noise (N, 6) or (N, 6, k), in the noise's shape.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the mobility is not positive definite.
    """
    flat = np.asarray(noise, dtype=np.float64).reshape(len(mobility), -1)
    return np.asarray(np.linalg.cholesky(mobility) @ flat).reshape(np.shape(noise))


def preconditioned_root(apply: Operator, lone: Array, noise: Array, *, tolerance: float) -> Root:
    """Give B·noise, with B = G (G⁻¹ M G⁻ᵀ)^½ as the module's text says.

    Parameters
    ----------
    apply
        The product with M: (N, 6) to (N, 6).
    lone : (N, 6, 6)
        Symmetric positive definite blocks near those on M's diagonal.
    noise : (N, 6) or (N, 6, k)
        What B is multiplied with.
    tolerance
        As for `lanczos_root`.

    Returns
    -------
    Root
        ``x`` in the noise's shape; the worst change and the most products of all columns.
    """
    factors = np.linalg.cholesky(lone)
    inverses = np.linalg.inv(factors)
    columns = _in_columns(noise)

    def whitened(v: Array) -> Array:
        load = np.einsum("nji,nj->ni", inverses, v.reshape(-1, 6))
        return np.asarray(np.einsum("nij,nj->ni", inverses, apply(load))).ravel()

    roots = [lanczos_root(whitened, column.ravel(), tolerance=tolerance) for column in columns]
    found = np.stack([np.einsum("nij,nj->ni", factors, root.x.reshape(-1, 6)) for root in roots], axis=2)
    worst, most = max(root.change for root in roots), max(root.products for root in roots)
    return Root(x=found.reshape(np.shape(noise)), change=worst, products=most)


def room_to_move(centres: Array, radii: Array, wall_gaps: Array | None) -> Array:
    """Give the length (N,) over which each sphere's mobility changes: the least of its radius and its gaps.

    Parameters
    ----------
    centres, radii : (N, 3), (N,)
        Where the spheres are; those that overlap count by how deep they do.
    wall_gaps : (N,) or None
        Gaps to the wall; None if there is no wall.
    """
    room = np.array(radii, dtype=np.float64)
    if len(radii) > 1:
        gaps = np.linalg.norm(centres[:, None] - centres[None], axis=2) - radii[:, None] - radii[None]
        np.fill_diagonal(gaps, np.inf)
        room = np.minimum(room, np.abs(gaps).min(axis=1))
    if wall_gaps is not None:
        room = np.minimum(room, np.minimum(np.abs(wall_gaps), centres[:, 2]))
    return np.maximum(room, 1e-9 * np.asarray(radii))


def divergence(product_at: ProductAt, room: Array, noise: Array | None = None, *, share: float = STEP) -> Array:
    """Give ∇·M (N, 6), or an unbiased estimate of it; the module's text says how.

    Parameters
    ----------
    product_at
        Of displacements (N, 3) and loads (N, 6): M there times the loads, (N, 6).
    room : (N,)
        From `room_to_move`.
    noise : (N, 3), optional
        Independent numbers of mean 0 and variance 1: one random difference, two products instead of 6N.
    share
        δ, of the room.
    """
    directions = np.eye(3 * len(room)).reshape(-1, len(room), 3) if noise is None else np.asarray(noise)[None]
    total = np.zeros((len(room), 6))
    for w in directions:
        shift = share * room[:, None] * w
        loads = np.zeros((len(room), 6))
        loads[:, :3] = w / room[:, None]
        total += (product_at(shift, loads) - product_at(-shift, loads)) / (2 * share)
    return total
