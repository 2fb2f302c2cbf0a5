"""`intaglio contour`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Option

from intaglio.cli.console import out, running, say
from intaglio.cli.cuts import Cut, check_cuts, selections_of
from intaglio.cli.options import (
    Dpi,
    Islands,
    Iso,
    Lens,
    Plate,
    Plotter,
    Reading,
    Scan,
    Seed,
    Size,
    View,
    Width,
    camera_options,
    read,
    styled,
    with_groups,
    with_options,
)
from intaglio.errors import InputError
from intaglio.ink.hand import Hand
from intaglio.ink.styles import LINE_PARAMETERS, STYLES, Hatching

DEFAULT = Path("contours.svg")


@with_options(Hatching, only=LINE_PARAMETERS, hand=Hand)
@with_groups
def contour(
    scan: Scan,
    output: Plate = DEFAULT,
    view: View = "anterior",
    iso: Iso = None,
    islands: Islands = None,
    style: Annotated[str, Option("--style", metavar="NAME", help=f"One of {', '.join(STYLES)}.")] = "pen-and-ink",
    cut: Cut = None,
    seed: Seed = 0,
    width: Width = 160,
    dpi: Dpi = 300,
    plotter: Plotter = False,
    size: Size = None,
    *,
    lens: Lens,
    reading: Reading,
    **parameters: Any,
) -> None:
    """Draw a surface of a scan with contours and feature lines alone.

    `intaglio contour head.nii.gz -o head.svg`

    `intaglio contour head.nii.gz --hand --style pencil -o sketch.png`

    `intaglio contour head.nii.gz --hand-increment 10 --hand-deviation 1.5`

    Contours are exact, or drawn in overlapping strokes with --hand.
    """  # fmt: skip
    from intaglio.camera import view_direction
    from intaglio.io.plates import check_output
    from intaglio.parts import ISLANDS
    from intaglio.plate import contour as lines_of, surface_camera
    from intaglio.rendering.isovalue import body_surface

    check_output(output)
    if plotter and output.suffix.lower() != ".svg":
        raise InputError(f"--plotter needs an .svg output, not {output.name!r}")
    hatching = styled(style, parameters)
    view_direction(view)
    pieces = ISLANDS if islands is None else islands
    check_cuts(cut)
    looking = camera_options(lens)
    with running() as steps:
        volume = read(steps, scan, reading)
        with steps.step("drawing") as progress:
            if iso is None:
                iso, what = body_surface(volume)
                say(f"note: no --iso given; drawing {iso:g}, {what}")
            camera = surface_camera(volume, iso, view, size, width_mm=width, islands=pieces, **looking)
            plate = lines_of(
                volume, iso=iso, camera=camera, style=hatching, seed=seed, width_mm=width, islands=pieces,
                selections=selections_of(cut, volume), progress=progress,
            )  # fmt: skip
        with steps.step("writing"):
            plate.save(output, dpi=dpi, plotter=plotter)
    strokes = sum(len(layer.strokes) for layer in plate.layers)
    if strokes == 0:
        say("note: the plate is empty; is the surface in view?")
    out.print(f"{output}  {plate.width_mm:.0f} x {plate.height_mm:.0f} mm, {strokes} strokes, {steps.summary()}", markup=False)
