"""A scene run from beginning to end: one run, or a passage with its controls and seeds, and what came out of it."""

import hashlib
import json
import time
from collections.abc import Callable, Iterator
from functools import partial
from os import PathLike
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from attrs import frozen

from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.physics.auto import Auto
from mpad_core.physics.problem import Problem
from mpad_core.records.directory import make_directory, write_whole
from mpad_core.records.lock import locked
from mpad_core.records.log import RunLog
from mpad_core.records.progress import progress, warn
from mpad_core.records.reader import read_trajectory
from mpad_core.records.trajectory import Trajectory
from mpad_core.running.choosing import kept_choice, settled
from mpad_core.running.recorder import TRAJECTORY, Recording
from mpad_core.running.run import CHECKPOINT_EVERY, Order, Outcome, Session, run_one
from mpad_core.running.schedules import Cadence
from mpad_core.running.stopping import interruptible, listening
from mpad_core.scene.attached import files_of
from mpad_core.scene.compose import compose
from mpad_core.scene.spec import Scene
from mpad_core.scene.warnings import warnings_of
from mpad_core.scene.writing import resolved_toml
from mpad_core.studies import contributions
from mpad_core.studies.conditions import stop_conditions
from mpad_core.studies.passage import Path, describe, free_part, path_of

SCENE, SUMMARY, LOG, PICTURE = "scene.toml", "summary.json", "run.jsonl", "passage.png"


@frozen(kw_only=True, eq=False)
class Case:
    """One single run of a scene."""

    folder: str  # below the run directory; "" for the directory itself
    seed: int
    control: bool
    problem: Problem


@frozen(kw_only=True, eq=False)
class Result:
    """What one case gave."""

    case: Case
    outcome: Outcome
    trajectory: Trajectory


def cases(scene: Scene) -> Iterator[Case]:
    """Yield the single runs that a scene asks for: every seed, each followed by its control."""
    study = scene.passage
    for replicate in range(study.seeds if study else 1):
        problem = compose(scene, replicate)
        folder = f"seed-{problem.seed}" if replicate else ""
        yield Case(folder=folder, seed=problem.seed, control=False, problem=problem)
        if study and study.control:
            staying = [i for i, name in enumerate(problem.names) if name not in study.past]
            control = problem.only(staying)
            yield Case(folder=str(FilePath(folder, "control")), seed=problem.seed, control=True, problem=control)


def run(
    scene: Scene, directory: str | PathLike[str], *, resume: bool = False, checkpoint_every: float = CHECKPOINT_EVERY
) -> dict[str, Any]:
    """Run a scene into a directory.

    Parameters
    ----------
    scene
        See `mpad_core.load_scene`.
    directory
        Made if it does not exist. It receives ``trajectory.h5`` (H5MD), ``checkpoint.npz``, ``scene.toml`` (resolved),
        ``summary.json`` and ``run.jsonl``; a passage adds ``control/``, ``seed-<n>/`` and ``passage.png``; files that
        the scene gives to its parts are copied into ``files/``.
    resume
        Go on with the run that the directory holds.
    checkpoint_every
        Wall time (s) between checkpoints.

    Returns
    -------
    dict
        The summary.

    Raises
    ------
    InputError
        If the directory holds a run and `resume` is not set, or another scene's run and it is.
    BusyError
        If another process is writing there.
    InterruptedRunError, PartError, RefusedError, DiskFullError
        As `mpad_core.running.run.run_one`.
    """
    root = FilePath(directory)
    text = resolved_toml(scene)
    todo = list(cases(scene))
    with listening() as signals:
        make_directory(root)
        with locked(root):
            choice = _with_choice(scene, root, resume)
            if choice is not scene:
                scene, text, todo = choice, resolved_toml(choice), list(cases(choice))
            _claim(root, scene, text, resume)
            with RunLog(root / LOG) as log:
                session = Session(log=log, signals=signals, resume=resume)
                return _claimed(scene, todo, root, partial(_order, scene, text, checkpoint_every), session)


