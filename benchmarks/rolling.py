"""How a single cell rolls: ``python benchmarks/rolling.py WHAT``, one table of docs/results.md for each WHAT.

Runs of ``rolling.toml`` with some of its values replaced. The first 2 s of each run are left out, so that the start
does not count; all seeds of a case are pooled, and intervals are those of `mpad measure`. Runs that DIRECTORY
(``--keep``) holds already are not run again, however long they are.
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from attrs import field, frozen
from scipy.optimize import brentq

from mpad_core import load_scene, run
from mpad_core.numerics.rotations import matrix_of
from mpad_core.physics.molecules import place_sites
from mpad_core.scene.compose import compose
from mpad_core.scene.files import parse_scene
from mpad_core.studies.measures import bonds as of_bonds
from mpad_core.studies.measures import rolling
from mpad_core.studies.measures.bonds import CellBonds, bonds_of
from mpad_core.studies.measures.estimates import Estimate, Sample, estimate, ratio
from mpad_core.studies.measures.observations import Observation, observations
from mpad_core.studies.measures.tracks import Track, resampled

SCENE = Path(__file__).with_suffix(".toml")
RECRUITMENT = SCENE.parents[1] / "examples/recruitment.toml"
START = 2.0  # s, left out
RADIUS = 5.0  # µm
TOUCHING = 5.225  # µm, height at which tips touch
REACH = 0.03  # µm, length of a bond
WEIGHT = 0.2568  # pN
THERMAL = 4.114e-3  # pN µm, kT
WALL_TIPS = 0.05  # µm
SLIDING = 0.3  # of γa: faster cells
SHORT, CAMERA = 0.01, 0.033  # s, intervals between frames


@frozen(kw_only=True)
class Case:
    """What is replaced in the scene, under a name that is also the folder of its runs."""

    name: str
    shear: float = 80.0  # 1/s
    settings: tuple[str, ...] = ()

    def overrides(self, seconds: float, seed: int) -> list[str]:
        """Give the settings as ``--set`` takes them."""
        return [f'flow.rate="{self.shear:g} 1/s"', f'stop.time="{seconds:g} s"', f"seed={seed}", *self.settings]


@frozen(kw_only=True, eq=False)
class Rolled:
    """All seeds of a case."""

    case: Case
    runs: Sequence[Observation]
    cost: float = field(default=float("nan"))  # s of CPU for a simulated second; NaN: nothing was run

    def filmed(self, every: float = SHORT) -> list[Track]:
        """Give the tracks at a camera's interval."""
        return [resampled(track, every, after=START) for o in self.runs for track in o.tracks]

    @cached_property
    def bonds(self) -> list[CellBonds]:
        """Give the bonds of all runs."""
        pairs = zip(self.runs, self.filmed(), strict=True)
        return [b for o, t in pairs if o.lives is not None for b in bonds_of(o.lives, ["roller"], {"roller": t.times},
                                                                             run=o.run)]  # fmt: skip

    def speed(self) -> Estimate:
        """Give the mean speed over γa."""
        return scaled(estimate(rolling.velocity(self.filmed())), 1 / (self.case.shear * RADIUS))

    def fluctuation(self, every: float) -> Estimate:
        """Give s / U at a camera's interval."""
        return estimate(rolling.relative_fluctuation(self.filmed(every)))

    def number(self) -> Estimate:
        """Give the mean number of bonds."""
        return estimate(of_bonds.bond_number(self.bonds))

    def free(self) -> float:
        """Give the share of time without a bond."""
        return float(of_bonds.bond_number_shares(self.bonds)[0])

    def rupture(self) -> float:
        """Give the mean force (pN) at which bonds broke that were not slack."""
        forces = np.concatenate(of_bonds.rupture_forces(self.bonds))
        return float(forces[forces > 0].mean())

    def lifetime(self) -> Estimate:
        """Give the mean lifetime of bonds (s)."""
        return estimate(of_bonds.lifetime(self.bonds))

    def tensions(self, stiffness: float) -> np.ndarray:
        """Give the tensions (pN) of all bonds alive at moments 50 ms apart, of slack ones zero."""
        return np.concatenate([tension for o in self.runs for tension in tensions_of(o, stiffness)])

    def height(self) -> Estimate:
        """Give the mean height of the centre (µm)."""
        return estimate(Sample(series=self.heights(), seeds=len(self.runs)))

    def heights(self) -> list[np.ndarray]:
        """Give the heights (µm) in the recorded frames, one series a seed."""
        recorded = [o.trajectory for o in self.runs if o.trajectory is not None]
        return [t.positions[t.times >= START, 0, 2] for t in recorded]


