"""Real harmonics seen from a turned frame: Wigner's matrices about y in two real blocks, turns about z; compiled."""

import math

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled, compiled_sums
from mpad_core.numerics.harmonics.layout import lowest, place


@compiled
def turn_size(p: int) -> int:
    """Give the number of entries of the blocks of degrees 1 to p: two of (n+1)² each."""
    return (p + 1) * (p + 2) * (2 * p + 3) // 3 - 2


@compiled
def turn_start(n: int) -> int:
    """Give where degree n starts."""
    return turn_size(n - 1)


@compiled
def _store(out: Array, n: int, k: int, m: int, plus: float, minus: float) -> None:
    """Write the entries (k, m) and (m, k) of cosines and sines from d_km and d_k,-m, k >= m >= 0."""
    start, width = turn_start(n), n + 1
    sines = start + width * width
    flip = -1.0 if (k + m) % 2 else 1.0
    if m == 0:
        cosine, sine = (plus if k == 0 else math.sqrt(2.0) * flip * plus), 0.0
    else:
        other = -minus if k % 2 else minus
        cosine, sine = flip * plus + other, flip * plus - other
    out[start + k * width + m] = cosine
    out[sines + k * width + m] = sine
    out[start + m * width + k] = flip * cosine
    out[sines + m * width + k] = flip * sine


@compiled
def _column(p: int, k: int, m: int, cosine: float, half_cosine: float, half_sine: float, out: Array) -> None:
    """Write d^n_km for n = k .. p (k >= |m|) by the recurrence in n, which is stable upwards."""
    first = 1.0  # d^k_km = (-1)^(k-m) binomial(2k, k+m)^½ cos^(k+m) sin^(k-m) of half the angle
    for i in range(k - abs(m)):
        first *= math.sqrt((k + abs(m) + i + 1.0) / (i + 1.0))
    first *= half_cosine ** (k + m) * (-half_sine) ** (k - m)
    below, here = 0.0, first
    out[k] = here
    for n in range(k, p):
        if n == 0:
            below, here = here, cosine * here
        else:
            up = math.sqrt(((n + 1.0) ** 2 - m * m) * ((n + 1.0) ** 2 - k * k)) * n
            down = math.sqrt((n * n - m * m) * 1.0 * (n * n - k * k)) * (n + 1)
            below, here = here, ((2 * n + 1) * (n * (n + 1) * cosine - m * k) * here - down * below) / up
        out[n + 1] = here


@compiled
def turn_blocks(p: int, angle: float, out: Array) -> None:
    """Write the matrices that turn real harmonics about y by an angle, for degrees 1 to p.

    Parameters
    ----------
    p
        Highest degree.
    angle
        rad; the harmonic about z becomes the one about (sin angle, 0, cos angle).
    out : (turn_size(p),)
        Written: for each n the (n+1, n+1) matrix of the cosines, m = 0 .. n, and that of the sines, whose row and
        column 0 are zero. They come from Wigner's d (Varshalovich, Moskalev and Khersonskii, Quantum Theory of Angular
        Momentum, 4.8), by its recurrence in n.
    """
    cosine, half_cosine, half_sine = math.cos(angle), math.cos(angle / 2), math.sin(angle / 2)
    plus, minus = np.empty(p + 1), np.empty(p + 1)
    for k in range(p + 1):
        for m in range(k + 1):
            _column(p, k, m, cosine, half_cosine, half_sine, plus)
            _column(p, k, -m, cosine, half_cosine, half_sine, minus)
            for n in range(lowest(k), p + 1):
                _store(out, n, k, m, plus[n], minus[n])


@compiled_sums
def turn_about_z(p: int, cosine: float, sine: float, y: Array, out: Array) -> None:
    """Write the coefficients y (2, 3, T) as seen from axes turned about z by the angle of this cosine and sine."""
    c, s = 1.0, 0.0
    for m in range(p + 1):
        for f in range(3):
            for n in range(lowest(m), p + 1):
                at = place(n, m)
                even, odd = y[0, f, at], y[1, f, at]
                out[0, f, at] = c * even + s * odd
                out[1, f, at] = c * odd - s * even
        c, s = c * cosine - s * sine, c * sine + s * cosine


@compiled_sums
def add_turned_back(p: int, cosine: float, sine: float, y: Array, out: Array) -> None:
    """Add to `out` what `turn_about_z` would undo."""
    c, s = 1.0, 0.0
    for m in range(p + 1):
        for f in range(3):
            for n in range(lowest(m), p + 1):
                at = place(n, m)
                even, odd = y[0, f, at], y[1, f, at]
                out[0, f, at] += c * even - s * odd
                out[1, f, at] += c * odd + s * even
        c, s = c * cosine - s * sine, c * sine + s * cosine
