"""The scene itself, bonds and all, with every solver: where the free cell is caught, and how fast bound cells roll."""

from collections.abc import Iterator, Sequence

import numpy as np
from attrs import evolve

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import MpadError
from mpad_core.running.march import make_ready
from mpad_core.scene.compose import compose
from mpad_core.scene.spec import Part
from mpad_core.studies.cost.paths import Way, travel
from mpad_core.studies.cost.rows import LONG, Row
from mpad_core.studies.cost.solves import Tried
from mpad_core.studies.cost.subject import Subject, ends_of
from mpad_core.studies.measures.estimates import Estimate, Sample, estimate


def long_runs(subject: Subject, tried: Sequence[Tried]) -> Iterator[tuple[Row, ...]]:
    """Run the scene with every level that answered, the coarsest first; yield the rows after each."""
    rows: list[Row] = []
    for one in tried:
        if one.answers is not None:
            rows.append(_long_row(subject, one))
            yield tuple(rows)


def _long_row(subject: Subject, one: Tried) -> Row:
    row = Row(study=LONG, label=one.level.label, line=one.level.name, claimed=one.level.claim)
    try:
        ways = _ways(subject, one)
    except MpadError as error:
        return evolve(row, note=f"refused: {' '.join(str(error).split())}")
    return evolve(row, time=sum(way.took for way in ways) / len(ways), values=measured(subject, ways))


def _ways(subject: Subject, one: Tried) -> list[Way]:
    """Run every seed of a passage, else the one seed."""
    scene = subject.scene
    part = Part(kind="solver", name=one.level.name, parameters=dict(one.level.parameters))
    ways = []
    for replicate in range(scene.passage.seeds if scene.passage else 1):
        problem = compose(evolve(scene, solver=part), replicate)
        ways.append(travel(make_ready(problem), scene.stop.time, ends_of(scene, problem)))
    return ways


def measured(subject: Subject, ways: Sequence[Way]) -> dict[str, Estimate]:
    """Give what came out of some seeds of the scene, with 95 % intervals where there is enough for one.

    Parameters
    ----------
    subject, ways
        The scene, and its runs, one for each seed.

    Returns
    -------
    dict
        The rolling speed (µm/s) of each cell that can bind, but the one followed; Δx (µm) where that is caught.
    """
    problem, found = subject.problem, {}
    passing = {subject.cell} if subject.scene.passage else set()
    for cell in np.flatnonzero(problem.site_densities.any(axis=1)):
        name = problem.names[cell]
        if cell not in passing:
            speeds = [_speeds(way, int(cell), subject.scene.record.every.time) for way in ways]
            sample = Sample(series=speeds, seeds=len(ways))
            found[f"rolling speed of {name} (um/s)"] = estimate(sample, seed=problem.seed, name=name)
    if passing and problem.site_densities[subject.cell].any():
        places = [way.caught_dx(subject.cell) for way in ways]
        caught = [np.array([x]) for x in places if np.isfinite(x)]
        sample = Sample(series=caught, seeds=len(caught))
        found["caught at dx (um)"] = estimate(sample, seed=problem.seed, name="caught")
        found["caught, of all"] = Estimate(len(caught) / len(ways), seeds=len(ways))
    return found


def _speeds(way: Way, cell: int, every: float) -> Array:
    """Give a cell's speeds (µm/s) along the flow over equal intervals, as a record of the scene would have them."""
    intervals = max(int(way.times[-1] / every), 1)
    times = np.linspace(way.times[0], way.times[-1], intervals + 1)
    x = np.interp(times, way.times, way.centres[:, cell, 0])
    speeds: Array = np.diff(x) / (times[1] - times[0])
    return speeds