def tensions_of(seen: Observation, stiffness: float) -> Iterator[np.ndarray]:
    """Yield the tensions (pN) of the living bonds, moment by moment: from where the molecules and their anchors are."""
    recorded = seen.trajectory
    assert recorded is not None
    arms, lives = place_sites(compose(parse_scene(recorded.header.scene))).arm, _lives(recorded.bond_events)
    for frame in np.searchsorted(recorded.times, np.arange(START, recorded.times[-1], 0.05)):
        moment = recorded.times[frame]  # the frame's own: in a millisecond a fast cell passes many bonds
        turn, there = np.empty((3, 3)), lives[:, (lives[0]["time"] <= moment) & (lives[1]["time"] > moment)][0]
        matrix_of(recorded.orientations[frame, 0], turn)
        anchor = np.stack([there["anchor_x"], there["anchor_y"], np.full(len(there), WALL_TIPS)], axis=1)
        span = recorded.positions[frame, 0] + arms[there["receptor"]] @ turn.T - anchor
        yield stiffness * np.maximum(np.linalg.norm(span, axis=1) - REACH, 0.0)


def _lives(events: np.ndarray) -> np.ndarray:
    """Give forming and breaking of every bond that broke (2, B): a molecule has one bond at a time."""
    ordered = events[np.lexsort((np.arange(len(events)), events["receptor"]))]
    births = np.flatnonzero(ordered["kind"][:-1] == 0)
    ended = births[ordered["receptor"][births + 1] == ordered["receptor"][births]]
    return np.stack([ordered[ended], ordered[ended + 1]])


def scaled(number: Estimate, factor: float) -> Estimate:
    """Give a number in other units."""
    return Estimate(number.value * factor, number.low * factor, number.high * factor)


def text(number: Estimate, digits: int = 3) -> str:
    """Give a number with its interval."""
    return f"{number.value:.{digits}g} [{number.low:.{digits}g}, {number.high:.{digits}g}]"


