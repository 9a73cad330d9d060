"""Slow reference of the spectral discretisation: every block by quadrature over a sphere, from the definitions.

Nothing here is fast and nothing is shared with the fast formulae (translation theorems, images as expansions), which
are tested against it. A field is evaluated at the nodes of a product rule on the target sphere and projected in L2 on
the vector harmonics there; the rule has more nodes than the projection of the harmonics alone would need, because a
field from outside has all degrees and those above the last one wanted alias on those wanted.

Real orthonormal spherical harmonics Y_nm (n >= 1, m = -n..n; cos mφ for m > 0, sin |m|φ for m < 0, no Condon-Shortley
phase) give on the unit sphere, e_r its normal, the vector harmonics

    V = ∇_S Y - (n + 1) Y e_r,    W = ∇_S Y + n Y e_r,    X = e_r × ∇_S Y,

divided here by their L2 norms, the roots of (n + 1)(2n + 1), n (2n + 1) and n (n + 1). Coefficients of a trace are
c[f, k]: family f = 0, 1, 2 for V, W, X and k = n² - 1 + n + m, so (3, K) with K = p (p + 2). Viscosity is 1.

References
----------
Corona & Veerapaneni, J. Comput. Phys. 362 (2018) 327 (the basis and its exterior fields); Kim & Karrila,
Microhydrodynamics (1991), ch. 4 (Lamb's solution); Lorentz (1907) and Blake, Proc. Camb. Phil. Soc. 70 (1971) 303 (the
wall); Epton & Dembart, SIAM J. Sci. Comput. 16 (1995) 865 (derivatives of solid harmonics).
"""

from collections.abc import Callable
from math import ceil, log, pi, sqrt

import numpy as np
import numpy.typing as npt

from mpad_core.arrays import Array

Complex = npt.NDArray[np.complex128]

N_EXTRA = 32
"""Nodes in θ beyond p_target + p_source that give 1e-13 of a block between equal spheres, or a wall, in contact."""

N_PHI_EXTRA = 4
"""Nodes in φ beyond p_target + p_source; images take 3."""

CHUNK = 512
"""Nodes treated at once; bounds the memory, changes nothing else."""

MIRROR = np.array([1.0, 1.0, -1.0])
"""J, the reflection in the wall z = 0."""

__all__ = [
    "direct_block",
    "exterior_fields",
    "exterior_gradients",
    "image_block",
    "image_fields",
    "rigid_trace",
    "sphere_rule",
    "vector_harmonics",
]


def _solid(top: int, points: Array) -> Complex:
    """Give S_n^m = sqrt((n - m)! / (n + m)!) P_n^m(cos θ) e^{imφ} / r^(n + 1), with Condon-Shortley phase, n = 0..top.

    Shape (top + 1, 2 top + 1, points); m < 0 is counted from the end of the second axis, as Python does. Recurrences
    in x + iy and z have no trouble at the poles.
    """
    x, y, z = points.T
    square = x * x + y * y + z * z
    table = np.zeros((top + 1, 2 * top + 1, len(points)), dtype=np.complex128)
    table[0, 0] = 1.0 / np.sqrt(square)
    for m in range(top + 1):
        if m > 0:
            table[m, m] = -sqrt((2 * m - 1) / (2 * m)) * (x + 1j * y) / square * table[m - 1, m - 1]
        for n in range(m, top):  # at n = m the last term is zero times a row still zero
            two_terms = (2 * n + 1) * z * table[n, m] - sqrt(n * n - m * m) * table[n - 1, m]
            table[n + 1, m] = two_terms / (square * sqrt((n + 1) ** 2 - m * m))
    for m in range(1, top + 1):
        table[:, -m] = (-1) ** m * np.conj(table[:, m])
    return table


