"""Time `sd` from two cells to ten thousand: ``python benchmarks/stokesian_dynamics.py [PICTURE] [COUNT ...]``.

Cells of one size at random places, gaps to the wall 0.01 to 3 radii, that cover 1, 10 or 30 % of it, free in shear and
under their weight; prepare and solve to a residual of 1e-4, cold, compiled, two threads. Memory is the most that the
process has taken so far.
"""

import resource
import sys
import time
from itertools import product

import numpy as np

from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.numerics.stresslets import fts_product
from mpad_sd import StokesianDynamics

FLUID = Setting(viscosity=1e-3, shear_rate=80.0)
COUNTS = (2, 10, 30, 100, 300, 1000, 3000, 10000)
COVERAGES = {0.01: "#1b4965", 0.1: "#e09f3e", 0.3: "#c1121f"}


def cells(count: int, coverage: float) -> Configuration:
    """Give cells of radius 5; a grid of squares finds the neighbours of a new one."""
    rng = np.random.default_rng(count)
    side = np.sqrt(count * np.pi / coverage)
    centres: list[np.ndarray] = []
    squares: dict[tuple[int, int], list[int]] = {}
    while len(centres) < count:
        place = np.array([*rng.uniform(0, side, 2), 1 + 10 ** rng.uniform(-2, 0.5)])
        x, y = int(place[0] // 2.1), int(place[1] // 2.1)
        near = [i for dx, dy in product((-1, 0, 1), repeat=2) for i in squares.get((x + dx, y + dy), ())]
        if all(np.linalg.norm(centres[i] - place) > 2.01 for i in near):
            squares.setdefault((x, y), []).append(len(centres))
            centres.append(place)
    return Configuration(centres=5 * np.array(centres), radii=np.full(count, 5.0))


def timed(count: int, coverage: float, reach: float) -> tuple[float, float, int, int]:
    """Give milliseconds of preparing and of solving, iterations, and near pairs."""
    solver, at, loads = StokesianDynamics(tolerance=1e-4, reach=reach), cells(count, coverage), np.zeros((count, 6))
    loads[:, 2] = -0.25
    plan = solver.plan(FLUID)
    best = [np.inf, np.inf]
    motion = solver.solve(solver.prepare(plan, at), loads)  # compiles
    for _ in range(20 if count <= 300 else 3):
        marks = [time.perf_counter()]
        prepared = solver.prepare(plan, at)
        marks.append(time.perf_counter())
        motion = solver.solve(prepared, loads)
        marks.append(time.perf_counter())
        best = [min(pair) for pair in zip(best, np.diff(marks) * 1e3, strict=True)]
    return best[0], best[1], motion.report.iterations, len(prepared.degrees.who)


def moments(count: int) -> float:
    """Give milliseconds of one product of all pairs' moments."""
    at, loads, times = cells(count, 0.01), np.ones((count, 11)), []
    for _ in range(5):
        start = time.perf_counter()
        fts_product(at.centres, at.radii, 1e-3, True, loads)
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)


def draw(rows: list[tuple[float, int, float]], file: str) -> None:
    """Draw time against number."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 4.5), layout="constrained")
    FigureCanvasAgg(figure)
    panel = figure.subplots()
    for coverage, colour in COVERAGES.items():
        numbers, times = zip(*[(count, spent) for of, count, spent in rows if of == coverage], strict=True)
        panel.plot(numbers, times, "o-", color=colour, label=f"{100 * coverage:.0f} % of the wall covered")
    many = np.array([300.0, 1e4])
    panel.plot(many, 2e-4 * many**2, "--", color="0.6", label="∝ N²")
    panel.set(xscale="log", yscale="log", xlabel="cells", ylabel="prepare and solve (ms), residual 1e-4, two cores")
    panel.grid(color="0.9")
    panel.legend(frameon=False)
    figure.savefig(file, dpi=150)


def main() -> None:
    """Print the table, and draw it if a picture's name is given."""
    given = sys.argv[1:]
    file = given.pop(0) if given and not given[0].isdigit() else None
    rows = []
    print("| cells | covered | near pairs | prepare, ms | solve, ms | iterations | one product of moments, ms | MB |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for count, coverage in product(map(int, given or COUNTS), COVERAGES):
        reach = StokesianDynamics().reach
        made, solved, iterations, near = timed(count, coverage, reach)
        rows.append((coverage, count, made + solved))
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(
            f"| {count} | {100 * coverage:.0f} % | {near} | {made:.3g} | {solved:.3g} | {iterations} "
            f"| {moments(count):.3g} | {peak:.0f} |",
            flush=True,
        )
    if file:
        draw(rows, file)


if __name__ == "__main__":
    main()
