"""Make src/mpad_core/numerics/_wall_table.py, the coefficients of the wall look-up, from the exact series.

Run it with ``python benchmarks/make_wall_table.py``; it needs mpmath, for the far range, and takes seconds. With eps
the gap over the radius and functions in the order of `wall_series.NAMES`, the table holds polynomials of:

- near, eps < 2^-10: two in eps, f = p(eps) + q(eps) ln(1/eps), the form of lubrication theory, fitted. The leading
  coefficients of the logarithms are exact: Goldman, Cox & Brenner 1967 (part I) and Cox & Brenner 1967.
- middle, 2^-10 <= eps < 1: one for each octave of eps, in t from -1 to 1 across it. The functions are singular at
  eps = 0 only, three half-widths from every octave's middle, so the coefficients fall like 5.8^-n.
- far, eps >= 1: (f - limit)/x^m in t = 4 x - 1, where x = a/h = 1/(1 + eps) and m is the order of the first reflection.

In the first two the squeeze function stands multiplied by eps.
"""

import sys
from pathlib import Path

import mpmath
import numpy as np
from numpy.polynomial import chebyshev

from mpad_core.numerics import wall_series

TABLE = Path(__file__).parents[1] / "src" / "mpad_core" / "numerics" / "_wall_table.py"
OCTAVES = 10
MIDDLE_DEGREE = 17
FAR_DEGREE = 17
NEAR_DEGREE = 4
NEAR_RANGE = (1e-5, 1.1e-3)
SQUEEZE = wall_series.NAMES.index("fperp")
LEADING_LOGARITHM = np.array([8 / 15, 1 / 10, 2 / 15, 2 / 5, 0, 0, 0, 0])
FAR_LIMIT = np.array([1, 0, 0, 1, 1, 1, 1, 1])
FAR_ORDER = np.array([1, 4, 4, 3, 1, 3, 1, 3])


def polynomial(function, degree):
    """Interpolate function(t) at Chebyshev nodes; coefficients of 1, t, t^2, ... for each of its columns."""
    pi = np.arccos(np.longdouble(-1))
    angle = pi * (np.arange(degree + 1) + np.longdouble(0.5)) / (degree + 1)
    values = np.array([function(t) for t in np.cos(angle)])
    series = 2 / np.longdouble(degree + 1) * np.cos(np.outer(np.arange(degree + 1), angle)) @ values
    series[0] /= 2
    return np.array([chebyshev.cheb2poly(column) for column in series.T]).T


def regular(eps):
    """The eight functions, the squeeze without its pole."""
    functions = wall_series.wall_series(eps)
    functions[SQUEEZE] *= eps
    return functions


def middle():
    """Coefficients by octave, degree, function; octave 0 is the lowest."""
    lows = 2.0 ** np.arange(-OCTAVES, 0)
    return np.array([polynomial(lambda t, low=low: regular(low * (3 + t) / 2), MIDDLE_DEGREE) for low in lows])


def far():
    """Coefficients by degree, function; in 50 digits, since the limit is subtracted and x^m divided out."""
    mpmath.mp.dps = 50

    def reflections(t):
        x = (1 + mpmath.mpf(str(t))) / 4
        functions = wall_series.wall_series(1 / x - 1, digits=48)
        return np.array([(f - int(g)) / x ** int(m) for f, g, m in zip(functions, FAR_LIMIT, FAR_ORDER, strict=True)])

    return polynomial(lambda t: np.array([np.longdouble(str(f)) for f in reflections(t)]), FAR_DEGREE)


def near():
    """Coefficients by degree, (p, q), function; by least squares."""
    eps = np.geomspace(*NEAR_RANGE, 120)
    known = np.zeros((NEAR_DEGREE + 1, 2, 8))
    known[0, 1] = LEADING_LOGARITHM
    known[0, 0, SQUEEZE], known[1, 1, SQUEEZE] = 1, 1 / 5
    powers = eps[:, None] ** np.arange(NEAR_DEGREE + 1)
    basis = np.stack([powers, powers * np.log(1 / eps)[:, None]], axis=2)
    values = np.array([regular(e) for e in eps])
    for column in range(8):
        free = np.ones((NEAR_DEGREE + 1, 2), dtype=bool)
        free[0, 1] = False
        if column == SQUEEZE:
            free[0, 0] = free[1, 1] = False
        rest = values[:, column] - (basis * known[:, :, column]).sum(axis=(1, 2))
        weight = eps if column == SQUEEZE else np.ones_like(eps)  # the pole is exact: resolve what it leaves
        matrix = basis[:, free] / weight[:, None]
        scale = np.abs(matrix).max(axis=0)
        solution = np.linalg.lstsq(matrix / scale, (rest / weight).astype(float), rcond=None)[0]
        known[:, :, column][free] = solution / scale
    return known


def written(name, table, meaning):
    """One assignment of the module: a flat tuple, a reader's comment above it."""
    numbers = [repr(float(value)) for value in table.ravel()]
    rows = [numbers[start : start + 4] for start in range(0, len(numbers), 4)]
    body = "".join(f"    {', '.join(row)},\n" for row in rows)
    return f"# {meaning}\n{name}_SHAPE = {table.shape}\n{name} = (\n{body})\n"


def main():
    """Write the table."""
    sections = (
        written("NEAR", near(), "by power of eps; plain and times ln(1/eps); function"),
        written("MIDDLE", middle(), "by octave of eps, from 2^-10; power of t; function"),
        written("FAR", far(), "by power of t; function"),
    )
    title = '"""Coefficients of the wall look-up: made by benchmarks/make_wall_table.py, not edited."""\n\n# fmt: off\n'
    TABLE.write_text(title + "\n".join(sections))
    sys.stdout.write(f"{TABLE.name}: {TABLE.stat().st_size} bytes\n")


if __name__ == "__main__":
    main()