@frozen(kw_only=True)
class Runs:
    """Where runs are kept, and how many there are of each case."""

    folder: Path
    seeds: int
    seconds: float  # of each, the start included
    picture: Path | None = None  # to draw, where there is one

    def of(self, case: Case) -> Rolled:
        """Run a case with all its seeds, or read what is there."""
        folders = [self.folder / f"{case.name}-{case.shear:g}-{seed}" for seed in range(1, self.seeds + 1)]
        missing = [(f, s) for s, f in enumerate(folders, 1) if not (f / "summary.json").exists()]
        before = time.process_time()
        for folder, seed in missing:
            run(load_scene(SCENE, case.overrides(self.seconds, seed)), folder)
        spent = (time.process_time() - before) / (len(missing) * self.seconds) if missing else float("nan")
        return Rolled(case=case, runs=observations(folders), cost=spent)


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table, row by row as it comes."""
    print("| " + " | ".join(heads) + " |\n|" + " --- |" * len(heads))
    for row in rows:
        print("| " + " | ".join(row) + " |", flush=True)


MOTION_HEADS = ("U/γa", "s/U, 10 ms", "s/U, 33 ms", "bonds", "mean z, µm", "time without bond", "CPU s a second")


def motion(seen: Rolled) -> tuple[str, ...]:
    """Give what is told of every case."""
    return (
        *(text(seen.speed()), text(seen.fluctuation(SHORT)), text(seen.fluctuation(CAMERA)), text(seen.number())),
        *(text(seen.height(), 6), f"{100 * seen.free():.2g} %", f"{seen.cost:.2g}"),
    )


def speed(runs: Runs) -> None:
    """Print speeds at three shear rates, for two readings of reach (the paper has 0.015)."""
    cases = [Case(name=reach, shear=shear, settings=(f'bonds.tether.reach="{reach}"',))
             for reach in ("overlap", "pairs") for shear in (40, 80, 160)]  # fmt: skip
    rows = ((case.name, f"{case.shear:g}", *motion(runs.of(case))) for case in cases)
    table(("reach", "shear, 1/s", *MOTION_HEADS), rows)


CONSTANTS = ((500, 2000), (500, 700), (500, 565), (50, 565), (5000, 565), (50, 330))  # pN µm, 1/µm


def repulsion(runs: Runs) -> None:
    """Print where cells roll, rest and pass for some constants of the repulsion."""
    heads = ("F₀, pN µm", "τ, 1/µm", "resting δ, nm", "least δ upstream, nm", "and downstream", "δ > 0 for Δx, µm")
    table(
        (*heads, "z rolling, µm: 40", "80", "160 1/s", "U/γa, 80 1/s"), (contact_row(runs, *pair) for pair in CONSTANTS)
    )


def contact_row(runs: Runs, strength: float, decay: float) -> tuple[str, ...]:
    """Give one set of constants' row."""
    settings = (f'repulsion.strength="{strength:g} pN um"', f'repulsion.decay="{decay:g} 1/um"')
    name = f"contact-{strength:g}-{decay:g}"
    seen = [runs.of(Case(name=name, shear=s, settings=settings)) for s in (40, 80, 160)]
    found = (*passage(runs.folder / name, settings), *(text(r.height(), 6) for r in seen), text(seen[1].speed()))
    return f"{strength:g}", f"{decay:g}", f"{resting(strength, decay):.1f}", *found


def resting(strength: float, decay: float) -> float:
    """Give δ (nm) where repulsion carries the weight."""

    def excess(gap: float) -> float:
        return float(strength * decay / np.expm1(decay * gap) - WEIGHT)

    return 1e3 * (float(brentq(excess, 1e-4, 0.1, xtol=1e-12)) - REACH)


def passage(folder: Path, settings: Sequence[str]) -> tuple[str, str, str]:
    """Run the example of recruitment: least δ (nm) before and behind the rolling cell, and where δ is above zero."""
    if not (folder / "summary.json").exists():
        run(load_scene(RECRUITMENT, [*settings, "passage.control=false"]), folder)
    seen = observations([folder])[0].trajectory
    assert seen is not None
    apart, overlap = seen.positions[:, 1, 0] - seen.positions[:, 0, 0], 1e3 * seen.overlaps[:, 1]
    above = apart[overlap > 0]
    return f"{overlap[apart < 0].min():.1f}", f"{overlap[apart > 0].min():.1f}", f"{above[0]:.0f} to {above[-1]:.0f}"


MODELS = {"slip": '{name="bell", preset="p-selectin"}', "catch": '{name="catch-slip", preset="p-selectin"}'}
SHEARS = (0.5, 1, 2, 5, 10, 20, 40, 80, 160)  # 1/s
SETS = ((90, 100.0), (30, 100.0), (30, 0.1))  # sites on the cell, 1/µm²; stiffness, pN/nm


@frozen(kw_only=True)
class Sheared:
    """One bond at one shear rate, as the table and the picture show it."""

    bond: str
    sites: int  # 1/µm²
    stiffness: float  # pN/nm
    shear: float  # 1/s
    speed: Estimate  # over γa
    taut: float  # bonds under tension
    tension: float  # pN, their mean
    told: tuple[str, ...]


