"""All that can be measured on some runs and tables, kind by kind or cell by cell."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TypeAlias

from mpad_core.interfaces.errors import InputError
from mpad_core.studies.measures import bonds as of_bonds
from mpad_core.studies.measures import pauses, rolling
from mpad_core.studies.measures.bonds import CellBonds, bonds_of
from mpad_core.studies.measures.captures import CLASSES, Capture
from mpad_core.studies.measures.estimates import Estimate, Sample, estimate, proportion, quantile, rate
from mpad_core.studies.measures.observations import Observation
from mpad_core.studies.measures.pauses import PauseRule
from mpad_core.studies.measures.report import By, Column, Measured, Options, Report
from mpad_core.studies.measures.tracks import Track, counted, resampled, usual_interval

MOST_FRAMES = 1e7  # of all cells: about a gigabyte
PAUSE_SPEED = 0.5  # of the mean velocity
_QUANTILES = ((0.1, "10 %"), (0.5, "median"), (0.9, "90 %"))


def measure(seen: Sequence[Observation], options: Options) -> Report:
    """Measure all cells of some runs and tables.

    Parameters
    ----------
    seen
        Each a seed: cells of like name or kind are pooled over them.
    options
        How.

    Raises
    ------
    InputError
        If no cell has the name asked for, or nothing is left after the time to leave out.
    """
    tracks = [track for o in seen for track in o.tracks if not options.cells or track.name in options.cells]
    _check_names(seen, options.cells)
    every = options.every or usual_interval(tracks)
    _check_size(tracks, every)
    filmed = [resampled(track, every, after=options.after) for track in tracks] if math.isfinite(every) else []
    filmed = [track for track in filmed if len(track) > 1]
    if not filmed:
        raise InputError(f"no cell has two frames {every:g} s apart after {options.after:g} s; nothing can be measured")
    caught = [capture for o in seen for capture in o.captures() if capture.time >= options.after]
    names = list(dict.fromkeys(_group(track, options.by) for track in filmed))
    return Report(
        options=options,
        every=every,
        runs=tuple(o.run for o in seen),
        columns=tuple(_column(name, [t for t in filmed if _group(t, options.by) == name], seen, caught, options)
                      for name in names),
        captures=tuple(caught),
        within=tuple(o.rule.within for o in seen),
    )  # fmt: skip


def _check_size(tracks: Sequence[Track], every: float) -> None:
    frames = sum((track.times[-1] - track.times[0]) / every for track in tracks if len(track))
    if frames > MOST_FRAMES:
        raise InputError(f"frames {every:g} s apart are {frames:.3g} of all cells, more than {MOST_FRAMES:.0e}; "
                         "choose a longer interval with --every, or fewer cells")  # fmt: skip


def _check_names(seen: Sequence[Observation], wanted: Sequence[str]) -> None:
    known = sorted({track.name for o in seen for track in o.tracks})
    for name in wanted:
        if name not in known:
            raise InputError(f"no cell is called {name!r}; there are {', '.join(known[:20])}")


def _group(track: Track, by: By) -> str:
    return track.name if by == "cell" else track.kind or "cells"


def _column(
    name: str, tracks: Sequence[Track], seen: Sequence[Observation], caught: Sequence[Capture], options: Options
) -> Column:
    def told(what: str, unit: str, sample: Sample) -> Measured:
        return what, unit, estimate(sample, seed=options.seed, name=f"{name}: {what}")

    rule = _pause_rule(tracks, options)
    walls, between = _bonds(tracks, seen, False), _bonds(tracks, seen, True)
    measured = [*_of_motion(tracks, told, options), *_of_pauses(tracks, rule, told)]
    if walls:
        measured += _of_bonds(walls, between, told, options.seed)
    measured += _of_captures(tracks, seen, caught)
    return Column(
        name=name,
        **counted(tracks),
        watched=float(sum(track.times[-1] - track.times[0] for track in tracks)),
        pause_rule=rule,
        measured=tuple(measured),
        bond_shares=tuple(of_bonds.bond_number_shares(walls).tolist()),
    )


Telling: TypeAlias = Callable[[str, str, Sample], Measured]


def _pause_rule(tracks: Sequence[Track], options: Options) -> PauseRule:
    speed = options.pause_speed
    if speed is None:
        speed = float(f"{PAUSE_SPEED * abs(rolling.velocity(tracks).value()):.3g}")
    return PauseRule(slower_than=speed, at_least=options.pause_time)


def _of_motion(tracks: Sequence[Track], told: Telling, options: Options) -> Iterator[Measured]:
    yield told("rolling velocity", "um/s", rolling.velocity(tracks))
    yield told("its fluctuation", "um/s", rolling.fluctuation(tracks))
    yield told("fluctuation / mean", "", rolling.relative_fluctuation(tracks))
    yield told("deviation along x", "um", rolling.deviation(tracks, options.window))
    yield told("deviation along y", "um", rolling.deviation(tracks, options.window, across=True))


def _of_pauses(tracks: Sequence[Track], rule: PauseRule, told: Telling) -> Iterator[Measured]:
    count = pauses.pause_count(tracks, rule)
    yield "pauses", "", Estimate(count, **counted(tracks))
    if not count:  # what never happened cannot be drawn again
        watched = float(sum(track.times[-1] - track.times[0] for track in tracks))
        yield "pauses a second", "1/s", rate(0, watched, **counted(tracks))
        return
    yield told("pauses a second", "1/s", pauses.pause_rate(tracks, rule))
    yield told("mean pause", "s", pauses.pause_time(tracks, rule))
    yield told("share of time paused", "", pauses.pause_share(tracks, rule))
    yield told("mean step", "um", pauses.step_size(tracks, rule))
    yield told("sd of steps", "um", pauses.step_deviation(tracks, rule))


def _of_bonds(walls: list[CellBonds], between: list[CellBonds], told: Telling, seed: int) -> Iterator[Measured]:
    yield told("bonds", "", of_bonds.bond_number(walls))
    yield told("sd of bonds", "", of_bonds.bond_number_deviation(walls))
    if any(len(b.lives) for b in between):
        yield told("bonds with cells", "", of_bonds.bond_number(between))
    yield told("mean rupture force", "pN", of_bonds.rupture_force(walls))
    behind = {"cells": len({(b.run, b.cell) for b in walls}), "seeds": len({b.run for b in walls})}
    forces = of_bonds.rupture_forces(walls)
    for share, what in _QUANTILES:
        yield f"rupture force, {what}", "pN", quantile(forces, share, **behind, seed=seed, name=what)
    yield told("lifetime of bonds", "s", of_bonds.lifetime(walls))


def _bonds(tracks: Sequence[Track], seen: Sequence[Observation], between_cells: bool) -> list[CellBonds]:
    """Give the bonds of those cells whose run recorded bonds, averaged over the intervals of their tracks."""
    found = []
    for o in seen:
        mine = {track.name: track.times for track in tracks if track.run == o.run}
        if mine and o.lives is not None:
            found += bonds_of(o.lives, [t.name for t in o.tracks], mine, run=o.run, between_cells=between_cells)
    return found


def _of_captures(tracks: Sequence[Track], seen: Sequence[Observation], caught: Sequence[Capture]) -> Iterator[Measured]:
    whose = {(track.run, track.name) for track in tracks}
    mine = [capture for capture in caught if (capture.run, capture.cell) in whose]
    if all(o.free_speed is None for o in seen):
        return
    behind = counted(tracks)
    yield "captures", "", Estimate(len(mine), **behind)
    yield "captures a second free", "1/s", rate(len(mine), _free_time(tracks, seen), **behind)
    for kind in CLASSES if mine else ():
        yield f"share {kind}", "", proportion(sum(c.kind == kind for c in mine), len(mine), **behind)


def _free_time(tracks: Sequence[Track], seen: Sequence[Observation]) -> float:
    """Add up the time (s) in which the cells were watched and not caught."""
    spans = {(t.run, t.name): caught for o in seen for t, caught in zip(o.tracks, o.caught, strict=True)}
    total = 0.0
    for track in tracks:
        begin, end = track.times[0], track.times[-1]
        held = [max(min(b, end) - max(a, begin), 0.0) for a, b in spans[track.run, track.name]]
        total += end - begin - sum(held)
    return max(float(total), 0.0)
