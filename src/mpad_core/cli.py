"""The command line; no logic. Heavy modules are imported inside the commands."""

import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from mpad_core.interfaces.errors import DiskFullError, InputError, MpadError, PartError

F = TypeVar("F", bound=Callable[..., Any])


class _Commands(click.Group):
    """Our commands, and those that plugins bring (entry points ``command.<name>``), loaded when named."""

    def list_commands(self, context: click.Context) -> list[str]:
        from mpad_core.plugins.registry import installed

        return sorted({*super().list_commands(context), *(part.name for part in installed("command"))})

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        own = super().get_command(context, name)
        if own is not None:
            return own
        from mpad_core.plugins.registry import installed, load

        if name not in {part.name for part in installed("command")}:
            return None
        try:
            command: click.Command = load("command", name)
        except PartError as error:
            return _broken(name, error)
        return command


def _broken(name: str, error: PartError) -> click.Command:
    """Stand in for a command whose plugin cannot be loaded, so that all others go on."""

    def fail() -> None:
        raise error

    return click.Command(name, callback=fail, short_help="(broken plugin)")


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="mpad-core", prog_name="mpad")
def mpad() -> None:
    """Multiparticle adhesive dynamics: cells in shear flow above a wall, caught by bonds, coupled through the fluid."""


_SCENE = click.argument("scene", type=click.Path(path_type=Path))
_SET = click.option(
    "--set", "overrides", multiple=True, metavar="PATH=VALUE",
    help="Replace a value of the scene, such as cells.free.y='\"7.5 um\"'; may be given several times.",
)  # fmt: skip


@mpad.command()
@_SCENE
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Run directory; runs/<scene's name> if left out.")
@click.option("--resume", is_flag=True, help="Go on with the run that the directory holds.")
@click.option("--checkpoint-every", type=click.FloatRange(min=0), default=2.0, show_default=True,
              help="Wall time between checkpoints, in seconds.")  # fmt: skip
@_SET
def run(scene: Path, output: Path | None, resume: bool, checkpoint_every: float, overrides: tuple[str, ...]) -> None:
    """Run a scene into a directory."""
    from mpad_core.scene.files import load_scene
    from mpad_core.studies.report import summary_lines
    from mpad_core.studies.runs import run as run_scene

    loaded = load_scene(scene, overrides)
    directory = output or Path("runs") / scene.stem
    summary = run_scene(loaded, directory, resume=resume, checkpoint_every=checkpoint_every)
    for line in summary_lines(summary, directory):
        click.echo(line)


@mpad.command()
@_SCENE
@click.option("--measure", is_flag=True, help="Also take a few steps and print what one costs.")
@_SET
def check(scene: Path, measure: bool, overrides: tuple[str, ...]) -> None:
    """Check a scene; print each part, and each effect on or off and why."""
    from mpad_core.scene.files import load_scene
    from mpad_core.scene.plan import plan_lines

    loaded = load_scene(scene, overrides)
    for line in plan_lines(loaded):
        click.echo(line)
    if measure:
        from mpad_core.studies.measuring import cost_lines

        for line in cost_lines(loaded):
            click.echo(line)


@mpad.command()
def parts() -> None:
    """List the installed parts with their parameters, units and distributions."""
    from mpad_core.plugins.listing import part_lines

    for line in part_lines():
        click.echo(line)


def _spaced(text: str) -> str:
    """Put a space between a number and its unit, where there is none."""
    return re.sub(r"(?<=[\d.])(?=[^\d.eE+\-\s])", " ", text, count=1)


def _quantity(name: str, unit: str, say: str, default: str | None = None) -> Callable[[F], F]:
    """Make an option that is a number and its units, with or without a space between; a float in `unit` inside."""

    def read(context: click.Context, parameter: click.Parameter, text: str | None) -> float | None:
        from mpad_core.units import UnitsError, convert

        if text is None:
            return None
        try:
            return convert(_spaced(text), unit)
        except UnitsError as error:
            raise click.BadParameter(str(error)) from error

    return click.option(
        name, callback=read, metavar="QUANTITY", help=say, default=default, show_default=default is not None
    )