def catch(runs: Runs) -> None:
    """Print speed against shear for a catch bond beside a slip bond."""
    heads = ("bond", "sites, 1/µm²", "stiffness, pN/nm", "shear, 1/s", "U, µm/s", *MOTION_HEADS[:-1])
    found = [sheared(runs.of(case), *pair) for case, pair in catch_cases()]
    loads = ("bonds under tension", "their mean tension, pN", "mean rupture force of such, pN")
    table((*heads, "lifetime of bonds, ms", *loads), (f.told for f in found))
    if runs.picture:
        draw(found, runs.picture)


def catch_cases() -> Iterator[tuple[Case, tuple[int, float]]]:
    """Yield both bonds, with all sites and stiffnesses, at all shear rates."""
    for (sites, stiffness), (bond, model), shear in product(SETS, MODELS.items(), SHEARS):
        settings = (
            f"bonds.tether.model={model}",
            f'kinds.bead.sites.slex.density="{sites} 1/um^2"',
            f'bonds.tether.stiffness="{stiffness:g} pN/nm"',
        )
        yield Case(name=f"{bond}-{sites}-{stiffness:g}", shear=shear, settings=settings), (sites, stiffness)


def sheared(seen: Rolled, sites: int, stiffness: float) -> Sheared:
    """Work out one case."""
    bond, shear, tension = seen.case.name.split("-")[0], seen.case.shear, seen.tensions(1e3 * stiffness)
    # frames are interpolated between the places that a run keeps: not good enough for the bonds of a cell that slides
    mean = float(tension[tension > 0].mean()) if seen.speed().value < SLIDING else float("nan")
    taut, broke = float((tension > 0).mean()) * seen.number().value, seen.rupture()
    asked = (bond, f"{sites}", f"{stiffness:g}", f"{shear:g}", text(estimate(rolling.velocity(seen.filmed()))))
    told = (
        *asked,
        *motion(seen)[:-1],
        text(scaled(seen.lifetime(), 1e3)),
        f"{taut:.3g}",
        f"{mean:.3g}",
        f"{broke:.3g}",
    )
    return Sheared(
        bond=bond, sites=sites, stiffness=stiffness, shear=shear, speed=seen.speed(), taut=taut, tension=mean, told=told
    )


def draw(found: Sequence[Sheared], file: Path) -> None:
    """Draw speed and tension against shear."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, 2, sharex=True)
    for colour, (sites, stiffness) in zip(("#1b4965", "#e09f3e", "#c1121f"), SETS, strict=True):
        for bond, style in (("catch", "o-"), ("slip", "s:")):
            points = [f for f in found if (f.bond, f.sites, f.stiffness) == (bond, sites, stiffness)]
            draw_line(panels, points, style, colour, f"{bond}: {sites} sites/µm², {stiffness:g} pN/nm")
    panels[0].axhline(0.70, color="0.7", linewidth=1)
    panels[0].text(0.5, 0.73, "free cell", color="0.4", va="bottom", fontsize=8)
    panels[1].axhline(11.8, color="0.7", linewidth=1)
    panels[1].text(2.6, 12.4, "longest life: 11.8 pN", color="0.4", fontsize=7.5)
    panels[0].set(xscale="log", yscale="log", xlabel="shear rate (1/s)", ylabel="U / γa", ylim=(7e-4, 1.1))
    panels[1].set(
        xscale="log", yscale="log", xlabel="shear rate (1/s)", ylabel="mean tension of taut bonds (pN)", ylim=(0.5, 8e3)
    )
    panels[1].legend(frameon=False, fontsize=8, loc="upper left")
    figure.savefig(file, dpi=150)


def draw_line(panels: Sequence[Any], points: Sequence[Sheared], style: str, colour: str, label: str) -> None:
    """Draw one set's speeds with their intervals, and its tensions."""
    shears, speeds = [f.shear for f in points], np.array([f.speed.value for f in points])
    ends = np.array([[max(f.speed.low, 1e-6), f.speed.high] for f in points]).T
    errors = np.nan_to_num(np.abs(ends - speeds))
    panels[0].errorbar(shears, speeds, errors, fmt=style, color=colour, markersize=4, capsize=2)
    panels[1].plot(shears, [f.tension for f in points], style, color=colour, markersize=4, label=label)


