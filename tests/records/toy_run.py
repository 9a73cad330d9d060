"""A toy run: the outline of a real one (lock, resume or create, step, record, checkpoint), to be killed at any moment.

As a program it is a server: for each line ``directory steps`` it forks a child that does the run and says its number;
after the next line it waits for the child's end and says how it ended. So a kill costs no interpreter's start, and a
number is in use until its child has been asked after.
"""

import os
import sys
from pathlib import Path

import numpy as np

from mpad_core.interfaces.observer import FieldDeclaration, Frame
from mpad_core.interfaces.values import BOND_EVENT
from mpad_core.records.checkpoint import read_checkpoint, write_checkpoint
from mpad_core.records.hdf5 import TrajectoryWriter
from mpad_core.records.header import BondSpecies, TrajectoryHeader
from mpad_core.records.lock import locked
from mpad_core.records.log import RunLog

CELLS = 3
EVERY = 7  # frames between checkpoints
FIELDS = (
    FieldDeclaration(name="tilt", unit="1", shape=(2, CELLS)),
    FieldDeclaration(name="contacts", unit="1", dtype="i4"),
)


def header(**changes) -> TrajectoryHeader:
    names = tuple(f"cell {index}" for index in range(CELLS))
    given = {
        "cells": names,
        "kinds": ("neutrophil", "bead", "neutrophil"),
        "radii": (5.0, 3.25, 5.1),
        "seed": 2**63 + 5,
        "scene": '[fluid]\nshear_rate = "100 1/s"  # \u00b5\n',
        "bonds": (BondSpecies(name="P-selectin", reach="overlap", compression="slack"),),
        "title": "toy",
        "author": "nobody",
        "version": "0.1.0",
    }
    return TrajectoryHeader(**{**given, **changes})


def frame(step: int, state: np.ndarray) -> Frame:
    random = np.random.default_rng(step)
    return Frame(
        step=10 * step,
        time=0.1 * step,
        cells=header().cells,
        centres=state,
        orientations=random.normal(size=(CELLS, 4)),
        velocities=random.normal(size=(CELLS, 6)),
        wall_gaps=random.random(CELLS),
        overlaps=np.where(random.random(CELLS) < 0.5, np.nan, 1e-3),
        bond_counts=random.integers(0, 9, CELLS).astype(float),
        capture_hazards=random.random(CELLS),
    )


def values(step: int) -> tuple[np.ndarray, int]:
    return np.full((2, CELLS), step / 3.0), step


def events(step: int) -> np.ndarray:
    made = np.zeros(step % 4, dtype=BOND_EVENT)
    made["time"] = 0.1 * step
    made["receptor"] = np.arange(len(made))
    made["force"] = np.random.default_rng(step).random(len(made))
    return made


def moved(state: np.ndarray, step: int) -> np.ndarray:
    return state + np.random.default_rng([step, 1]).normal(size=state.shape)


def begin(trajectory: Path, checkpoint: Path) -> tuple[TrajectoryWriter, np.ndarray, int]:
    if checkpoint.exists():
        held = read_checkpoint(checkpoint)
        rows = {"frames": int(held["frames"]), "bond_events": int(held["bond_events"])}
        return TrajectoryWriter.resume(trajectory, rows, reserve=0), held["state"], int(held["step"])
    start = np.arange(3.0 * CELLS).reshape(CELLS, 3)
    if trajectory.exists():
        return TrajectoryWriter.resume(trajectory, {}, reserve=0), start, 0
    return TrajectoryWriter.create(trajectory, header(), FIELDS, reserve=0, chunk_bytes=2**10), start, 0


def run(directory: Path, steps: int) -> None:
    acknowledged = os.open(directory / "acknowledged", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    checkpoint = directory / "checkpoint.npz"
    with locked(directory):
        writer, state, first = begin(directory / "trajectory.h5", checkpoint)
        log = RunLog(directory / "run.jsonl", resume_at=0.1 * first)
        for step in range(first, steps):
            if step % EVERY == 0:
                rows = {name: np.array(count) for name, count in writer.rows().items()}
                write_checkpoint(checkpoint, {"state": state, "step": np.array(step), **rows})
            writer.append(frame(step, state), values(step))
            writer.append_events(events(step))
            writer.flush()
            os.pwrite(acknowledged, b"%8d %8d" % tuple(writer.rows().values()), 0)
            log.write("frame", step=step)
            state = moved(state, step)
        writer.close()


def serve() -> None:
    for line in sys.stdin:
        directory, steps = line.split()
        child = os.fork()
        if child == 0:
            run(Path(directory), int(steps))
            os._exit(0)
        print("child", child, flush=True)
        sys.stdin.readline()
        print("ended", os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


if __name__ == "__main__":
    serve()
