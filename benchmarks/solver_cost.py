"""What accuracy costs in time: all solvers on the same configurations. Prints the tables of ``docs/cost.md``.

Run as ``python benchmarks/solver_cost.py [PICTURE]``: some five minutes. Cells of one size are free in shear above the
wall and pulled down by a load as strong as the shear's. Errors against `cdl-biem` at a finer level than any shown: the
relative 2-norm of (U, aΩ), and of the velocities normal to the wall alone, which are some hundredths of those along it.
Times: prepare and solve, cold, compiled, the least of several runs.
"""

import sys
import time
from collections.abc import Iterator

import numpy as np

from mpad_core import solver
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import Array, Configuration, Setting

FLUID = Setting(viscosity=1.0, shear_rate=1.0)
SOLVERS: dict[str, tuple[str, dict[str, object]]] = {
    "isolated": ("isolated", {}),
    "rpb": ("rpb", {}),
    "sd, reach 1.5": ("sd", {"reach": 1.5}),
    "sd": ("sd", {}),
    "cdl-biem 1e-2": ("cdl-biem", {"accuracy": 1e-2}),
    "cdl-biem 1e-3": ("cdl-biem", {"accuracy": 1e-3}),
    "cdl-biem 1e-4": ("cdl-biem", {"accuracy": 1e-4}),
}
COLOURS = ("#8d99ae", "#c1121f", "#e09f3e", "#b5651d", "#83c5be", "#3d8b8b", "#1b4965")


def pair(gaps: tuple[float, float], rng: np.random.Generator) -> Configuration:
    """Give two cells in any orientation, all three gaps within bounds."""
    low, high = np.log(gaps)
    while True:
        between, first = np.exp(rng.uniform(low, high, 2))
        direction = rng.normal(size=3)
        step = (2 + between) * direction / np.linalg.norm(direction)
        centres = np.array([0, 0, 1 + first]) + np.array([np.zeros(3), step])
        if gaps[0] <= centres[1, 2] - 1 <= gaps[1]:
            return Configuration(centres=centres, radii=[1.0, 1.0])


def cells(count: int, coverage: float, rng: np.random.Generator) -> Configuration:
    """Give cells at random places, gaps to the wall 0.01 to 0.3, that cover a part of the wall."""
    side, places = np.sqrt(count * np.pi / coverage), np.empty((0, 2))
    while len(places) < count:
        place = rng.uniform(0, side, 2)
        if (np.linalg.norm(places - place, axis=1) > 2.02).all():
            places = np.vstack([places, place])
    gaps = np.exp(rng.uniform(np.log(0.01), np.log(0.3), count))
    return Configuration(centres=np.column_stack([places, 1 + gaps]), radii=np.ones(count))


def sets() -> Iterator[tuple[str, float, list[Configuration]]]:
    """Yield each set's name, the reference's accuracy, and the configurations."""
    rng = np.random.default_rng(2026)
    yield "two cells, gaps 0.3 to 3", 1e-6, [pair((0.3, 3.0), rng) for _ in range(20)]
    yield "two cells, gaps 0.001 to 0.1", 1e-5, [pair((1e-3, 0.1), rng) for _ in range(20)]
    yield "ten cells, a tenth of the wall covered", 1e-5, [cells(10, 0.1, rng) for _ in range(5)]
    yield "fifty cells, a tenth of the wall covered", 1e-5, [cells(50, 0.1, rng) for _ in range(2)]


def solved(chosen: MobilitySolver, plan: object, at: Configuration) -> Array:
    """Give the velocities (N, 6) in shear and under a weight."""
    loads = np.zeros((len(at.radii), 6))
    loads[:, 2] = -6 * np.pi
    return chosen.solve(chosen.prepare(plan, at), loads).velocity


def least_time(chosen: MobilitySolver, plan: object, at: Configuration) -> float:
    """Give milliseconds of the fastest of some runs, compiled."""
    solved(chosen, plan, at)
    times = [time.perf_counter()]
    while times[-1] < times[0] + 0.2 or len(times) < 4:
        solved(chosen, plan, at)
        times.append(time.perf_counter())
    return float(1e3 * np.diff(times).min())


def errors(found: Array, true: Array) -> tuple[float, float]:
    """Give the relative errors of all velocities and of those normal to the wall; the radii are 1."""
    norm = np.linalg.norm
    return float(norm(found - true) / norm(true)), float(norm(found[:, 2] - true[:, 2]) / norm(true[:, 2]))


def measured(accuracy: float, places: list[Configuration]) -> dict[str, tuple[float, float, float, float]]:
    """Give each solver's time, median and worst error, and median error normal to the wall."""
    reference = solver("cdl-biem", accuracy=accuracy, tolerance=1e-9)
    plan = reference.plan(FLUID)
    true = [solved(reference, plan, at) for at in places]
    out = {}
    for name, (part, parameters) in SOLVERS.items():
        chosen = solver(part, **parameters)
        plan = chosen.plan(FLUID)
        wrong = [errors(solved(chosen, plan, at), u) for at, u in zip(places, true, strict=True)]
        every, normal = np.array(wrong).T
        spent = float(np.median([least_time(chosen, plan, at) for at in places[:5]]))
        out[name] = (spent, float(np.median(every)), float(every.max()), float(np.median(normal)))
    return out


def draw(results: dict[str, dict[str, tuple[float, float, float, float]]], file: str) -> None:
    """Draw median error against time, a panel for each set."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 7), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 2, sharex=True, sharey=True).ravel()
    for panel, (title, rows) in zip(panels, results.items(), strict=True):
        for colour, (name, (spent, median, worst, _)) in zip(COLOURS, rows.items(), strict=True):
            panel.plot([spent, spent], [median, worst], color=colour, lw=1.5)
            panel.plot(spent, median, "o", color=colour, ms=7, label=name)
        panel.set(title=title, xscale="log", yscale="log")
        panel.grid(color="0.9")
    for panel in panels[2:]:
        panel.set_xlabel("prepare and solve (ms)")
    for panel in panels[::2]:
        panel.set_ylabel("relative error of (U, aΩ): median to worst")
    panels[0].legend(frameon=False, fontsize=8)
    figure.savefig(file, dpi=150)


def main() -> None:
    """Print the tables, and draw the picture if a name is given."""
    results = {}
    for title, accuracy, places in sets():
        results[title] = measured(accuracy, places)
        print(f"\n{title} ({len(places)} configurations)\n")
        print("| solver | ms | error, median | worst | normal to the wall, median |\n| --- | --- | --- | --- | --- |")
        for name, (spent, median, worst, normal) in results[title].items():
            print(f"| {name} | {spent:.2g} | {median:.1e} | {worst:.1e} | {normal:.1e} |", flush=True)
    if len(sys.argv) > 1:
        draw(results, sys.argv[1])


if __name__ == "__main__":
    main()
