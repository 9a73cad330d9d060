"""Time the Rotne-Prager-Blake kernels: products for many spheres, prepare and solve for few. Prints tables.

Run as ``python benchmarks/rpb_product.py [COUNT ...]``. Products stand beside a plain loop over pairs and beside the
machine's peak, fused multiply-adds in all registers on all threads, each timed in turns with the product so that other
work on the machine falls on all of them. Operations are those in the assembly of the product's loops, a fused
multiply-add being two, a division or a root one, for each of the N² ordered pairs; useful ones count an inverse root as
a root and a division.
"""

import math
import re
import sys
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from mpad_core.arrays import Array
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.numerics import stokeslet_products as products
from mpad_core.numerics.compiled import compiled_parallel, compiled_sums
from mpad_core.numerics.stokeslets import pair_block
from mpad_core.numerics.vectors import wide_registers
from mpad_rpb import RotnePragerBlake

FLUID = Setting(viscosity=1e-3, shear_rate=80.0)
KERNELS = {
    True: (products.sweep_wall, products.sweep_forces_wall),
    False: (products.sweep_free, products.sweep_forces_free),
}
ROOT_EXCESS = 18  # operations in the series of `inverse_root`, beyond one root and one division; shared by both orders
CHAINS, LENGTH, TIMES = 128, 8, 50_000  # sums side by side, multiply-adds of each, and how often: some milliseconds


def cells(count: int) -> Configuration:
    """Give cells of radius 5 on a jittered lattice above the wall, lowest gaps 0.2 to 2.2."""
    rng = np.random.default_rng(count)
    side = int(np.ceil(count ** (1 / 3)))
    lattice = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)[:count]
    centres = 12.5 * lattice + rng.uniform(-1, 1, (count, 3))
    centres[:, 2] += 6.2
    return Configuration(centres=centres, radii=np.full(count, 5.0))


@compiled_parallel
def plain_product(centres: Array, radii: Array, viscosity: float, wall: bool, loads: Array) -> Array:
    """Give what `mobility_product` gives, block by block."""
    scale, velocity = 1 / (8 * math.pi * viscosity), np.zeros_like(loads)
    for i in numba.prange(len(radii)):
        block = np.empty((6, 6))
        for j in range(len(radii)):
            pair_block(centres[i], centres[j], radii[i], radii[j], scale, wall, block)
            for k in range(6):
                for m in range(6):
                    velocity[i, k] += block[k, m] * loads[j, m]
    return velocity


@compiled_sums
def _multiply_add(factor: float, term: float) -> float:
    wide_registers()
    sums = np.zeros(CHAINS)
    for _ in range(TIMES):
        for k in range(CHAINS):
            x = sums[k]
            for _ in range(LENGTH):
                x = x * factor + term
            sums[k] = x
    return sums.sum()  # type: ignore[no-any-return]


@compiled_parallel
def multiply_adds(threads: int) -> Array:
    """Do nothing but fused multiply-adds on so many threads."""
    out = np.zeros(threads)
    for i in numba.prange(threads):
        out[i] = _multiply_add(0.5, 1.0)
    return out


def instructions(kernel: Any) -> list[tuple[float, Counter[str]]]:
    """Give for each stretch of a kernel's assembly how often it runs per source, and what it does to doubles.

    A loop over a tile tells by its step, in bytes or in numbers, how many times it goes round.
    """
    fresh = numba.jit(**kernel.targetoptions)(kernel.py_func)  # from the cache there is no assembly to read
    fresh.compile((numba.float64[::1],) * 3)
    lines = next(iter(fresh.inspect_asm().values())).splitlines()
    labels = {line.split(":")[0]: i for i, line in enumerate(lines) if re.match(r"\.LBB\S+:", line)}
    loops = []
    for i, line in enumerate(lines):
        target = re.match(r"\s+j\w+\s+(\.LBB\w+)", line)
        if target and labels.get(target[1], i) < i:
            loops.append((labels[target[1]], i))
    found = []
    for start, end in loops:
        body = lines[start:end]
        if any(start <= a and b <= end and (a, b) != (start, end) for a, b in loops):
            continue  # not an inner loop
        packed = Counter[str]()
        for line in body:
            word = re.match(r"\s+(v\w+pd)\s.*%([xyz])mm", line)
            if word:
                packed[f"{word[1]} {'xyz'.index(word[2])}"] += 1
        steps = [int(step) for step in re.findall(r"addq\s+\$(\d+), %r\w+", "\n".join(body))]
        if packed and steps:
            numbers = steps[-1] // 8 if steps[-1] >= 64 else steps[-1]
            found.append((products.TILE / numbers, packed))
    return found


