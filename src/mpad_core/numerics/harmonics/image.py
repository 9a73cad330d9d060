r"""The wall's image of a sphere's exterior fields: a finite expansion about the mirrored centre; compiled.

Let û be the field reflected in the wall z = 0, an exterior field about the image of the centre, and p̂ its pressure. The
wall adds (Lorentz 1907; Kim and Karrila, Microhydrodynamics, 12.2; at the fluid's unit viscosity)

    u* = -û + 2 û_z e_z - 2 z ∇û_z + z² ∇p̂,      p* = p̂ + 2 z ∂_z p̂ - 4 ∂_z û_z.

With z = ζ - h, ζ measured from the image's centre, r·u*, r·∇×u* and p* are polynomials in h times irregular harmonics
(∂_z I_n = -I_{n+1}, (2n+1) ζ I_n = r² I_{n+1} + (n² - m²) I_{n-1}), from which the coefficients follow: those of ∇I, of
r×∇I and of the field of pressure I, written φ, χ and π, of degrees l-2 to l+2 for a source of degree l, at the same m.
"""

import math
from functools import lru_cache

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled, compiled_sums
from mpad_core.numerics.harmonics.layout import lowest, place, places
from mpad_core.numerics.harmonics.translation import UNITS

RAISE = 2
"""An image goes this many degrees higher than its source."""

REACH = 2 * RAISE + 1


@compiled
def _of_gradient(n: int, m: int, h: float, k: Array) -> None:
    """Write the image of ∇I_n: k[degree - n + 2, (φ, χ, π)]."""
    square = (n + 1.0) ** 2 - m * m
    k[2, 0] = -1 + 2 * (n + 3) * square / ((n + 1.0) * (2 * n + 3))
    k[3, 0] = -2 * h
    k[3, 1] = 4 * m / ((n + 1.0) * (n + 2))
    k[4, 2] = -4


@compiled
def _of_swirl(n: int, m: int, h: float, k: Array) -> None:
    """Write the image of r×∇I_n."""
    square = n * n - m * m
    k[1, 0] = 2 * m * (n + 2) * square / (n * (2 * n + 1.0))
    k[2, 0] = -2 * m * h
    k[2, 1] = -1 + 4 * m * m / (n * (n + 1.0))
    k[3, 2] = -4 * m


@compiled
def _of_pressure(n: int, m: int, h: float, k: Array) -> None:
    """Write the image of the field whose pressure is I_n."""
    square, below, odd = n * n - m * m, (n - 1.0) ** 2 - m * m, 2 * n - 1.0
    if n > 2:
        k[0, 0] = (n + 1) * (n - 2) * square * below / (n * odd * odd * (n - 1))
        k[1, 1] = 2 * m * square * (n - 2) / (n * n * odd * (n - 1))
    k[1, 0] = -4 * h * (n + 1) * (n - 1) * square / (n * (2 * n + 1) * odd)
    k[2, 0] = h * h
    k[2, 1] = -2 * m * h / (n * (n + 1.0))
    k[2, 2] = -1 - 2 * (n - 2) * square / (n * odd)
    k[3, 2] = 2 * h


@compiled
def _norm_ratio(n: int, l: int, m: int) -> float:  # noqa: E741
    """Give ((n+m)! (n-m)! / ((l+m)! (l-m)!))^½."""
    ratio = 1.0
    for i in range(l, n):
        ratio *= math.sqrt((i + 1.0 + m) * (i + 1 - m))
    for i in range(n, l):
        ratio /= math.sqrt((i + 1.0 + m) * (i + 1 - m))
    return ratio


@compiled
def _pressure_scale(n: int) -> float:
    """Give π of the unit exterior field W of degree n; its φ is 1 - g, see `translation`."""
    return (2 * n + 1.0) * n * (2 * n - 1) / (n + 1)


@compiled
def _slope(n: int) -> float:
    """Give g - 1 of degree n."""
    return -(2 * n + 1) * (n - 2.0) / (2 * (n + 1)) - 1