@mpad.command()
@click.argument("sources", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RUN|TRACKS.csv...")
@_quantity("--every", "s", "Interval of the camera; what was recorded if left out.")
@_quantity("--after", "s", "Leave out what was before.", "0 s")
@click.option("--by", type=click.Choice(["kind", "cell"]), default="kind", show_default=True, help="What a column is.")
@click.option("--cell", "cells", multiple=True, metavar="NAME", help="Only this cell; may be given several times.")
@_quantity("--pause-speed", "um/s", "A pause is slower; half the mean velocity if left out.")
@_quantity("--pause-time", "s", "A pause lasts longer.", "0.1 s")
@_quantity("--window", "s", "Time over which deviation from uniform motion is looked at.", "1 s")
@_quantity("--within", "um", "Distance of neighbours at a capture; ten radii if left out.")
@_quantity("--free-speed", "um/s", "Of cells in the flow: gives captures in tables of tracks.")
@_quantity("--length-unit", "um", "What 1 means in a table's x and y, such as 0.65um.")
@_quantity("--time-unit", "s", "What 1 means in a table's times, such as 33ms for frames.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of the draws behind the intervals.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Also write measures.json there, or this file.")
def measure(sources: tuple[Path, ...], as_json: bool, output: Path | None, **how: Any) -> None:
    """Measure rolling: velocities, pauses, steps, bonds, captures, each with its 95 % interval.

    Several runs or tables count as several seeds and are pooled.
    """
    from mpad_core.studies.measures.asking import asked, json_text, write_report
    from mpad_core.studies.measures.report import table_lines

    report = asked(sources, **how)
    for line in [json_text(report)] if as_json else table_lines(report):
        click.echo(line)
    if output:
        click.echo(f"written to {write_report(report, output)}", err=as_json)


def _places(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> tuple[float, ...]:
    """Read quantities in µm; a plain number is one already."""
    from mpad_core.units import UnitsError, convert

    try:
        return tuple(float(t) if re.fullmatch(r"[+-]?[\d.]+", t) else convert(_spaced(t), "um") for t in texts)
    except (UnitsError, ValueError) as error:
        raise click.BadParameter(str(error)) from error


@mpad.command()
@_SCENE
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Directory; runs/<scene's name>-cost if left out."
)
@click.option("--long", "long", is_flag=True, help="Also the scene's bonds: captures and rolling; leave nothing out.")
@click.option(
    "--solver", "solvers", multiple=True, metavar="NAME", help="Only this solver; may be given several times."
)
@click.option("--at", multiple=True, callback=_places, metavar="QUANTITY",
              help="Compare passages at this dx, such as '-15 um'; may be given several times.")  # fmt: skip
@_SET
def cost(scene: Path, output: Path | None, overrides: tuple[str, ...], **options: Any) -> None:
    """Measure on a scene what accuracy costs: each solver at each level, the time step, the bond engine."""
    from mpad_core.scene.files import load_scene
    from mpad_core.studies.cost.study import Options
    from mpad_core.studies.cost.study import cost as measure_cost
    from mpad_core.studies.cost.table import table_lines

    loaded, directory = load_scene(scene, overrides), output or Path("runs") / f"{scene.stem}-cost"
    found = measure_cost(loaded, directory, Options(**options), say=lambda text: click.echo(f"  {text}", err=True))
    for line in table_lines(found):
        click.echo(line)
    click.echo(f"written to {directory}")


def _parts_option(kind: str) -> Callable[[F], F]:
    """Make an option that names parts of a kind; it may be given several times."""
    say = f"Only this {'bond model' if kind == 'bond' else kind}; may be given several times."
    return click.option(f"--{kind}", f"{kind}s", multiple=True, metavar="NAME", help=say)


@mpad.command()
@_parts_option("solver")
@_parts_option("bond")
@_parts_option("surface")
@_parts_option("force")
@click.option("--at", type=click.Path(path_type=Path), metavar="SCENE", help="Only this scene's solver, at its cells.")
@click.option("--examples", type=click.FloatRange(min=0, min_open=True), default=1.0, show_default=True,
              help="Times as many examples of each law.")  # fmt: skip
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="FILE.json",
              help="Also write the table as JSON, and beside it scenes that reproduce failures.")  # fmt: skip
def validate(at: Path | None, examples: float, output: Path | None, **named: tuple[str, ...]) -> None:
    """Ask all laws of the installed parts; print claim, source, expected, found.

    Without options: every solver at each of its levels, every bond model, surface and force law.
    """
    os.environ["MPAD_EXAMPLES"] = str(examples)  # read where laws are defined, by this process and its workers
    try:
        import mpad_core.testing  # noqa: F401
    except ModuleNotFoundError as error:
        raise InputError(str(error)) from error
    from mpad_core.testing.report import table_lines
    from mpad_core.testing.validating import asked, failure_line, scene_names, write
    from mpad_core.testing.validating import validate as ask_all

    found = ask_all(asked(named, at))
    for line in table_lines(found):
        click.echo(line)
    for name, text in scene_names(found).items():
        click.echo(f"\n# {name}\n{text}")
    for path in write(found, output) if output else ():
        click.echo(f"written to {path}")
    if found.failing:
        raise PartError(failure_line(found))


def main() -> None:
    """Run the command line; errors are one line on stderr and an exit code, never a traceback."""
    try:
        mpad.main(prog_name="mpad", standalone_mode=False)
    except click.exceptions.Abort:
        sys.exit(130)
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except click.exceptions.Exit as error:
        sys.exit(error.exit_code)
    except MpadError as error:
        click.echo(str(error), err=True)
        if isinstance(error, DiskFullError):
            sys.stderr.flush()
            os._exit(error.exit_code)  # HDF5 ends in a segmentation fault when it closes a file on a full disk
        sys.exit(error.exit_code)
    except Exception as error:
        if os.environ.get("MPAD_DEBUG"):
            raise
        message = " ".join(str(error).split())
        click.echo(f"{type(error).__name__}: {message} (set MPAD_DEBUG=1 to see where)", err=True)
        sys.exit(PartError.exit_code)
