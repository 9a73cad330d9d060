"""Everybody who listens to a march: the trajectory, the observers, the checkpoint.

Order matters: rows are flushed to the trajectory first, then the checkpoint that counts them takes the old one's place.
Whatever instant the process dies at, the checkpoint names rows that exist, and resuming cuts off the rest.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve, fields, frozen

from mpad_core.interfaces.errors import InputError, MpadError, PartError
from mpad_core.interfaces.observer import Frame, Observer
from mpad_core.interfaces.values import BOND_EVENT
from mpad_core.physics.asking import blamed
from mpad_core.physics.measures import Hazards, hazards
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import State, to_arrays
from mpad_core.records.checkpoint import write_checkpoint
from mpad_core.records.hdf5 import TrajectoryWriter
from mpad_core.records.header import BondSpecies, TrajectoryHeader
from mpad_core.records.room import NearlyFullError
from mpad_core.running.frames import frame_of, frames
from mpad_core.running.march import Machine
from mpad_core.running.schedules import Cadence, Schedule

TRAJECTORY, CHECKPOINT = "trajectory.h5", "checkpoint.npz"


@frozen(kw_only=True)
class Recording:
    """What is to be kept of a run."""

    scene: str  # the resolved scene's text
    title: str
    cadence: Cadence
    quantities: tuple[str, ...]
    observers: Sequence[Observer] = ()


@frozen(kw_only=True, eq=False)
class Recorder:
    """Writes a run into its directory."""

    problem: Problem
    recording: Recording
    directory: Path
    hazards: Hazards
    schedule: Schedule
    writer: TrajectoryWriter

    def hear(self, before: State, after: State) -> None:
        """Record what is due between two states, and flush it."""
        due = list(frames(self.problem, self.hazards, self.schedule, before, after))
        for frame in due:
            self.record(frame)
        self.writer.append_events(after.events)
        if due or len(after.events):
            self.writer.flush()

    def record(self, frame: Frame) -> None:
        """Append one frame with what the observers see in it."""
        seen = [value for observer in self.recording.observers for value in _seen(observer, frame)]
        self.writer.append(frame, seen)

    def finish(self, state: State) -> None:
        """Record the last state, unless it has just been recorded."""
        if state.time > self.schedule.last_time:
            self.record(frame_of(self.problem, self.hazards, state))
            self.writer.flush()

    def keep(self, state: State, ended: str = "") -> None:
        """Write the checkpoint; `ended` says why the run is over, once it is.

        The rows that it counts are made to survive a power cut first.
        """
        with suppress(NearlyFullError):  # the caller, who has heard it already, is about to stop
            self.writer.flush(sync=True)
        arrays = to_arrays(state) | self.schedule.memory() | {"ended": np.array(ended)}
        rows = {f"rows.{name}": np.array(count) for name, count in self.writer.rows().items()}
        write_checkpoint(self.directory / CHECKPOINT, arrays | rows)


def _seen(observer: Observer, frame: Frame) -> list[Any]:
    """Give what an observer sees in a copy of the frame, checked against the fields that it declared."""
    arrays = {f.name: getattr(frame, f.name).copy() for f in fields(Frame) if f.name not in ("step", "time", "cells")}
    who = f"observer {observer.name!r}"
    with blamed(who):
        values = [np.asarray(value) for value in observer.see(evolve(frame, **arrays))]
        declared = [tuple(field.shape) for field in observer.fields(frame.cells)]
    shapes = [value.shape for value in values]
    if shapes != declared:
        raise PartError(f"{who} gave values of shapes {shapes} where it declared {declared}")
    return values


def close_observers(observers: Sequence[Observer]) -> None:
    """Tell every observer that the run has ended; the first that fails is named once all have been told."""
    faults = []
    for observer in observers:
        try:
            with blamed(f"observer {observer.name!r}"):
                observer.close()
        except MpadError as error:
            faults.append(error)
    if faults:
        raise faults[0]


def begin_recording(recording: Recording, machine: Machine, directory: Path, state: State) -> Recorder:
    """Make the trajectory, with the frame of time zero in it, and the first checkpoint."""
    problem = machine.problem
    path = directory / TRAJECTORY
    path.unlink(missing_ok=True)  # left by a process that died before its first checkpoint
    declared = [field for observer in recording.observers for field in observer.fields(problem.names)]
    recorder = Recorder(
        problem=problem,
        recording=recording,
        directory=directory,
        hazards=hazards(problem),
        schedule=Schedule.starting(recording.cadence, problem, state),
        writer=TrajectoryWriter.create(path, _header(recording, problem), declared),
    )
    recorder.record(frame_of(problem, recorder.hazards, state))
    recorder.writer.append_events(_bonds_at_zero(machine, state))
    recorder.writer.flush()
    recorder.keep(state)
    return recorder


def go_on_recording(recording: Recording, problem: Problem, directory: Path, kept: Mapping[str, Any]) -> Recorder:
    """Go on with a trajectory from the rows that the checkpoint counts."""
    rows = {name.removeprefix("rows."): count for name, count in kept.items() if name.startswith("rows.")}
    if "frames" not in rows or any(count.shape != () or count.dtype.kind not in "iu" for count in rows.values()):
        raise InputError(
            f"{directory / CHECKPOINT}: does not count the trajectory's rows; start anew elsewhere with -o"
        )
    return Recorder(
        problem=problem,
        recording=recording,
        directory=directory,
        hazards=hazards(problem),
        schedule=Schedule.remembering(recording.cadence, kept),
        writer=TrajectoryWriter.resume(directory / TRAJECTORY, {name: int(count) for name, count in rows.items()}),
    )


def _header(recording: Recording, problem: Problem) -> TrajectoryHeader:
    return TrajectoryHeader(
        cells=problem.names,
        kinds=problem.kinds,
        radii=tuple(problem.radii),
        seed=problem.seed,
        scene=recording.scene,
        bonds=tuple(BondSpecies(name=s.name, reach=s.reach, compression=s.compression) for s in problem.species),
        quantities=recording.quantities,
        title=recording.title,
        version=version("mpad-core"),
    )


def _bonds_at_zero(machine: Machine, state: State) -> Any:
    """List the bonds that a preparation left, as formed at time zero, so that the table of events is complete."""
    bonds, events = state.bonds, np.zeros(len(state.bonds), BOND_EVENT)
    own = machine.fixed.molecules.first[np.maximum(bonds.partner, 0)]
    events["cell"], events["species"] = bonds.cell, bonds.species
    events["ligand"] = np.where(bonds.partner < 0, bonds.ligand, bonds.ligand - own)
    events["partner"], events["state"] = bonds.partner, bonds.state
    events["receptor"] = bonds.site - machine.fixed.molecules.first[bonds.cell]
    events["anchor_x"], events["anchor_y"] = bonds.anchor[:, 0], bonds.anchor[:, 1]
    events["length"], events["force"] = machine.lengths_and_tensions(state)
    return events
