"""Options: those of reading a scan, and those that come from the fields of a parameter dataclass."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Annotated, Any

import typer

from intaglio.cli.console import Steps, numbers, said

Scan = Annotated[Path, typer.Argument(help="NIfTI, NRRD, MetaImage, DICOM folder, TIFF stack or raw file.", show_default=False)]
Raw = Annotated[str | None, typer.Option("--raw", help="Layout of a raw file: XxYxZ,TYPE, such as 256x256x128,uint8.", rich_help_panel="Reading")]
Spacing = Annotated[str | None, typer.Option("--spacing", help="Voxel distances x,y,z in mm, instead of the file's.", rich_help_panel="Reading")]
Fill = Annotated[float | None, typer.Option("--fill", help="Value in place of NaN and infinite voxels.", rich_help_panel="Reading")]
Series = Annotated[str | None, typer.Option("--series", help="Which DICOM series, by number or UID.", rich_help_panel="Reading")]
Index = Annotated[int | None, typer.Option("--index", help="Which volume of a 4-D file, from 0.", rich_help_panel="Reading")]


def _raw(text: str | None, spacing: tuple[float, ...] | None) -> tuple[tuple[int, ...], str, tuple[float, ...]] | None:
    if text is None:
        return None
    shape, _, kind = text.partition(",")
    try:
        sizes = tuple(int(part) for part in shape.split("x"))
    except ValueError:
        sizes = ()
    if len(sizes) != 3 or not kind:
        raise typer.BadParameter(f"must be XxYxZ,TYPE such as 256x256x128,uint8 or 103x94x161,>u2; not {text!r}", param_hint="--raw")
    return sizes, kind.strip(), spacing or (1.0, 1.0, 1.0)


def read(steps: Steps, scan: Path, raw: str | None, spacing: str | None, fill: float | None, series: str | None, index: int | None) -> Any:
    """The volume, with the reader's notes said."""
    from intaglio.io.volumes import read_volume

    step = numbers(spacing, 3, "--spacing") if spacing else None
    layout = _raw(raw, step)
    with steps.step("reading") as progress:
        volume = read_volume(
            scan, raw=layout, spacing=None if layout else step, fill=fill, series=series, index=index, progress=progress
        )
    for note in volume.notes:
        said.print(f"note: {note}", markup=False)
    return volume


def _options_of(parameters: type) -> list[inspect.Parameter]:
    """One command-line option for each field of a parameter dataclass; None means the style's own value."""
    out = []
    for item in fields(parameters):
        assert item.default is not MISSING
        low, high, text = item.metadata["low"], item.metadata["high"], item.metadata["help"]
        kind = type(item.default)
        option = typer.Option(help=text, min=low, max=high, show_default=False, rich_help_panel="Style, parameter by parameter")
        out.append(
            inspect.Parameter(item.name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=Annotated[kind | None, option])
        )
    return out


def with_options(parameters: type) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Replace a command's **parameters by the options of a dataclass, so that each is declared once."""

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        signature = inspect.signature(command, eval_str=True)
        own = [p for p in signature.parameters.values() if p.kind is not inspect.Parameter.VAR_KEYWORD]
        keyword = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in own]
        command.__signature__ = signature.replace(parameters=keyword + _options_of(parameters))  # type: ignore[attr-defined]
        command.__annotations__ = {p.name: p.annotation for p in keyword + _options_of(parameters)} | {"return": None}
        return command

    return decorate
