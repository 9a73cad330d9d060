"""Time the Rotne-Prager-Blake kernels: product for many spheres, prepare and solve for few. Prints a table.

Run as ``python benchmarks/rpb_product.py [COUNT ...]``.
"""

import sys
import time
from collections.abc import Callable

import numpy as np

from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.numerics.stokeslet_products import mobility_product
from mpad_rpb import RotnePragerBlake

FLUID = Setting(viscosity=1e-3, shear_rate=80.0)


def cells(count: int) -> Configuration:
    """Give cells of radius 5 on a jittered lattice above the wall, lowest gaps 0.2 to 2.2."""
    rng = np.random.default_rng(count)
    side = int(np.ceil(count ** (1 / 3)))
    lattice = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)[:count]
    centres = 12.5 * lattice + rng.uniform(-1, 1, (count, 3))
    centres[:, 2] += 6.2
    return Configuration(centres=centres, radii=np.full(count, 5.0))


def timed(act: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Give the least and the median wall time in seconds, after one call to warm up."""
    act()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        act()
        times.append(time.perf_counter() - start)
    return min(times), float(np.median(times))


def product(count: int) -> None:
    """Time one product with the grand mobility, with and without wall."""
    at = cells(count)
    loads = np.random.default_rng(1).normal(size=(count, 6))
    for wall in (True, False):
        best, median = timed(lambda w=wall: mobility_product(at.centres, at.radii, 1e-3, w, loads), 15)  # type: ignore[misc]
        per_pair = 1e9 * best / count**2
        times = f"{1e3 * best:8.2f} ms (median {1e3 * median:.2f})"
        print(f"product N={count:5d} wall={wall!s:5}  {times}, {per_pair:.2f} ns/pair")


def solve(count: int, columns: int) -> None:
    """Time prepare and solve together."""
    solver = RotnePragerBlake()
    plan, at = solver.plan(FLUID), cells(count)
    loads = np.random.default_rng(2).normal(size=(count, 6, columns))
    best, median = timed(lambda: solver.solve(solver.prepare(plan, at), loads), 300 if count < 10 else 3)
    print(f"prepare + solve N={count:5d} columns={columns:2d}  {1e6 * best:10.1f} µs (median {1e6 * median:.1f})")


if __name__ == "__main__":
    for few, columns in ((1, 1), (2, 1), (2, 13), (4, 13), (10, 13), (40, 1)):
        solve(few, columns)
    for many in map(int, sys.argv[1:] or ("1000", "5000")):
        product(many)
        solve(many, 1)