SELECTINS = ("p-selectin", "p-selectin-smith", "p-selectin-alon", "e-selectin", "e-selectin-alon", "l-selectin")


def selectins(runs: Runs) -> None:
    """Print speeds at 100 1/s for presets of Bell's bond, and that of the last by each."""
    cases = [
        Case(name=name, shear=100, settings=(f'bonds.tether.model={{name="bell", preset="{name}"}}',))
        for name in SELECTINS
    ]
    seen = [runs.of(case) for case in cases]
    last = rolling.velocity(seen[-1].filmed())
    rows = ((r.case.name, *motion(r), text(ratio(last, rolling.velocity(r.filmed())))) for r in seen)
    table(("preset", *MOTION_HEADS, f"U of {SELECTINS[-1]}, by this"), rows)


def thermal(runs: Runs) -> None:
    """Print how high a free cell is on the mean, beside Boltzmann, and how a bound one rolls with heat and without."""
    free = Case(name="thermal-free", settings=("cells.roller.binds=false", 'effects.thermal="on"'))
    exact = boltzmann(500.0, 565.0)
    seen = [1e3 * (z - TOUCHING) for z in runs.of(free).heights()]
    found = [estimate(Sample(series=[gap**power for gap in seen], seeds=runs.seeds)) for power in (1, 2)]
    rows = (
        [f"mean of tip gap^{n}, nm^{n}", text(f, 4), f"{e:.4g}"] for n, f, e in zip((1, 2), found, exact, strict=True)
    )
    table(("free cell, 80 1/s", "found", "Boltzmann"), rows)
    print()
    cases = [Case(name=f"thermal-{on}", settings=(f'effects.thermal="{on}"',)) for on in ("off", "on")]
    table(("thermal", *MOTION_HEADS), ((c.name.split("-")[1], *motion(runs.of(c))) for c in cases))


def boltzmann(strength: float, decay: float) -> tuple[float, float]:
    """Give the means of the tip gap (nm) and of its square, by Boltzmann's law."""
    gap = np.linspace(1e-4, 0.6, 600_001)
    energy = WEIGHT * gap - strength * np.log(-np.expm1(-decay * gap))
    weight = np.exp(-(energy - energy.min()) / THERMAL)
    mean, square = (float(np.average((1e3 * gap) ** power, weights=weight)) for power in (1, 2))
    return mean, square


WHAT: dict[str, tuple[Callable[[Runs], None], int, float]] = {
    "speed": (speed, 4, 14.0),
    "repulsion": (repulsion, 3, 7.0),
    "catch": (catch, 4, 10.0),
    "selectins": (selectins, 4, 12.0),
    "thermal": (thermal, 4, 12.0),
}


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=WHAT)
    parser.add_argument("--seeds", type=int, help="of each case")
    parser.add_argument("--seconds", type=float, help="of each run, 2 s of start included")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="of the table, where there is one: catch")
    parser.add_argument("--keep", type=Path, metavar="DIRECTORY", help="where runs stay, and are found again")
    given = parser.parse_args()
    show, seeds, seconds = WHAT[given.what]
    with tempfile.TemporaryDirectory() as passing:
        folder = given.keep or Path(passing)
        runs = Runs(folder=folder, seeds=given.seeds or seeds, seconds=given.seconds or seconds, picture=given.picture)
        print(f"{runs.seeds} seeds, {runs.seconds - START:g} s of each; 95 % intervals in brackets\n")
        show(runs)


if __name__ == "__main__":
    main()
