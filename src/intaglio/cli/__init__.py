"""The command line: one word a command, the same as in the library."""

from __future__ import annotations

import io
import sys
from typing import Annotated

import typer

import intaglio
from intaglio.cli.combine import combine
from intaglio.cli.command import Command, UsageError
from intaglio.cli.console import out, say
from intaglio.cli.contour import contour
from intaglio.cli.demo import demo
from intaglio.cli.distance import distance
from intaglio.cli.hatch import hatch
from intaglio.cli.info import info
from intaglio.cli.render import render
from intaglio.cli.surface import surface
from intaglio.cli.turntable import turntable
from intaglio.cli.voxelize import voxelize
from intaglio.errors import InputError

app = typer.Typer(
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    help="From scan to plate: anatomical illustrations as vector drawings.\n\n"
    "`intaglio demo` draws the head that comes with it\n\n"
    "`intaglio info SCAN` tells what is in a scan\n\n"
    "`intaglio render SCAN -o picture.png` shows what is inside\n\n"
    "`intaglio hatch SCAN -o plate.svg` draws it\n\n"
    "`intaglio contour SCAN -o lines.svg` draws its contours alone\n\n"
    "`intaglio turntable SCAN -o spin.gif` turns it\n\n"
    "`intaglio surface SCAN -o bone.stl` makes a mesh of it\n\n"
    "`intaglio voxelize MESH` and `intaglio distance MESH` make volumes of a mesh\n\n"
    "`intaglio combine HOW SOLID ...` adds, cuts and intersects solids\n\n"
    "Exit code 2: the command is wrong as written; 1: a file, folder, disk or the environment is why it failed; 130: Ctrl-C",
)
for command in (demo, info, hatch, contour, turntable, render, surface, voxelize, distance, combine):
    app.command(cls=Command)(command)


def _version(value: bool) -> None:
    if value:
        out.print(f"intaglio {intaglio.__version__}", markup=False)
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit(2)


def _run() -> int:
    try:
        return app(prog_name="intaglio", standalone_mode=False) or 0
    except UsageError as error:
        context, message = error.ctx, error.format_message()
        say(f"error: {message.rstrip('.')}; see {context.command_path if context else 'intaglio'} --help", style="red")
        return 2
    except InputError as error:
        say(f"error: {error}", style="red")
    except MemoryError:
        say("error: not enough memory; take a smaller --size or --dpi, or crop or resample the scan", style="red")
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        say(f"error: {place}{error.strerror or error}; check the disk and its permissions", style="red")
    except (KeyboardInterrupt, typer.Abort):
        return 130
    return 1


def main() -> None:
    """The console script. What fails ends in one line and an exit code.

    2    the command is wrong as it was written: an unknown option, a value that no file could make right
    1    a file, folder, disk or the environment is why: missing, damaged, without that isovalue or label, not to be written
    130  Ctrl-C
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # names of files may be what the terminal cannot show
    code = _run()
    if code == 130:
        say("interrupted; nothing half-written is left")
    sys.exit(code)
