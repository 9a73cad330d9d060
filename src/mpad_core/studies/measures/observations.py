"""What was seen once: a run's trajectory, or an experiment's table of tracks, as one value."""

import tomllib
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve, field, frozen
from numpy.typing import NDArray

from mpad_core.interfaces.errors import InputError
from mpad_core.interfaces.values import Setting
from mpad_core.records.header import TrajectoryHeader
from mpad_core.records.reader import read_trajectory
from mpad_core.records.trajectory import Trajectory
from mpad_core.scene.readers import measure
from mpad_core.studies.measures.bonds import lives_of
from mpad_core.studies.measures.captures import (
    RADII_WITHIN,
    Capture,
    CaptureRule,
    Span,
    bound_spans,
    captures,
    caught_spans,
)
from mpad_core.studies.measures.track_tables import read_tracks
from mpad_core.studies.measures.tracks import Track, tracks_of

_TRAJECTORY = "trajectory.h5"
_ANY_VISCOSITY = 1e-3  # pN s/µm²; a lone cell's speed in a given flow does not depend on it


@frozen(kw_only=True, eq=False)
class Observation:
    """One run, or one table: cells that share a fluid."""

    run: str
    tracks: tuple[Track, ...]  # in frames as recorded
    trajectory: Trajectory | None = None
    free_speed: Callable[[int, float], float] | None = None  # µm/s, of a cell's index at a time (s)
    rule: CaptureRule = field(factory=CaptureRule)

    @cached_property
    def lives(self) -> NDArray[np.void] | None:
        """All bonds' lives, (B,) of BOND_LIFE; None where they were not recorded."""
        known = self.trajectory is not None and "bonds" in self.trajectory.header.quantities
        return lives_of(self.trajectory.bond_events) if self.trajectory is not None and known else None

    @cached_property
    def caught(self) -> tuple[tuple[Span, ...], ...]:
        """From when to when each cell is caught; nothing where free speeds are not known."""
        if self.free_speed is None:
            return tuple(() for _ in self.tracks)
        return tuple(
            tuple(caught_spans(track, self._bound(i), partial(self.free_speed, i), self.rule))
            for i, track in enumerate(self.tracks)
        )

    def captures(self) -> list[Capture]:
        """Give all captures, in the order of time."""
        return captures(self.tracks, self.caught, self.lives, self.rule)

    def _bound(self, cell: int) -> list[Span] | None:
        return None if self.lives is None else bound_spans(self.lives, cell)


def observed_run(path: Path) -> Observation:
    """Read one run's trajectory; the rule of capture is the scene's, R is ten radii of the largest cell."""
    trajectory = read_trajectory(path)
    scene = _scene(trajectory.header)
    run = str(path.parent)
    return Observation(
        run=run,
        tracks=tracks_of(trajectory, run=run),
        trajectory=trajectory,
        free_speed=_free_speed(trajectory, scene),
        rule=CaptureRule(within=RADII_WITHIN * max(trajectory.header.radii), **_caught(scene)),
    )


def observed_table(path: Path, *, length_unit: float | None, time_unit: float | None) -> Observation:
    """Read a table of tracks; units as `read_tracks` has them."""
    return Observation(run=str(path), tracks=read_tracks(path, length_unit=length_unit, time_unit=time_unit))


def observations(
    paths: Sequence[Path], *, length_unit: float | None = None, time_unit: float | None = None,
    free_speed: float | None = None, within: float | None = None,
) -> list[Observation]:  # fmt: skip
    """Read runs and tables.

    Parameters
    ----------
    paths
        Run directories (with all seeds of a passage, without its controls), trajectories, tables of tracks.
    length_unit, time_unit
        Of tables, as `read_tracks` has them.
    free_speed
        µm/s, of cells in tables, or of all cells instead of what theory says of each.
    within
        µm, the distance R of captures, instead of ten radii.

    Raises
    ------
    InputError
        One line, for what cannot be read, or is given twice.
    """
    files = [file for path in paths for file in _files(path)]
    twice = [str(file) for i, file in enumerate(files) if file.resolve() in {f.resolve() for f in files[:i]}]
    if twice:
        raise InputError(f"{twice[0]}: is given twice; each run counts once")
    found = [_observed(file, length_unit, time_unit) for file in files]
    if free_speed is not None:
        found = [evolve(o, free_speed=lambda cell, time: free_speed) for o in found]
    return found if within is None else [evolve(o, rule=evolve(o.rule, within=within)) for o in found]


def _observed(file: Path, length_unit: float | None, time_unit: float | None) -> Observation:
    if file.suffix in (".h5", ".h5md", ".hdf5"):
        return observed_run(file)
    return observed_table(file, length_unit=length_unit, time_unit=time_unit)


def _files(path: Path) -> Iterator[Path]:
    if not path.is_dir():
        yield path
        return
    found = [path / _TRAJECTORY, *sorted(path.glob(f"seed-*/{_TRAJECTORY}"), key=lambda p: (len(str(p)), str(p)))]
    if not found[0].exists():
        raise InputError(f"{path}: holds no {_TRAJECTORY}; give a run directory or a table of tracks")
    yield from found


def _scene(header: TrajectoryHeader) -> dict[str, Any]:
    """Read the resolved scene that a trajectory carries; its parts need not be installed here."""
    try:
        return tomllib.loads(header.scene)
    except tomllib.TOMLDecodeError:
        return {}


def _caught(scene: dict[str, Any]) -> dict[str, float]:
    try:
        rule = scene["record"]["caught"]
        return {"bound_for": measure(rule["bound_for"], "s"), "slower_than": float(rule["slower_than"])}
    except (KeyError, TypeError, ValueError):
        return {}


def _shear_rate(scene: dict[str, Any]) -> float:
    try:
        off = scene.get("effects", {}).get("shear") == "off"
        return 0.0 if off else measure(scene["flow"]["rate"], "1/s")
    except (KeyError, TypeError, ValueError):
        return 0.0


def _free_speed(trajectory: Trajectory, scene: dict[str, Any]) -> Callable[[int, float], float] | None:
    """Give each cell's speed, were it alone at its height; None where the scene does not tell of a flow."""
    shear_rate = _shear_rate(scene)
    if not shear_rate:
        return None
    wall = bool(np.isfinite(trajectory.wall_gaps).all())
    setting = Setting(viscosity=_ANY_VISCOSITY, shear_rate=shear_rate, wall=wall)

    def speed(cell: int, time: float) -> float:
        from mpad_core.physics.coupling import lone_velocity

        frame = min(int(np.searchsorted(trajectory.times, time)), len(trajectory) - 1)
        height, gap = float(trajectory.positions[frame, cell, 2]), float(trajectory.wall_gaps[frame, cell])
        return lone_velocity(setting, float(trajectory.header.radii[cell]), height, gap)

    return speed
