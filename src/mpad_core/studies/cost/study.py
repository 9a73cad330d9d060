"""The whole study: a scene in, rows, files and a picture out."""

import signal
from collections.abc import Callable, Iterator, Sequence
from os import PathLike
from pathlib import Path

from attrs import evolve, frozen

from mpad_core.interfaces.errors import InputError, InterruptedRunError, RefusedError
from mpad_core.physics.levels import Level, installed_levels
from mpad_core.records.directory import make_directory
from mpad_core.running.choosing import settled
from mpad_core.scene.spec import Scene
from mpad_core.studies.cost.files import PICTURE, Found, write
from mpad_core.studies.cost.long import long_runs
from mpad_core.studies.cost.paths import AtPlaces
from mpad_core.studies.cost.rows import LONG, POSITION, RATE, RUN, SOLVE, Row
from mpad_core.studies.cost.runs import seeds_differ, solver_runs
from mpad_core.studies.cost.solves import Solves, solves
from mpad_core.studies.cost.subject import Subject, own_level, subject_of
from mpad_core.studies.cost.tolerances import has_events, position_runs, rate_runs

SITUATIONS = 12
_FEW_SECONDS = 20.0  # of a run of the scene, for it to be repeated with other seeds
BUDGET = 90.0  # s of computing, for whole runs with every solver, and as much for those with other steps


@frozen(kw_only=True)
class Options:
    """What is asked for.

    Attributes
    ----------
    solvers
        Names of solvers; all that are installed if empty. The finest level among them is the reference.
    at
        Δx (µm) at which passages are compared; some usual ones if empty.
    long
        Also run the scene itself with every level, and leave nothing out for its time.
    """

    solvers: tuple[str, ...] = ()
    at: tuple[float, ...] = ()
    long: bool = False

    @property
    def budget(self) -> float:
        """Time (s) of computing for a set of whole runs."""
        return float("inf") if self.long else BUDGET


def cost(
    scene: Scene,
    directory: str | PathLike[str],
    options: Options | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Found:
    """Measure on a scene what accuracy costs.

    Parameters
    ----------
    scene
        See `mpad_core.load_scene`.
    directory
        Receives ``cost.csv`` and ``cost.json``, written anew after each row, and ``cost.png``; made if it is not there.
    options
        What is asked for.
    say
        Hears what is being done.

    Returns
    -------
    Found
        All rows.

    Raises
    ------
    InputError
        For solvers that are not installed, or places that the scene's cell does not come to.
    RefusedError, PartError
        If the scene's own run fails, or no level answers.
    InterruptedRunError
        After SIGINT, with all that was measured before in the files.
    """
    asked, home = options or Options(), Path(directory)
    levels = installed_levels(asked.solvers or None)
    if not levels:
        raise InputError(f"--solver {', '.join(asked.solvers)}: stands for others; name those, or leave it out")
    make_directory(home)
    scene = settled(scene)
    found = Found(title=scene.title)
    write(found, home)  # whether it can be written shows at once
    try:
        for part in _parts(scene, levels, asked, say):
            found = _joined(found, part)
            write(found, home)
        _draw(found, home / PICTURE)
    except KeyboardInterrupt:
        raise InterruptedRunError(f"interrupted; what was measured before is in {home}", signal.SIGINT) from None
    return found


def _draw(found: Found, file: Path) -> None:
    from mpad_core.studies.cost.figure import draw

    draw(found, file)


def _joined(found: Found, part: Found) -> Found:
    """Put what is newly known in the place of what was known of the same study, and beside the rest."""
    studies = {row.study for row in part.rows}
    rows = (*(row for row in found.rows if row.study not in studies), *part.rows)
    return evolve(found, rows=rows, facts=tuple((dict(found.facts) | dict(part.facts)).items()))


def _parts(scene: Scene, levels: Sequence[Level], asked: Options, say: Callable[[str], None]) -> Iterator[Found]:
    """Yield what is found, study by study."""

    def told(study: str, rows: tuple[Row, ...], **facts: str) -> Found:
        return Found(title="", rows=rows, facts=tuple(facts.items()))

    say("the scene's own run")
    subject = subject_of(scene, SITUATIONS, asked.at)
    own = own_level(scene, levels) if scene.solver.name in (asked.solvers or (scene.solver.name,)) else None
    yield told(SOLVE, (), **_facts(subject))
    known = Solves()
    for known in solves(subject, [*([own] if own else []), *levels]):
        say(f"solved: {known.tried[0].level.label}")
        yield told(SOLVE, known.rows(subject))
    if not known.answered:
        raise RefusedError(f"no level answers in this scene; the last: {known.tried[0].row.note}")
    said: set[tuple[str, str]] = set()
    for study, rows in _runs(subject, known, asked):
        fresh = [row.label for row in rows if (study, row.label) not in said]
        said |= {(study, row.label) for row in rows}
        say(f"{study}: {', '.join(fresh) or 'a finer setting than the finest level'}")
        yield told(study, rows)
    if subject.problem.site_densities.any() and subject.outcome is not None and subject.own.took < _FEW_SECONDS:
        say("other seeds")
        yield told(RUN, (), seeds=f"{1e3 * seeds_differ(subject):.2g}")


def _runs(subject: Subject, known: Solves, asked: Options) -> Iterator[tuple[str, tuple[Row, ...]]]:
    """Yield the rows of all runs, with the name of their study, after each run."""
    if subject.outcome is not None:
        yield from ((RUN, rows) for rows in solver_runs(subject, known.tried, asked.budget))
        yield from ((POSITION, rows) for rows in position_runs(subject, asked.budget))
    if has_events(subject):
        yield from ((RATE, rows) for rows in rate_runs(subject))
    if asked.long:
        yield from ((LONG, rows) for rows in long_runs(subject, known.tried))


def _facts(subject: Subject) -> dict[str, str]:
    """Give what must be known to read the rows."""
    time = subject.own.last.time
    facts = {
        "solver": subject.scene.solver.name,
        "situations": f"{len(subject.situations)} along the scene's own run, t = 0 to {time:.4g} s",
        "own_run_s": f"{subject.own.took:.3g}",
    }
    if isinstance(subject.outcome, AtPlaces):
        facts["compared"] = "delta of " + subject.problem.names[subject.cell] + " at dx = "
        facts["compared"] += ", ".join(f"{x:g}" for x in subject.outcome.dx) + " um"
    elif subject.outcome is not None:
        facts["compared"] = f"places of the free cells at t = {subject.outcome.time:.4g} s"
    return facts
