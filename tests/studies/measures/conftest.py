"""Tracks and runs whose measures are known beforehand."""

import numpy as np
import pytest

from mpad_core.interfaces.observer import Frame
from mpad_core.interfaces.values import BOND_EVENT
from mpad_core.records.hdf5 import TrajectoryWriter
from mpad_core.records.header import BondSpecies, TrajectoryHeader
from mpad_core.studies.measures.tracks import Track

SCENE = """\
[flow]
kind = "shear"
rate = "80.0 1/s"
[record.caught]
bound_for = "0.1 s"
slower_than = 0.1
"""
RADIUS = 5.0


@pytest.fixture(scope="session")
def rolling_track():
    """Make a track that rests and jumps: rests of 0.2 s and an exponential time of mean 0.3 s, jumps of 1 ± 0.2 µm."""

    def made(seed, *, duration=200.0, every=0.01, name="a", run=""):
        random = np.random.default_rng([7, seed])
        rests = 0.2 + random.exponential(0.3, size=int(4 * duration) + 50)
        jumps = random.normal(1.0, 0.2, size=len(rests))
        times = every * np.arange(round(duration / every) + 1)
        at = np.searchsorted(np.cumsum(rests), times, side="right")
        x = np.concatenate([[0.0], np.cumsum(jumps)])[at]
        return Track(times=times, x=x, y=0 * x, name=name, run=run)

    return made


@pytest.fixture(scope="session")
def events():
    """Make a table of events of (time, kind, cell, receptor), and where it matters partner and force."""

    def made(rows):
        table = np.zeros(len(rows), BOND_EVENT)
        table["partner"], table["ligand"] = -1, -1
        for event, (time, kind, cell, receptor, *more) in zip(table, rows, strict=True):
            event["time"], event["kind"], event["cell"], event["receptor"] = time, kind, cell, receptor
            event["partner"], event["force"] = (*more, -1, 0.0)[:2] if len(more) != 1 else (more[0], 0.0)
        return table

    return made


@pytest.fixture(scope="session")
def recorded():
    """Write a run of given places (T, N, 2), at a height where cells roll, and events."""

    def written(directory, times, places, happened, **changes):
        cells = places.shape[1]
        given = {
            "cells": tuple(f"cell-{i}" for i in range(cells)),
            "kinds": ("bead",) * cells,
            "radii": (RADIUS,) * cells,
            "seed": 1,
            "scene": SCENE,
            "bonds": (BondSpecies(name="tether"),),
        }
        header = TrajectoryHeader(**{**given, **changes})
        directory.mkdir(parents=True, exist_ok=True)
        with TrajectoryWriter.create(directory / "trajectory.h5", header) as writer:
            for step, (time, place) in enumerate(zip(times, places, strict=True)):
                writer.append(_frame(step, time, place, header.cells))
            writer.append_events(happened)
        return directory / "trajectory.h5"

    return written


def _frame(step, time, place, cells):
    n = len(cells)
    return Frame(
        step=step,
        time=time,
        cells=cells,
        centres=np.column_stack([place, np.full(n, 1.047 * RADIUS)]),
        orientations=np.tile([1.0, 0, 0, 0], (n, 1)),
        velocities=np.zeros((n, 6)),
        wall_gaps=np.full(n, 0.047 * RADIUS),
        overlaps=np.zeros(n),
        bond_counts=np.zeros(n),
        capture_hazards=np.zeros(n),
    )


@pytest.fixture
def rolling_run(recorded, rolling_track, events, tmp_path):
    """Two cells that rest and jump, each held by one bond that stays and others that come and go: a run directory."""
    tracks = [rolling_track(seed, duration=20.0, name=f"cell-{seed}") for seed in range(2)]
    places = np.stack([np.stack([t.x, t.y + 20.0 * i], axis=1) for i, t in enumerate(tracks)], axis=1)
    random, rows = np.random.default_rng(3), [(0.0, 0, cell, 1000) for cell in range(2)]
    for cell in range(2):
        formed = np.sort(random.uniform(0, 20, 200))
        broken = formed + random.exponential(0.5, 200)
        rows += [(t, 0, cell, k) for k, t in enumerate(formed)]
        rows += [(t, 1, cell, k, -1, random.exponential(100.0)) for k, t in enumerate(broken) if t < 20]
    recorded(tmp_path / "rolling", tracks[0].times, places, events(sorted(rows)))
    return tmp_path / "rolling"