def operations(kernel: Any) -> float:
    """Count a kernel's operations per ordered pair."""
    total = 0.0
    for rounds, packed in instructions(kernel):
        for word, count in packed.items():
            name, size = word.split()
            each = 2 if re.match(r"vfn?m(add|sub)", name) else 1 if re.match(r"v(add|sub|mul|div|sqrt)pd", name) else 0
            total += rounds * count * each * 2 ** (1 + int(size))
    return total / products.TILE / 2  # each meeting is two ordered pairs


def best_in_turns(acts: dict[str, Callable[[], object]], seconds: float) -> dict[str, float]:
    """Give the least wall time of each, called in turns for so long and at least three times; what is slow, twice."""
    least: dict[str, float] = dict.fromkeys(acts, math.inf)
    start, turns = time.perf_counter(), 0
    while turns < 3 or time.perf_counter() - start < seconds:
        for name, act in acts.items():
            if turns > 1 and least[name] > 0.2 * seconds:
                continue
            began = time.perf_counter()
            act()
            least[name] = min(least[name], time.perf_counter() - began)
        turns += 1
    return least


def product_times(count: int, wall: bool) -> dict[str, float]:
    """Time the peak, the plain loop, the fused product and that with forces alone, in turns."""
    at, threads = cells(count), numba.get_num_threads()
    loads = np.random.default_rng(1).normal(size=(count, 6))
    forces = np.ascontiguousarray(loads[:, :3])
    given = at.centres, at.radii, 1e-3, wall
    few = slice(3)
    plain_product(at.centres[few], at.radii[few], 1e-3, wall, loads[few])  # compiles
    return best_in_turns(
        {
            "peak": lambda: multiply_adds(threads),
            "plain": lambda: plain_product(*given, loads),
            "fused": lambda: products.mobility_product(*given, loads),
            "forces": lambda: products.translation_product(*given, forces),
        },
        10.0,
    )


def product_tables(counts: list[int]) -> None:
    """Print a line for each count, wall and product; the peak is the best of the whole run."""
    found = {(count, wall): product_times(count, wall) for count in counts for wall in (True, False)}
    threads = numba.get_num_threads()
    peak = 2e-9 * threads * CHAINS * LENGTH * TIMES / min(took["peak"] for took in found.values())
    print(f"peak {peak:.0f} GF/s on {threads} threads")
    print("product     N  wall        ms  ns/pair  operations/pair (useful)    GF/s  of peak  plain loop: ms, ratio")
    for (count, wall), took in found.items():
        for name, kernel in (("fused", KERNELS[wall][0]), ("forces", KERNELS[wall][1])):
            each, pair = operations(kernel), 1e9 * took[name] / count**2
            useful = each - ROOT_EXCESS * (1 + wall) / 2
            speed = f"{each / pair:7.1f}  {100 * each / pair / peak:5.0f} %"
            beside = f"{1e3 * took['plain']:10.1f} {took['plain'] / took[name]:6.1f}"
            print(f"{name:7} {count:5d} {wall!s:>5} {1e3 * took[name]:9.2f} {pair:8.2f} {each:11.1f} ({useful:.1f})"
                  f"{speed:>24} {beside}")  # fmt: skip


def solve(count: int, columns: int) -> None:
    """Time prepare and solve together."""
    solver = RotnePragerBlake()
    plan, at = solver.plan(FLUID), cells(count)
    loads = np.random.default_rng(2).normal(size=(count, 6, columns))
    took = best_in_turns({"solve": lambda: solver.solve(solver.prepare(plan, at), loads)}, 0.2)
    print(f"prepare + solve N={count:5d} columns={columns:2d}  {1e6 * took['solve']:10.1f} µs")


if __name__ == "__main__":
    for few, columns in ((1, 1), (2, 1), (2, 13), (4, 13), (10, 13), (40, 1), (100, 1)):
        solve(few, columns)
    many = [int(word) for word in sys.argv[1:]] or [1000, 5000]
    for count in many:
        solve(count, 1)
    product_tables(many)
