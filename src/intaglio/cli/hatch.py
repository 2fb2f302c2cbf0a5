"""`intaglio hatch`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Option

from intaglio.cli.console import out, running, say
from intaglio.cli.cuts import Cut, check_cuts, selections_of
from intaglio.cli.options import (
    CAMERA,
    Distance,
    Fill,
    Index,
    MainLight,
    Perspective,
    Raw,
    Roll,
    Scan,
    Series,
    Spacing,
    View,
    Zoom,
    lamps,
    lens,
    number,
    read,
    with_options,
)
from intaglio.errors import InputError
from intaglio.ink.styles import STYLES, Hatching, style as named_style

PAPER: Any = {"rich_help_panel": "Paper"}
FINER = "more see finer detail and take longer, on paper of the same size"
SMALL = "smaller than this part of the largest, such as dust and cables; 0 keeps all"
RAYS = "6.4 a mm of paper"
DEFAULT = Path("plate.svg")


@with_options(Hatching)
def hatch(
    scan: Scan,
    output: Annotated[
        Path, Option("--output", "-o", metavar="FILE", help="Plate to write: .svg, .pdf or .png.", readable=False)
    ] = DEFAULT,
    view: View = "anterior",
    iso: Annotated[float | None, number("--iso", "Value where the surface is; without it, the body's surface")] = None,
    islands: Annotated[float | None, number("--islands", f"Leave out pieces {SMALL}", 0, 1)] = None,
    style: Annotated[str, Option("--style", metavar="NAME", help=f"One of {', '.join(STYLES)}.")] = "pencil",
    cut: Cut = None,
    seed: Annotated[int, number("--seed", "Of the hand's randomness: equal seed, equal plate", 0, kind=int)] = 0,
    width: Annotated[float, number("--width", "Width of the paper: wider holds more strokes", 5, 5000, unit="MM", **PAPER)] = 160,
    dpi: Annotated[float, number("--dpi", "Resolution of a PNG", 10, 2400, **PAPER)] = 300,
    plotter: Annotated[bool, Option("--plotter", help="SVG of plain lines, for pen plotters.", **PAPER)] = False,
    size: Annotated[
        int | None, number("--size", f"Rays along the longer side: {FINER}", 1, 32768, kind=int, show_default=RAYS, **CAMERA)
    ] = None,
    light: MainLight = None,
    perspective: Perspective = None,
    distance: Distance = None,
    zoom: Zoom = 1,
    roll: Roll = 0,
    raw: Raw = None,
    spacing: Spacing = None,
    fill: Fill = None,
    series: Series = None,
    index: Index = None,
    **parameters: Any,
) -> None:
    """Draw a surface of a scan with hatching and contours.

    `intaglio hatch head.nii.gz -o head.svg`

    `intaglio hatch head.nii.gz --iso 300 --view anterior-left -o skull.pdf`

    `intaglio hatch head.nii.gz --cut plane:superior,20 --view superior-left`

    `intaglio hatch engine.raw --raw 256x256x128,uint8 --view 1,1,1 -o engine.png`

    `intaglio info SCAN` tells which values --iso can take.

    Styles: **pencil** is soft, layers of short strokes; **pen-and-ink** bold, one layer of lines that swell;
    **engraving** fine and even, crossed in the dark.
    """  # fmt: skip
    from intaglio.camera import view_direction
    from intaglio.io.plates import check_output
    from intaglio.parts import ISLANDS
    from intaglio.plate import PLATE_MATERIAL, draw, surface_camera
    from intaglio.rendering.isosurface import isosurface
    from intaglio.rendering.isovalue import body_surface

    check_output(output)
    if plotter and output.suffix.lower() != ".svg":
        raise InputError(f"--plotter needs an .svg output, not {output.name!r}")
    hatching = named_style(style, **{k: v for k, v in parameters.items() if v is not None})
    view_direction(view)
    lights = lamps(light)
    pieces = ISLANDS if islands is None else islands
    check_cuts(cut)
    looking = lens(perspective, distance, zoom, roll)
    with running() as steps:
        volume = read(steps, scan, raw, spacing, fill, series, index)
        with steps.step("surface") as progress:
            if iso is None:
                iso, what = body_surface(volume)
                say(f"note: no --iso given; drawing {iso:g}, {what}")
            camera = surface_camera(volume, iso, view, size, width_mm=width, islands=pieces, **looking)
            tools = selections_of(cut, volume)
            gb = isosurface(
                volume, iso, camera, lights=lights, material=PLATE_MATERIAL, islands=pieces, selections=tools, progress=progress
            )
        with steps.step("strokes") as progress:
            title = f"{volume.name}, iso {iso:g}, {view}"
            plate = draw(gb, hatching, width_mm=width, seed=seed, title=title, progress=progress)
        with steps.step("writing"):
            plate.save(output, dpi=dpi, plotter=plotter)
    strokes = sum(len(layer.strokes) for layer in plate.layers)
    if strokes == 0:
        say("note: the plate is empty; is the surface in view and darker than --white?")
    out.print(f"{output}  {plate.width_mm:.0f} x {plate.height_mm:.0f} mm, {strokes} strokes, {steps.summary()}", markup=False)
