"""`intaglio turntable`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Option

from intaglio.cli.command import as_written
from intaglio.cli.console import out, running
from intaglio.cli.options import (
    CAMERA,
    PAPER,
    Lens,
    MainLight,
    Reading,
    Scan,
    Seed,
    Style,
    View,
    camera_options,
    check_written,
    lamps,
    number,
    read,
)
from intaglio.cli.parameters import styled, with_groups, with_options
from intaglio.cli.surfaces import Subject, parts_named
from intaglio.ink.hand import Hand
from intaglio.ink.styles import Hatching

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
    *,
    view: View = "anterior",
    subject: Subject,
    style: Style = "pen-and-ink",
    seed: Seed = 0,
    frames: Annotated[int, number("--frames", "How many pictures share the turn", 1, 3600, kind=int, **TURN)] = 36,
    degrees: Annotated[float, number("--degrees", "How far it turns", -36000, 36000, unit="DEGREES", **TURN)] = 360,
    rate: Annotated[float, number("--rate", "Pictures a second", 1, 50, **TURN)] = 12,
    width: Annotated[float, number("--width", "Width of the paper", 5, 5000, unit="MM", **PAPER)] = 120,
    dpi: Annotated[float, number("--dpi", "Resolution of the pictures", 10, 2400, **PAPER)] = 130,
    size: Annotated[int, number("--size", "Rays along the longer side", 1, 32768, kind=int, **CAMERA)] = 800,
    light: MainLight = None,
    lens: Lens,
    reading: Reading,
    **parameters: Any,
) -> None:
    """Draw surfaces of a scan as they turn, with strokes that stay on them.

    `intaglio turntable head.nii.gz -o spin.gif`

    `intaglio turntable head.nii.gz --surface 0.2:contour --surface 0.55:pencil -o spin.png`

    `intaglio turntable head.nii.gz --frames 90 --style engraving -o frames`

    `--iso`, `--surface`, `--label` and `--tf` are those of `intaglio hatch`.
    """
    from intaglio.animation import turntable as plates_of
    from intaglio.camera import view_direction
    from intaglio.io.moving import MOVING, check_moving, save_moving

    if output.suffix:
        check_written(output, MOVING)
    check_moving(output)
    parts_in = parts_named(subject, lambda name: styled(name or style, parameters))
    with as_written():
        view_direction(view)
        lights = lamps(light)
    looking = camera_options(lens)
    with running() as steps:
        volume = read(steps, scan, reading)
        with steps.step("surfaces"):
            parts = parts_in(volume)
        with steps.step("plates", counted="plates") as progress:
            plates = plates_of(
                parts, frames=frames, degrees=degrees, view=view, size=size, seed=seed, width_mm=width, halo=subject.halo,
                lights=lights, camera=looking, progress=progress,
            )  # fmt: skip
            count = save_moving(plates, output, dpi=dpi, rate=rate)
    out.print(f"{output}  {count} plates, {steps.summary()}", markup=False)
