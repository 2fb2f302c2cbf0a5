"""`intaglio turntable`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Option

from intaglio.cli.console import out, running, say
from intaglio.cli.cuts import Cut, check_cuts, selections_of
from intaglio.cli.options import (
    CAMERA,
    PAPER,
    Islands,
    Iso,
    Lens,
    MainLight,
    Reading,
    Scan,
    Seed,
    View,
    camera_options,
    lamps,
    number,
    read,
    styled,
    with_groups,
    with_options,
)
from intaglio.ink.hand import Hand
from intaglio.ink.styles import STYLES, Hatching

DEFAULT = Path("spin.gif")
TURN: Any = {"rich_help_panel": "Turning"}


@with_options(Hatching, hand=Hand)
@with_groups
def turntable(
    scan: Scan,
    output: Annotated[
        Path,
        Option("--output", "-o", metavar="FILE", help="To write: .gif, animated .png, or a folder of PNG.", readable=False),
    ] = DEFAULT,
    view: View = "anterior",
    iso: Iso = None,
    islands: Islands = None,
    style: Annotated[str, Option("--style", metavar="NAME", help=f"One of {', '.join(STYLES)}.")] = "pen-and-ink",
    cut: Cut = None,
    seed: Seed = 0,
    frames: Annotated[int, number("--frames", "How many pictures share the turn", 1, 3600, kind=int, **TURN)] = 36,
    degrees: Annotated[float, number("--degrees", "How far it turns", -36000, 36000, unit="DEGREES", **TURN)] = 360,
    rate: Annotated[float, number("--rate", "Pictures a second", 1, 50, **TURN)] = 12,
    width: Annotated[float, number("--width", "Width of the paper", 5, 5000, unit="MM", **PAPER)] = 120,
    dpi: Annotated[float, number("--dpi", "Resolution of the pictures", 10, 2400, **PAPER)] = 130,
    size: Annotated[int, number("--size", "Rays along the longer side", 1, 32768, kind=int, **CAMERA)] = 800,
    light: MainLight = None,
    *,
    lens: Lens,
    reading: Reading,
    **parameters: Any,
) -> None:
    """Draw a surface of a scan as it turns, with strokes that stay on it.

    `intaglio turntable head.nii.gz -o spin.gif`

    `intaglio turntable head.nii.gz --frames 90 --style engraving -o frames`
    """
    from intaglio.animation import turntable as plates_of
    from intaglio.camera import view_direction
    from intaglio.io.moving import check_moving, save_moving
    from intaglio.parts import ISLANDS
    from intaglio.rendering.isovalue import body_surface

    check_moving(output)
    hatching = styled(style, parameters)
    view_direction(view)
    lights = lamps(light)
    check_cuts(cut)
    looking = camera_options(lens)
    with running() as steps:
        volume = read(steps, scan, reading)
        if iso is None:
            iso, what = body_surface(volume)
            say(f"note: no --iso given; drawing {iso:g}, {what}")
        with steps.step("plates") as progress:
            plates = plates_of(
                volume, iso=iso, frames=frames, degrees=degrees, view=view, size=size, style=hatching, seed=seed, width_mm=width,
                islands=ISLANDS if islands is None else islands, selections=selections_of(cut, volume), lights=lights,
                camera=looking, progress=progress,
            )  # fmt: skip
            count = save_moving(plates, output, dpi=dpi, rate=rate)
    out.print(f"{output}  {count} plates, {steps.summary()}", markup=False)