def _gradient(table: Complex) -> Complex:
    """Give ∂_x, ∂_y, ∂_z of functions that obey the index shifts of S_n^m, on a new last axis; one degree is used up.

    (∂_x ± i ∂_y) S_n^m = ± sqrt((n ± m + 1)(n ± m + 2)) S_{n+1}^{m ± 1},
    ∂_z S_n^m = - sqrt((n + 1)² - m²) S_{n+1}^m. Derivatives of S obey the same, so this can be applied again.
    """
    top = len(table) - 1
    n = np.arange(top)[:, None]
    m = np.fft.ifftshift(np.arange(-(table.shape[1] // 2), table.shape[1] // 2 + 1))
    shape = (top, table.shape[1]) + (1,) * (table.ndim - 2)

    def root(squared: npt.NDArray[np.int_]) -> Array:
        return np.sqrt(np.maximum(squared, 0.0)).reshape(shape)  # negative only where |m| > n, which no one reads

    upper = root((n + m + 1) * (n + m + 2)) * np.roll(table, -1, axis=1)[1:]
    lower = -root((n - m + 1) * (n - m + 2)) * np.roll(table, 1, axis=1)[1:]
    along = -root((n + 1) ** 2 - m**2) * table[1:]
    return np.stack([(upper + lower) / 2, (upper - lower) / 2j, along], axis=-1)


def _real(p: int, table: Complex) -> Array:
    """Give Y_nm / r^(n + 1), or its derivatives, of degrees 1 to p from those of S_n^m: (K, ...)."""
    rows = []
    for n in range(1, p + 1):
        for m in range(-n, n + 1):
            part = table[n, abs(m)].imag if m < 0 else table[n, m].real
            sign_and_norm = 1.0 if m == 0 else sqrt(2.0) * (-1) ** m  # (-1)^m takes the Condon-Shortley phase away
            rows.append(sqrt((2 * n + 1) / (4 * pi)) * sign_and_norm * part)
    return np.array(rows)


def _degrees(p: int, axes: int) -> Array:
    """Give the degree n of each k, (K, 1, ..., 1) with `axes` trailing ones."""
    n = np.arange(1, p + 1)
    return np.repeat(n, 2 * n + 1).astype(float).reshape((-1,) + (1,) * axes)


def _normalised(p: int, families: tuple[Array, Array, Array]) -> Array:
    """Divide V, W, X by the L2 norms of their traces and stack them."""
    n = _degrees(p, families[0].ndim - 1)
    norms = np.sqrt([(n + 1) * (2 * n + 1), n * (2 * n + 1), n * (n + 1)])
    return np.stack(families) / norms


def _lamb(n: Array) -> tuple[Array, Array, Array, Array]:
    """Give α, β, γ, δ of the exterior field with trace W: α r² ∇I + β r I - γ ∇I, of pressure δ I."""
    alpha = -(n - 2) / (2 * n * (2 * n - 1))
    beta = (n + 1) / (n * (2 * n - 1))
    delta = (2 * n + 1) / beta  # the rest are Lamb's for pressure I, times this
    return delta * alpha, delta * beta, delta * alpha - 1.0, delta


def vector_harmonics(p: int, directions: Array) -> Array:
    """Give the orthonormal vector harmonics of the unit sphere.

    Parameters
    ----------
    p
        Highest degree, 1 or more.
    directions : (n, 3)
        Unit vectors.

    Returns
    -------
    harmonics : (3, K, n, 3)
        V̂, Ŵ, X̂, each for K = p (p + 2) harmonics, in Cartesian components.
    """
    table = _solid(p + 1, directions)
    values, gradients, n = _real(p, table)[..., None], _real(p, _gradient(table)), _degrees(p, 2)
    radial = values * directions
    tangential = gradients + (n + 1) * radial  # at r = 1 the radial derivative of Y / r^(n + 1) is -(n + 1) Y
    families = tangential - (n + 1) * radial, tangential + n * radial, np.cross(directions, tangential)
    return _normalised(p, families)


def exterior_fields(p: int, radius: float, points: Array) -> Array:
    """Give the decaying Stokes fields whose traces on a sphere are the orthonormal vector harmonics.

    Parameters
    ----------
    p
        Highest degree.
    radius
        Of the sphere.
    points : (n, 3)
        Relative to its centre, anywhere but there.

    Returns
    -------
    velocity : (3, K, n, 3)
        In the unit of the trace.

    Notes
    -----
    With I = Y / r^(n + 1), r in radii: ∇I for V, r × ∇I for X, and for W Lamb's combination of r² ∇I, r I and ∇I
    (Kim & Karrila, ch. 4), the only one with pressure.
    """
    r = points / radius
    table = _solid(p + 1, r)
    values, gradients = _real(p, table)[..., None], _real(p, _gradient(table))
    alpha, beta, gamma, _ = _lamb(_degrees(p, 2))
    pressing = (alpha * np.sum(r * r, axis=1)[:, None] - gamma) * gradients + beta * r * values
    return _normalised(p, (gradients, pressing, np.cross(r, gradients)))


def exterior_gradients(p: int, radius: float, points: Array) -> tuple[Array, Array]:
    """Give the derivatives of the exterior fields and of their pressures, viscosity 1.

    Parameters
    ----------
    p, radius, points
        As for `exterior_fields`.

    Returns
    -------
    velocity_gradient : (3, K, n, 3, 3)
        Component of velocity, then direction of the derivative: ∂u_i / ∂x_j at [..., i, j].
    pressure_gradient : (3, K, n, 3)
        Zero for V and X; for W the pressure is (2n + 1) / β times I.
    """
    r = points / radius
    table = _solid(p + 2, r)
    gradient_table = _gradient(table)
    gradients, second = _real(p, gradient_table), _real(p, _gradient(gradient_table))
    pressing = _pressing_gradients(p, r, _real(p, table)[..., None, None], gradients[..., None, :], second)
    turning = np.cross(np.eye(3), gradients[..., None, :]) + np.cross(r[:, None, :], second)  # ∂_j, then component
    velocity = _normalised(p, (second, pressing, np.swapaxes(turning, -1, -2)))
    nothing = np.zeros_like(gradients)
    pressure = _normalised(p, (nothing, _lamb(_degrees(p, 2))[3] * gradients, nothing))
    return velocity / radius, pressure / radius**2


def _pressing_gradients(p: int, r: Array, values: Array, gradients: Array, second: Array) -> Array:
    """Give ∂u_i / ∂x_j of the fields with trace W; `gradients` ∂_j I are shaped (K, n, 1, 3), `second` (K, n, 3, 3)."""
    alpha, beta, gamma, _ = _lamb(_degrees(p, 3))
    column, row = r[:, :, None], r[:, None, :]
    of_square: Array = 2 * row * np.swapaxes(gradients, -1, -2) + np.sum(r * r, axis=1)[:, None, None] * second
    of_radius: Array = np.eye(3) * values + column * gradients
    return alpha * of_square + beta * of_radius - gamma * second


def image_fields(p: int, radius: float, centre: Array, points: Array) -> Array:
    """Give the fields that a no-slip wall z = 0 adds to the exterior fields of a sphere above it.

    Parameters
    ----------
    p, radius
        As for `exterior_fields`.
    centre : (3,)
        Of the sphere, above the wall.
    points : (n, 3)
        Not below the wall.

    Returns
    -------
    velocity : (3, K, n, 3)
        With the exterior field itself it vanishes at z = 0.

    Raises
    ------
    ValueError
        If the centre is not above the wall.

    Notes
    -----
    Lorentz's reflection, J = diag(1, 1, -1): u(x) = -u_0(Jx) + 2 z J ∇u_0z(Jx) + z² J ∇p_0(Jx).
    """
    if not centre[2] > 0.0:
        raise ValueError(f"the image is that of a sphere above the wall, but its centre is at z = {centre[2]}")
    reflected = points * MIRROR - centre
    height = points[:, 2:]
    gradient, pressure_gradient = exterior_gradients(p, radius, reflected)
    slip = 2 * height * gradient[..., 2, :] + height**2 * pressure_gradient
    return MIRROR * slip - exterior_fields(p, radius, reflected)


def sphere_rule(n_theta: int, n_phi: int, axis: Array) -> tuple[Array, Array]:
    """Give a product rule on the unit sphere: Gauss-Legendre in cos θ times trapezoid in φ about a given axis.

    Parameters
    ----------
    n_theta, n_phi
        Nodes; exact for spherical harmonics of degree below 2 n_theta and order about the axis below n_phi.
    axis : (3,)
        Of any length and either sense.

    Returns
    -------
    directions : (n_theta n_phi, 3)
    weights : (n_theta n_phi,)
        Their sum is 4π.
    """
    cosine, weight = np.polynomial.legendre.leggauss(n_theta)
    height, angle = (grid.ravel() for grid in np.meshgrid(cosine, 2 * pi / n_phi * np.arange(n_phi), indexing="ij"))
    sine = np.sqrt(1.0 - height**2)
    about_z = np.stack([sine * np.cos(angle), sine * np.sin(angle), height], axis=1)
    across = axis / np.linalg.norm(axis) + np.copysign([0.0, 0.0, 1.0], axis[2])  # mirror plane that takes z to ∓axis
    turned = about_z - 2.0 / (across @ across) * np.outer(about_z @ across, across)
    return turned, np.repeat(weight, n_phi) * 2 * pi / n_phi


def _projected(p: int, radius: float, rule: tuple[Array, Array], field: Callable[[Array], Array]) -> Array:
    """Project fields, given at points relative to a sphere's centre, on the vector harmonics of that sphere."""
    directions, weights = rule
    block: Array | float = 0.0
    for part in np.array_split(np.arange(len(weights)), ceil(len(weights) / CHUNK)):
        basis = vector_harmonics(p, directions[part]) * weights[part, None]
        block = block + _flat(basis) @ _flat(field(radius * directions[part])).T
    return np.asarray(block)


def _flat(fields: Array) -> Array:
    """Shape (3, K, n, 3) to (3 K, 3 n)."""
    return fields.reshape(3 * fields.shape[1], -1)


def _rule(degrees: int, n_extra: int, offset: Array, radius: float) -> tuple[Array, Array]:
    """Give the rule for a target of some radius at an offset from the source; `degrees` are p of both added.

    About the axis through both centres, orders of source and target do not mix: in φ no field is of higher order than
    its source's degree (or the degree of its image's own expansion, N_PHI_EXTRA at most above), so the trapezoid rule
    makes no error. The degrees in θ never end; they decay with the power of radius over distance.
    """
    ratio = float(np.linalg.norm(offset)) / radius
    if not ratio > 1.0:
        raise ValueError(f"the source's centre, or its mirror image, is {ratio} radii from the target's: inside it")
    n_theta = degrees + ceil(n_extra * max(1.0, log(2.0) / log(ratio)))
    return sphere_rule(n_theta, degrees + N_PHI_EXTRA, offset)


def direct_block(
    p_target: int, a_target: float, p_source: int, a_source: float, offset: Array, n_extra: int = N_EXTRA
) -> Array:
    """Give the trace coefficients on one sphere of the exterior fields of another.

    Parameters
    ----------
    p_target, a_target
        Highest degree and radius of the sphere on which the fields are wanted.
    p_source, a_source
        Of the sphere whose fields they are.
    offset : (3,)
        From the source's centre to the target's.
    n_extra
        Nodes in θ beyond p_target + p_source, if the centres are two target radii apart or more; nearer, with a
        small source beside a big target, as many more as give the same digits.

    Returns
    -------
    block : (3 K_target, 3 K_source)
        Rows and columns ordered as coefficients c[f, k] raveled.

    Raises
    ------
    ValueError
        If the source's centre is inside the target.
    """
    rule = _rule(p_target + p_source, n_extra, offset, a_target)
    return _projected(p_target, a_target, rule, lambda points: exterior_fields(p_source, a_source, points + offset))


def image_block(
    p_target: int,
    a_target: float,
    centre_target: Array,
    p_source: int,
    a_source: float,
    centre_source: Array,
    n_extra: int = N_EXTRA,
) -> Array:
    """Give the trace coefficients on one sphere of the wall images of the exterior fields of another, or of its own.

    Parameters
    ----------
    p_target, a_target, p_source, a_source
        As for `direct_block`.
    centre_target, centre_source : (3,)
        Above the wall z = 0; the same for a sphere's own images.
    n_extra
        As for `direct_block`, with the distance to the source's mirror image.

    Returns
    -------
    block : (3 K_target, 3 K_source)
        As for `direct_block`.

    Raises
    ------
    ValueError
        If the source is not above the wall, or the centre of its mirror image is inside the target.
    """
    rule = _rule(p_target + p_source, n_extra, centre_target - MIRROR * centre_source, a_target)
    return _projected(
        p_target, a_target, rule, lambda points: image_fields(p_source, a_source, centre_source, points + centre_target)
    )


def rigid_trace(p: int, radius: float, motion: Array) -> Array:
    """Give the trace coefficients of a rigid motion, all of them zero but Ŵ and X̂ of degree 1.

    Parameters
    ----------
    p, radius
        Highest degree and radius of the sphere.
    motion : (6,)
        U_x, U_y, U_z, Ω_x, Ω_y, Ω_z about the sphere's centre.

    Returns
    -------
    trace : (3, K)
        Of U + Ω × r. The exterior field with this trace is that of a sphere alone, so these coefficients also say
        what force 6π a U and torque 8π a³ Ω, viscosity 1, drive it.
    """
    trace = np.zeros((3, p * (p + 2)))
    in_order_of_m = [1, 2, 0]  # m = -1, 0, 1 are y, z, x
    trace[1, :3] = sqrt(4 * pi) * motion[:3][in_order_of_m]
    trace[2, :3] = -sqrt(8 * pi / 3) * radius * motion[3:][in_order_of_m]
    return trace
