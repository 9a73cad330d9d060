"""Time the spectral CDL-BIEM solver and measure its errors: ``python benchmarks/cdl_biem.py [--quick]``.

One thread, compiled, the least time of several runs. Errors: relative 2-norms of (U, aΩ) against a higher degree.
"""

import sys
import time

import numpy as np

from mpad_cdlbiem import CdlBiem
from mpad_core.interfaces.values import Configuration, Setting

SETTING = Setting(viscosity=1.0, shear_rate=1.0)
TRI = {  # gap: Ux, Uz, Ωy of two spheres at one gap from each other and from the wall; harmonics, fundamental solutions
    1.0: (1.92046757, -0.02089846, 0.44965618),
    0.1: (0.76371698, -0.00112176, 0.29411237),
    0.01: (0.451644, 0.0011257, 0.181131),
    0.001: (0.318510, 0.000196, 0.126396),
}


def tri(gap):
    return Configuration(centres=[[0, 0, 1 + gap], [2 + gap, 0, 1 + gap]], radii=[1, 1], wall_gaps=[gap, gap])


def cells(count, coverage, rng):
    """Give cells at random places, gaps to the wall 0.01 to 0.3, that cover a part of the wall."""
    side, places = np.sqrt(count * np.pi / coverage), np.empty((0, 2))
    while len(places) < count:
        place = rng.uniform(0, side, 2)
        if (np.linalg.norm(places - place, axis=1) > 2.02).all():
            places = np.vstack([places, place])
    gaps = np.exp(rng.uniform(np.log(0.01), np.log(0.3), count))
    return Configuration(centres=np.column_stack([places, 1 + gaps]), radii=np.ones(count), wall_gaps=gaps)


def stepped(at, velocity):
    """Give the configuration after the spheres went 1e-3 along their velocities."""
    step = 1e-3 * velocity[:, :3] / np.abs(velocity[:, :3]).max()
    return Configuration(centres=at.centres + step, radii=at.radii, wall_gaps=at.wall_gaps + step[:, 2])


def solved(solver, plan, at, columns=None, guess=None):
    loads = np.zeros((len(at.radii), 6)) if columns is None else np.ones((len(at.radii), 6, 1)) * np.arange(columns)
    prepared = solver.prepare(plan, at, guess)
    return prepared, solver.solve(prepared, loads)


def best(act, budget=0.5):
    """Milliseconds of the fastest run, the first (compilation, tables) left out."""
    act()
    times = [time.perf_counter()]
    while times[-1] < times[0] + budget and len(times) < 50:
        act()
        times.append(time.perf_counter())
    return 1e3 * np.diff(times).min()


def bytes_in(value):
    """Give the bytes of all arrays that hang from a value, those that both levels share twice."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    names = (a.name for a in getattr(type(value), "__attrs_attrs__", ()) if a.name != "plan")
    inside = value if isinstance(value, tuple) else [getattr(value, name) for name in names]
    return sum(map(bytes_in, inside))


def row(name, at, solver, degree):
    """Time one configuration cold, warm and for 13 columns, and measure its error."""
    plan = solver.plan(SETTING)
    prepared, motion = solved(solver, plan, at)
    cold = best(lambda: solved(solver, plan, at))
    finest = CdlBiem(degree=degree, accuracy=1e-8, tolerance=1e-9)
    true = solved(finest, finest.plan(SETTING), at)[1].velocity if degree else np.nan
    near = stepped(at, motion.velocity)
    warm = best(lambda: solved(solver, plan, near, guess=motion.guess))
    again = solved(solver, plan, near, guess=motion.guess)[1].report.iterations
    block = best(lambda: solved(solver, plan, at, 13)) if len(at.radii) == 2 else np.nan
    error, report = np.linalg.norm(motion.velocity - true) / np.linalg.norm(true), motion.report
    print(
        f"{name:16} {solver.accuracy:7.0e} {cold:9.2f} {report.iterations:4d} {warm:9.2f} {again:4d} {block:8.2f}",
        end="",
    )
    print(f" {error:8.1e} {report.error:8.1e} {bytes_in(prepared) / 1e6:8.2f}", flush=True)


def times(quick):
    print(f"{'':16} accuracy   cold ms   it   warm ms   it  13 cols    error estimate       MB")
    for accuracy in (1e-2, 1e-3, 1e-4):
        for gap in TRI:
            row(f"N=2 gap {gap:g}", tri(gap), CdlBiem(accuracy=accuracy), 60)
    crowds = [(n, part) for n in ((10,) if quick else (10, 50)) for part in (0.01, 0.1, 0.3)]
    for accuracy in (1e-2,) if quick else (1e-2, 1e-3, 1e-4):
        for count, coverage in crowds:
            at = cells(count, coverage, np.random.default_rng(count))
            row(f"N={count} {coverage:4.0%}", at, CdlBiem(accuracy=accuracy), 24 if count == 10 else None)


def degrees(quick):
    print(f"\nerror by degree and gap, all three alike\n{'':8} " + "".join(f"{g:>10g}" for g in TRI))
    for degree in (2, 3, 4, 6, 8, 12, 16, 24, 32, *(() if quick else (48, 64))):
        solver = CdlBiem(degree=degree, accuracy=1e-8, tolerance=1e-9)
        print(f"{degree:8d} " + "".join(f"{of_tri(solver, gap):10.1e}" for gap in TRI))
    elements = CdlBiem(discretisation="elements", elements=96)
    print(f"{'96 el.':>8} " + "".join(f"{of_tri(elements, gap):10.1e}" for gap in TRI))
    plan = elements.plan(SETTING)
    print(f"96 elements, gap 0.01: prepare and solve {best(lambda: solved(elements, plan, tri(0.01))):.0f} ms")


def of_tri(solver, gap):
    along, up, spin = TRI[gap]
    true = np.array([[along, 0, up, 0, spin, 0], [along, 0, -up, 0, spin, 0]])
    return np.linalg.norm(solved(solver, solver.plan(SETTING), tri(gap))[1].velocity - true) / np.linalg.norm(true)


if __name__ == "__main__":
    times("--quick" in sys.argv[1:])
    degrees("--quick" in sys.argv[1:])
