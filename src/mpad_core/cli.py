"""The command line; no logic. Heavy modules are imported inside the commands."""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from mpad_core.interfaces.errors import DiskFullError, MpadError, PartError

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