def _claimed(
    scene: Scene, todo: list[Case], root: FilePath, ordered: Callable[[Case], Order], session: Session
) -> dict[str, Any]:
    """Run all cases into a directory that is the scene's; give the summary."""
    began, log = time.monotonic(), session.log
    log.write("started", scene=scene.title, runs=len(todo), resume=session.resume, solver=scene.solver.parameters)
    _warn(scene, todo[0].problem, log)
    results = [_run_case(case, ordered(case), root / case.folder, session) for case in todo]
    summary = contributions.remembered(_summary(scene, results, time.monotonic() - began), root / SUMMARY)
    write_whole(root / SUMMARY, (json.dumps(summary, indent=2, ensure_ascii=False) + "\n").encode())
    if scene.passage:
        _draw(scene, results, root / PICTURE)
    log.write("finished", wall_s=time.monotonic() - began)
    return summary


def _warn(scene: Scene, problem: Problem, log: RunLog) -> None:
    """Say what is doubtful about a scene; doubts that cannot be worked out are no reason not to run it."""
    try:
        for doubt in warnings_of(scene, problem):
            warn(log, doubt.effect, doubt.text)
    except PartError as error:
        log.write("warnings not told", why=str(error))


def _with_choice(scene: Scene, root: FilePath, resume: bool) -> Scene:
    """Give the scene with the solver that it leaves open: that of the run to be resumed, or a new choice."""
    if (root / SCENE).exists():
        return kept_choice(scene, root / SCENE) if resume else scene
    if scene.solver.name != Auto.name:
        return scene
    with interruptible():
        return settled(scene)


def _claim(root: FilePath, scene: Scene, text: str, resume: bool) -> None:
    """Make the directory this scene's, or see that it is."""
    there = root / SCENE
    if not there.exists():
        if (root / TRAJECTORY).exists():
            raise InputError(f"{root}: holds a trajectory without its scene; choose another directory with -o")
        _keep_files(root, scene)
        write_whole(there, text.encode())
    elif not resume:
        raise InputError(f"{root}: holds a run already; add --resume to go on with it, or choose another with -o")
    elif there.read_bytes() != text.encode():
        raise InputError(f"{there}: is of another scene or of other settings; --resume needs the very same scene")


def _keep_files(root: FilePath, scene: Scene) -> None:
    """Copy the files of the scene's parts, which its resolved form names."""
    for file in files_of(scene):
        raw = file.path.read_bytes()
        if hashlib.sha256(raw).hexdigest() != file.sum:
            raise InputError(f"{file.path}: has changed since the scene was read; start again")
        copy = root / file.kept_as
        copy.parent.mkdir(exist_ok=True)
        write_whole(copy, raw)


def _run_case(case: Case, order: Order, folder: FilePath, session: Session) -> Result:
    with progress(order.until, log=session.log) as bar:
        outcome = run_one(order, folder, session, bar)
    session.log.write("run ended", run=case.folder or ".", ended=outcome.ended, simulated=outcome.state.time)
    return Result(case=case, outcome=outcome, trajectory=read_trajectory(folder / TRAJECTORY))


def _order(scene: Scene, text: str, checkpoint_every: float, case: Case) -> Order:
    problem, every = case.problem, scene.record.every
    followed = (
        scene.passage.cell
        if scene.passage
        else next((name for name, held in zip(problem.names, problem.held, strict=True) if not held), problem.names[0])
    )
    recording = Recording(
        scene=text,
        title=scene.title + (" (control)" if case.control else ""),
        cadence=Cadence(time=every.time, dx=every.dx, cell=problem.names.index(followed)),
        quantities=scene.record.what,
        observers=tuple(part.instance for part in scene.record.observers),
    )
    return Order(
        problem=problem,
        recording=recording,
        until=scene.stop.time,
        stop_when=stop_conditions(scene),
        checkpoint_every=checkpoint_every,
    )


