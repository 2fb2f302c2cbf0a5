"""The command line: one word a command, the same as in the library."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

import intaglio
from intaglio.cli.console import out, said
from intaglio.cli.demo import demo
from intaglio.cli.hatch import hatch
from intaglio.cli.info import info
from intaglio.errors import InputError

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    help="From scan to plate: anatomical illustrations as vector drawings.\n\n"
    "Start with `intaglio demo`, then `intaglio hatch SCAN -o plate.svg`.",
)
for command in (demo, info, hatch):
    app.command()(command)


def _version(value: bool) -> None:
    if value:
        out.print(f"intaglio {intaglio.__version__}")
        raise typer.Exit


@app.callback()
def _root(version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")] = False) -> None:
    pass


def main() -> None:
    """The console script: one line and exit code 1 for bad input, 2 for wrong usage, 130 for Ctrl-C."""
    try:
        app(prog_name="intaglio")
    except InputError as error:
        said.print(f"error: {error}", style="red", markup=False, soft_wrap=True)
        sys.exit(1)
    except KeyboardInterrupt:
        said.print("interrupted; nothing was written")
        sys.exit(130)
