r"""The fluid's velocity at points, and what acts on a sphere's surface, from the sources of a solution; compiled.

With G_n^m = ((n-m)!/(n+m)!)^½ P_n^m e^{imφ}/r^{n+1} and lengths over the sphere's radius, the exterior fields are

    V: ∇G,    W: g r²∇G + (2n+1) r G - (g-1) ∇G,    X: r×∇G,         g = -(2n+1)(n-2)/(2(n+1)),

and differentiation shifts indices: ∂_z takes G_n^m to -((n+1)²-m²)^½ G_{n+1}^m, ∂_x + i∂_y to
-((n+m+1)(n+m+2))^½ G_{n+1}^{m+1} and ∂_x - i∂_y to ((n-m+1)(n-m+2))^½ G_{n+1}^{m-1}; G^{-1} = -conj G^1.
"""

import math

import numpy as np
import numpy.typing as npt

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.harmonics.image import RAISE, REACH, image_of
from mpad_core.numerics.harmonics.layout import V, W, X, place, places, strain_unit, unit
from mpad_core.numerics.harmonics.levels import Level
from mpad_core.numerics.harmonics.translation import UNITS

Numbers = npt.NDArray[np.complex128]


@compiled
def _irregular(p: int, x: Array, out: Numbers) -> None:
    """Write G_n^m at x (3,) for n = 0 .. p at n (n+1)/2 + m; complex."""
    square = x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
    z, across = x[2] / square, complex(x[0], x[1]) / square
    diagonal = complex(1 / math.sqrt(square), 0.0)
    for m in range(p + 1):
        below, here = 0j, diagonal
        out[m * (m + 1) // 2 + m] = here
        for n in range(m, p):
            up = (2 * n + 1) * z * here - math.sqrt(1.0 * n * n - m * m) / square * below
            below, here = here, up / math.sqrt((n + 1.0) ** 2 - m * m)
            out[(n + 1) * (n + 2) // 2 + m] = here
        diagonal *= across * math.sqrt((2 * m + 1) / (2 * m + 2.0))


@compiled
def _gradient(n: int, m: int, g: Numbers, out: Numbers) -> None:
    """Write ∇G_n^m (3,), complex, from the G of degree n+1."""
    row = (n + 1) * (n + 2) // 2
    up = math.sqrt((n + m + 1.0) * (n + m + 2)) * g[row + m + 1]
    lower = g[row + m - 1] if m > 0 else -np.conj(g[row + 1])
    down = math.sqrt((n - m + 1.0) * (n - m + 2)) * lower
    out[0] = 0.5 * (down - up)
    out[1] = 0.5j * (down + up)
    out[2] = -math.sqrt((n + 1.0) ** 2 - m * m) * g[row + m]


@compiled
def exterior_velocity(p: int, y: Array, radius: float, x: Array, out: Array) -> None:
    """Add to `out` (3,) the velocity at x (3,), from the centre, of the exterior field of sources y (2, 3, T)."""
    r = x / radius
    square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    g = np.empty((p + 2) * (p + 3) // 2, dtype=np.complex128)
    _irregular(p + 1, r, g)
    slope = np.empty(3, dtype=np.complex128)
    along, swirl, outward = np.zeros(3), np.zeros(3), 0.0
    for n in range(1, p + 1):
        lamb = -(2 * n + 1) * (n - 2.0) / (2 * (n + 1))
        for m in range(n + 1):
            size = math.sqrt((1 if m == 0 else 2) / (4 * math.pi * radius))
            at = place(n, m)
            v = complex(y[0, V, at], -y[1, V, at]) * size / UNITS[V, n]
            w = complex(y[0, W, at], -y[1, W, at]) * size / UNITS[W, n]
            s = complex(y[1, X, at], y[0, X, at]) * size / UNITS[X, n]
            _gradient(n, m, g, slope)
            outward += (2 * n + 1) * (w * g[n * (n + 1) // 2 + m]).real
            for k in range(3):
                along[k] += ((v + w * (lamb * square - lamb + 1)) * slope[k]).real
                swirl[k] += (s * slope[k]).real
    out[0] += along[0] + outward * r[0] + r[1] * swirl[2] - r[2] * swirl[1]
    out[1] += along[1] + outward * r[1] + r[2] * swirl[0] - r[0] * swirl[2]
    out[2] += along[2] + outward * r[2] + r[0] * swirl[1] - r[1] * swirl[0]


@compiled
def _add_sphere(p: int, y: Array, radius: float, centre: Array, points: Array, out: Array) -> None:
    for k in range(len(points)):
        exterior_velocity(p, y, radius, points[k] - centre, out[k])


def flow_at(level: Level, sources: Array, points: Array) -> Array:
    """Give the fluid's velocity (n, 3) at points (n, 3) outside the spheres, for sources (n,) of a solution."""
    scene, at = level.scene, level.system.at
    points = np.ascontiguousarray(points, dtype=np.float64)
    out = np.zeros_like(points)
    out[:, 0] = scene.flow.rate * points[:, 2]
    for i, p in enumerate(at.degrees):
        y = sources[at.own[i] : at.own[i + 1]].reshape(2, 3, -1)
        centre, radius = scene.centres[i], float(scene.radii[i])
        _add_sphere(p, y, radius, centre, points, out)
        if scene.wall:
            operator = level.system.operators[at.operator[i] : at.operator[i + 1]].reshape(places(p), REACH, 3, 3)
            image = np.empty((2, 3, places(p + RAISE)))
            image_of(p, operator, y, image)
            _add_sphere(p + RAISE, image, radius, centre * [1, 1, -1], points, out)
    return out


def stresslets(level: Level, sources: Array, viscosity: float) -> Array:
    """Give the stresslets (N, 3, 3), symmetric and traceless (pN µm): first moments of the fluid's tractions.

    A sphere answers a strain rate E with -E on its surface, which is the stresslet 20/3 πηa³ E (Batchelor, J. Fluid
    Mech. 41 (1970) 545). What lubrication adds near contact acts as forces and torques, and is not in here.
    """
    at, radii = level.system.at, level.scene.radii
    out = np.zeros((len(radii), 3, 3))
    shapes = _strains()
    for i in range(len(radii)):
        y = sources[at.own[i] : at.own[i + 1]].reshape(2, 3, -1)
        first = place(2, 0)
        parts = np.concatenate([y[0, W, first : first + 3], y[1, W, first + 1 : first + 3]])
        strain = np.einsum("k,kij->ij", parts, shapes) / strain_unit(radii[i])
        out[i] = -20 / 3 * np.pi * viscosity * radii[i] ** 3 * strain
    return out


def _strains() -> Array:
    """Give the unit strains of W of degree 2: cosines m = 0, 1, 2 and sines m = 1, 2."""
    out = np.zeros((5, 3, 3))
    out[0] = np.diag([-0.5, -0.5, 1]) / math.sqrt(1.5)
    for k, i, j in ((1, 0, 2), (3, 1, 2), (4, 0, 1)):
        out[k, i, j] = out[k, j, i] = math.sqrt(0.5)
    out[2] = np.diag([1, -1, 0]) * math.sqrt(0.5)
    return out


def tractions(level: Level, sources: Array, viscosity: float, sphere: int, directions: Array) -> Array:
    """Give the fluid's traction (n, 3) on a sphere (pN/µm²) in directions (n, 3), but for a constant pressure.

    Inside the sphere all fields together are a rigid motion, so that the jump of a single layer of the same trace,
    η c/(a λ), is the traction itself.
    """
    at, radius = level.system.at, float(level.scene.radii[sphere])
    p = int(at.degrees[sphere])
    y = sources[at.own[sphere] : at.own[sphere + 1]].reshape(2, 3, -1)
    out = np.zeros((len(directions), 3))
    _add_tractions(p, y, np.ascontiguousarray(directions, dtype=np.float64), out)
    return np.asarray(-viscosity * radius**-1.5 * out)


@compiled
def _add_tractions(p: int, y: Array, directions: Array, out: Array) -> None:
    """Add Σ y λ^-½ times the orthonormal harmonic at each direction: V, W, X on r = 1 are fields of G at its trace."""
    g = np.empty((p + 2) * (p + 3) // 2, dtype=np.complex128)
    slope = np.empty(3, dtype=np.complex128)
    for k in range(len(directions)):
        r = directions[k] / math.sqrt((directions[k] ** 2).sum())
        _irregular(p + 1, r, g)
        for n in range(1, p + 1):
            for m in range(n + 1):
                at, size = place(n, m), math.sqrt((1 if m == 0 else 2) * (2 * n + 1) / (4 * math.pi))
                v = complex(y[0, V, at], -y[1, V, at]) * size * unit(V, n) / ((n + 1) * (2 * n + 1))
                w = complex(y[0, W, at], -y[1, W, at]) * size * unit(W, n) / (n * (2 * n + 1.0))
                s = complex(y[1, X, at], y[0, X, at]) * size * unit(X, n) / (n * (n + 1.0))
                _gradient(n, m, g, slope)
                radial = (2 * n + 1) * (w * g[n * (n + 1) // 2 + m]).real
                a, b, c = ((s * slope[0]).real, (s * slope[1]).real, (s * slope[2]).real)
                out[k, 0] += ((v + w) * slope[0]).real + radial * r[0] + r[1] * c - r[2] * b
                out[k, 1] += ((v + w) * slope[1]).real + radial * r[1] + r[2] * a - r[0] * c
                out[k, 2] += ((v + w) * slope[2]).real + radial * r[2] + r[0] * b - r[1] * a