def _cells(result: Result) -> dict[str, Any]:
    """Describe every cell's run: mean speed and height, least overlap, captures."""
    problem, state, path = result.case.problem, result.outcome.state, result.trajectory
    duration = path.times[-1] - path.times[0]
    described = {}
    for i, name in enumerate(problem.names):
        x, z = path.positions[:, i, 0], path.positions[:, i, 2]
        lasting = duration > 0
        speed = (x[-1] - x[0]) / duration if lasting else float("nan")
        scale = problem.setting.shear_rate * problem.radii[i]
        described[name] = {
            "mean_speed_um_per_s": speed,
            "mean_speed_over_gamma_a": speed / scale if scale else None,
            "mean_height_um": np.trapezoid(z, path.times) / duration if lasting else z[0],
            "least_overlap_nm": 1e3 * float(np.min(z - problem.zero_overlap[i])),
            "bonds_at_end": int(state.bond_counts()[i]),
            "caught_at_s": state.caught_since[i] if np.isfinite(state.caught_since[i]) else None,
            "effects": contributions.of_cell(result.outcome.account, i),
        }
    return described


def _summary(scene: Scene, results: list[Result], wall: float) -> dict[str, Any]:
    first = results[0]
    summary: dict[str, Any] = {
        "title": scene.title,
        "solver": scene.solver.name,
        "effects": contributions.described(first.case.problem, first.outcome.account),
        "bonds": {
            s.name: {"model": s.model.name, "reach": s.reach, "compression": s.compression, "on_rate_per_s": s.on_rate}
            for s in first.case.problem.species
        },
        "sub_step_s": first.outcome.sub_step,
        "wall_s": wall,
        "runs": [
            {
                "folder": result.case.folder or ".",
                "seed": result.case.seed,
                "control": result.case.control,
                "ended": result.outcome.ended,
                "time_s": result.outcome.state.time,
                "cells": _cells(result),
                "effects": contributions.described(result.case.problem, result.outcome.account),
                "time_shares": contributions.spent(result.outcome.account),
            }
            for result in results
        ],
    }
    if scene.passage:
        summary["passage"] = _passage(scene, results)
    if isinstance(first.case.problem.solver, Auto):
        summary["solver_choice"] = _choice(first.case.problem.solver, results)
    plain: dict[str, Any] = _plain(summary)
    return plain


def _choice(solver: Auto, results: list[Result]) -> dict[str, Any]:
    """Describe what `auto` chose, and what it had climbed to at the end of each run."""
    return {
        "accuracy": solver.accuracy,
        "chose": solver.levels[0],
        "reason": solver.reason,
        "at_end": [solver.levels[result.outcome.state.level] for result in results],
    }


def _paths(scene: Scene, results: list[Result], control: bool) -> tuple[list[Path], list[Path]]:
    """Give the followed cell's paths, and their parts before the first bond."""
    assert scene.passage is not None
    paths, free = [], []
    for result in results:
        if result.case.control == control:
            problem, cell = result.case.problem, scene.passage.cell
            caught = result.outcome.state.caught_since[problem.names.index(cell)]
            paths.append(path_of(problem, result.trajectory, cell, float(caught)))
            free.append(free_part(paths[-1], result.trajectory))
    return paths, free


def _passage(scene: Scene, results: list[Result]) -> dict[str, Any]:
    """Describe every passage beside its control, and count the captures."""
    assert scene.passage is not None
    (paths, free), (alone, alone_free) = _paths(scene, results, False), _paths(scene, results, True)
    beside = alone_free if alone else [None] * len(paths)
    rates = scene.passage.also_on_rates
    described = [describe(p, f, a, rates) for p, f, a in zip(paths, free, beside, strict=True)]
    return {
        "cell": scene.passage.cell,
        "past": list(scene.passage.past),
        "passages": described,
        "caught": sum(passage["caught"] for passage in described),
        "of": len(paths),
        "caught_in_control": sum(bool(np.isfinite(path.caught_at)) for path in alone) if alone else None,
        "controls": [describe(p, f, None, ()) for p, f in zip(alone, alone_free, strict=True)],
    }


def _plain(value: Any) -> Any:
    """Turn numpy's numbers into Python's, and what is no number into null, which JSON knows."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.bool_ | bool):
        return bool(value)
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, np.floating | float):
        return float(value) if np.isfinite(value) else None
    return value


def _draw(scene: Scene, results: list[Result], file: FilePath) -> None:
    from mpad_core.studies.pictures import draw_passages

    assert scene.passage is not None
    draw_passages(
        _paths(scene, results, False), _paths(scene, results, True), scene.passage.also_on_rates, scene.title, file
    )
