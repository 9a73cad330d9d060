"""Cost and error of the two-sphere functions by ratio of radii and gap: ``python benchmarks/pair_functions.py``.

The look-up is compared with the series, as 12x12 resistances in the energy norm; the series with itself, as the degree
of reciprocity that the rounding left. Times are of the fastest of several runs.
"""

import sys
import time

import numpy as np

from mpad_core.numerics.pair_functions import PairFunctions, pair_resistance, pair_strain_load
from mpad_core.numerics.pair_series import loads, pair_series

RATIOS = (1.0, 0.5, 0.1, 0.01, 0.001)
RANGES = ((1e-6, 1e-4), (1e-4, 1e-2), (1e-2, 1.0), (1.0, 1e3), (1e3, 1e6))
ALONG_Z = np.array([0.0, 0.0, 1.0])


def best_time(action, repeats=7):
    """Seconds of the fastest of several runs, the first (compilation) left out."""
    action()
    spans = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        spans.append(time.perf_counter() - start)
    return min(spans)


def energy_error(got, wanted):
    """Largest |eigenvalue| of wanted^-1/2 (got - wanted) wanted^-1/2."""
    unit = 1 / np.sqrt(np.diag(wanted))
    values, vectors = np.linalg.eigh(wanted * np.outer(unit, unit))
    root = vectors / np.sqrt(values)
    return np.abs(np.linalg.eigvalsh(root.T @ ((got - wanted) * np.outer(unit, unit)) @ root)).max()


def resistance(f, ratio):
    out = np.empty((12, 12))
    pair_resistance(f, ALONG_Z, 1.0, ratio, 1.0, out)
    return out


def look_up_error(look_up, eps):
    return energy_error(
        resistance(look_up(eps), look_up.ratio), resistance(pair_series(look_up.ratio, eps), look_up.ratio)
    )


def reciprocity_error(ratio, eps):
    """Asymmetry of the resistance across the line, in units of the resistances of lone spheres."""
    across = loads(ratio, eps)[2][:4]
    scale = 6 * np.pi * np.array([1, ratio, 4 / 3, 4 / 3 * ratio**3])
    return np.abs((across - across.T) / np.sqrt(np.outer(scale, scale))).max()


def fill(ratio, eps):
    """Fill the octave of eps."""
    return PairFunctions(ratio)(eps)


def calls(ratio, count=20_000):
    """Give nanoseconds per call from Python of the look-up, the matrix and the strain load, the piece being there."""
    look_up, matrix, load, strain = PairFunctions(ratio), np.empty((12, 12)), np.empty(12), np.diag([0.5, 0.5, -1.0])
    f = look_up(0.11)
    actions = (
        lambda: [look_up(0.11) for _ in range(count)],
        lambda: [pair_resistance(f, ALONG_Z, 1.0, ratio, 1.0, matrix) for _ in range(count)],
        lambda: [pair_strain_load(f, ALONG_Z, 1.0, 1.0, strain, load) for _ in range(count)],
    )
    return [best_time(action) / count * 1e9 for action in actions]


def main():
    header = f"{'ratio':>6} {'eps':>17}  {'look-up':>8} {'reciprocity':>11}  {'series ms':>9} {'octave ms':>9}\n"
    sys.stdout.write(header)
    for ratio in RATIOS:
        look_up = PairFunctions(ratio)
        for low, high in RANGES:
            some = np.geomspace(low, high, 23)
            error = max(look_up_error(look_up, eps) for eps in some)
            reciprocity = max(reciprocity_error(ratio, eps) for eps in some)
            middle = float(np.sqrt(low * high))
            series = best_time(lambda ratio=ratio, eps=middle: pair_series(ratio, eps)) * 1e3
            octave = best_time(lambda ratio=ratio, eps=middle: fill(ratio, eps), 3) * 1e3
            row = f"{ratio:6g} {low:8.0e} {high:8.0e}  {error:8.0e} {reciprocity:11.0e}  {series:9.3f} {octave:9.2f}\n"
            sys.stdout.write(row)
    sys.stdout.write("from Python, ns: look-up {:.0f}, 12x12 matrix {:.0f}, strain load {:.0f}\n".format(*calls(0.5)))


if __name__ == "__main__":
    main()
