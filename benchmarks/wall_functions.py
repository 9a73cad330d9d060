"""Cost and error of the wall look-up by range of eps, the gap over the radius: ``python benchmarks/wall_functions.py``.

The series it is compared with are summed in 40 digits beyond eps = 10, in extended precision below.
"""

import sys
import time

import mpmath
import numpy as np

from mpad_core.numerics.wall_functions import NAMES, wall_functions_array, wall_resistance
from mpad_core.numerics.wall_series import wall_series

RANGES = ((1e-6, 1e-4), (1e-4, 1e-3), (1e-3, 1.0), (1.0, 10.0), (10.0, 100.0), (100.0, 1e4))
SPHERES = 200_000


def exact(eps):
    if eps < 10:
        return wall_series(eps).astype(float)
    with mpmath.workdps(40):
        return np.array([float(f) for f in wall_series(mpmath.mpf(eps), digits=38)])


def best_time(action, repeats=7):
    """Seconds of the fastest of several runs, the first (compilation) left out."""
    action()
    spans = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        spans.append(time.perf_counter() - start)
    return min(spans)


def nanoseconds_of_resistance(calls=20_000):
    """One 6x6 matrix called from Python: nearly all of it is numba's dispatch."""
    out = np.empty((6, 6))
    return best_time(lambda: [wall_resistance(1.1, 0.1, 1.0, 1.0, out) for _ in range(calls)]) / calls * 1e9


def main():
    random = np.random.default_rng(1)
    sys.stdout.write(f"{'eps':>17} {'ns/sphere':>9}  worst relative error of {', '.join(NAMES)}\n")
    for low, high in RANGES:
        eps = np.exp(random.uniform(*np.log((low, high)), SPHERES))
        cost = best_time(lambda eps=eps: wall_functions_array(eps)) / SPHERES * 1e9
        some = np.geomspace(low, high, 40)
        error = np.abs(wall_functions_array(some) / [exact(e) for e in some] - 1).max(axis=0)
        sys.stdout.write(f"{low:8.0e} {high:8.0e} {cost:9.0f}  {' '.join(f'{e:.0e}' for e in error)}\n")
    sys.stdout.write(f"wall_resistance from Python: {nanoseconds_of_resistance():.0f} ns\n")


if __name__ == "__main__":
    main()