@compiled
def _in_harmonics(n: int, l: int, k: Array, scale: float, out: Array) -> None:  # noqa: E741
    """Turn k (source φ χ π, image φ χ π) into out (image V W X, source V W X), both in the units of coefficients."""
    slope, source_slope = _slope(n), _slope(l)
    of_w = np.empty(3)
    for image in range(3):
        of_w[image] = _pressure_scale(l) * k[2, image] - source_slope * k[0, image]
    for source in range(3):
        column = k[0] if source == 0 else (of_w if source == 1 else k[1])
        w = column[2] / _pressure_scale(n)
        v = column[0] + slope * w
        out[0, source] = scale * v * UNITS[0, n] / UNITS[source, l]
        out[1, source] = scale * w * UNITS[1, n] / UNITS[source, l]
        out[2, source] = scale * column[1] * UNITS[2, n] / UNITS[source, l]


@compiled
def image_operator(p: int, height: float, out: Array) -> None:
    """Write the operator that makes the coefficients of an image of those of its source.

    Parameters
    ----------
    p
        Highest degree of the source.
    height
        Of the centre over the wall, in radii.
    out : (T, 5, 3, 3)
        Written: for each (l, m) of the source, image degrees l-2 .. l+2, families V W X of image and of source.
    """
    k = np.zeros((3, REACH, 3))
    out[:] = 0.0
    for l in range(1, p + 1):  # noqa: E741
        for m in range(l + 1):
            k[:] = 0.0
            _of_gradient(l, m, height, k[0])
            _of_swirl(l, m, height, k[1])
            _of_pressure(l, m, height, k[2])
            mirror = -1.0 if (l + m) % 2 else 1.0
            for n in range(REACH):  # r×∇I is mirrored with the other sign
                for image in range(3):
                    k[1, n, image] = -k[1, n, image]
            for n in range(max(lowest(m), l - RAISE), l + RAISE + 1):
                _in_harmonics(n, l, k[:, n - l + RAISE], mirror * _norm_ratio(n, l, m), out[place(l, m), n - l + RAISE])


@lru_cache(maxsize=128)
def image_terms(p: int) -> Array:
    """Give (3, T, 5, 3, 3): the coefficients of the `image_operator` as a polynomial in the height, up to degree p."""
    values = np.empty((3, places(p), REACH, 3, 3))
    for k, height in enumerate((0.0, 1.0, -1.0)):
        image_operator(p, height, values[k])
    zero, up, down = values
    return np.array([zero, (up - down) / 2, (up + down) / 2 - zero])


@compiled_sums
def image_at(terms: Array, height: float, out: Array) -> None:
    """Write the `image_operator` (flat) for a height from `image_terms` (3, flat), whose degree may be higher."""
    constant, slope, bend = terms
    for k in range(len(out)):
        out[k] = constant[k] + height * (slope[k] + height * bend[k])


@compiled_sums
def image_of(p: int, operator: Array, y: Array, out: Array) -> None:
    """Write the coefficients (2, 3, T(p+2)) of the image of a source y (2, 3, T(p))."""
    out[:] = 0.0
    for l in range(1, p + 1):  # noqa: E741
        for m in range(l + 1):
            at = place(l, m)
            for n in range(max(lowest(m), l - RAISE), l + RAISE + 1):
                entries, to = operator[at, n - l + RAISE], place(n, m)
                for c in range(2):
                    for f in range(3):
                        out[c, f, to] += (
                            entries[f, 0] * y[c, 0, at] + entries[f, 1] * y[c, 1, at] + entries[f, 2] * y[c, 2, at]
                        )


@compiled_sums
def add_image_transposed(p: int, operator: Array, y: Array, out: Array) -> None:
    """Add to `out` (2, 3, T(p)) the transpose of `image_of` times y (2, 3, T(p+2))."""
    for l in range(1, p + 1):  # noqa: E741
        for m in range(l + 1):
            at = place(l, m)
            for n in range(max(lowest(m), l - RAISE), l + RAISE + 1):
                entries, to = operator[at, n - l + RAISE], place(n, m)
                for c in range(2):
                    for f in range(3):
                        out[c, f, at] += (
                            entries[0, f] * y[c, 0, to] + entries[1, f] * y[c, 1, to] + entries[2, f] * y[c, 2, to]
                        )
