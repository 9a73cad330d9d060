r"""Where the coefficients of a sphere's vector harmonics lie, and in which units; compiled.

The trace of a field on a sphere of radius a is a sum of the vector harmonics of Corona and Veerapaneni (J. Comput.
Phys. 362 (2018) 327), with Y real and orthonormal, without the Condon-Shortley phase,

    V = ∇_S Y - (n+1) Y e_r,   W = ∇_S Y + n Y e_r,   X = e_r × ∇_S Y,   |·|² = (n+1)(2n+1), n(2n+1), n(n+1),

for degrees n = 1 .. p. The single layer is diagonal in them, a/η times

    λ = n/((2n+1)(2n+3)),   (n+1)/((2n-1)(2n+1)),   1/(2n+1)                                        for V, W, X,

and a coefficient is kept in units that make the grand mobility symmetric with unit diagonal: if c is the coefficient
of the orthonormal harmonic, y = (a/λ)^½ c. W and X of degree 1 are rigid motions; as sources they are the fields of a
force and of a torque, y = F/(6πa)^½ and ±T/(8πa³)^½ (over the viscosity), and as traces y = (6πa)^½ U and ±(8πa³)^½ Ω.
The double-layer density q of the CDL equation (1 + K) q = c follows degree by degree, since K is diagonal, too:
3/((2n+1)(2n+3)), -3/((2n-1)(2n+1)), -3/(2n+1).

An array of one sphere is (2, 3, T): class, family (V, W, X), and n(n+1)/2 - 1 + m with m = 0 .. n. Class 0 holds the
cosines of V and W and minus the sines of X, class 1 the sines of V and W and the cosines of X: what is symmetric and
what is antisymmetric about the plane y = 0. Turning about y and moving along z keep the two apart and treat them alike.
Where there is no sine of m = 0 the array holds zeros.
"""

import math

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled

V, W, X = 0, 1, 2


@compiled
def places(p: int) -> int:
    """Give T, the number of (n, m) up to degree p."""
    return (p + 1) * (p + 2) // 2 - 1


@compiled
def place(n: int, m: int) -> int:
    """Give where (n, m) lies."""
    return n * (n + 1) // 2 - 1 + m


@compiled
def lowest(m: int) -> int:
    """Give the lowest degree that has order m: there is no degree 0."""
    return max(1, m)


@compiled
def unit(family: int, n: int) -> float:
    """Give |harmonic| λ^-½, what a coefficient of the harmonic as written above, for a = 1, is to be multiplied by."""
    if family == V:
        return math.sqrt((n + 1.0) * (2 * n + 1) * (2 * n + 1) * (2 * n + 3) / n)
    if family == W:
        return math.sqrt(n * (2.0 * n + 1) * (2 * n - 1) * (2 * n + 1) / (n + 1))
    return math.sqrt(n * (n + 1.0) * (2 * n + 1))


@compiled
def spots(p: int) -> tuple[int, int, int, int, int, int]:
    """Give where the rigid motions Ux Uy Uz Ωx Ωy Ωz lie in a sphere's flat array; `SIGNS` are theirs."""
    t = places(p)
    return t + 1, 4 * t + 1, t, 5 * t + 1, 2 * t + 1, 5 * t


SIGNS = np.array([1.0, 1.0, 1.0, -1.0, 1.0, -1.0])
"""X = e_r × ∇_S Y turns the other way than Ω × r, and class 0 holds minus the sines of X."""


@compiled
def between(centres: Array, i: int, j: int) -> float:
    """Give the distance of two centres."""
    x, y, z = centres[i, 0] - centres[j, 0], centres[i, 1] - centres[j, 1], centres[i, 2] - centres[j, 2]
    return math.sqrt(x * x + y * y + z * z)


@compiled
def rigid_units(radii: Array) -> Array:
    """Give (N, 6): velocities times this are traces y, forces and torques over it sources y, for unit viscosity."""
    out = np.empty((len(radii), 6))
    for i in range(len(radii)):
        for k in range(6):
            size = 6 * math.pi * radii[i] if k < 3 else 8 * math.pi * radii[i] ** 3
            out[i, k] = SIGNS[k] * math.sqrt(size)
    return out


@compiled
def strain_unit(radius: float) -> float:
    """Give the trace y, in W of degree 2, of the flow E·r with |E|² = Σ E_ij² = 1 on a sphere."""
    # ∫ |E·e_r|² over the unit sphere is 4π/3 |E|²; λ = 1/5
    return math.sqrt(5 * radius) * radius * math.sqrt(4 * math.pi / 3)
