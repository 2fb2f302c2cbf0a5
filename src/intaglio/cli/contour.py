"""`intaglio contour`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from intaglio.cli.command import as_written
from intaglio.cli.console import out, running, say
from intaglio.cli.options import (
    RAY_LAYERS,
    Dpi,
    Lens,
    Plate,
    Plotter,
    Reading,
    Scan,
    Seed,
    Size,
    Style,
    View,
    Width,
    camera_options,
    check_pixels,
    check_plate,
    check_rays,
    read,
)
from intaglio.cli.parameters import styled, with_groups, with_options
from intaglio.cli.surfaces import Subject, parts_named
from intaglio.ink.hand import Hand
from intaglio.ink.styles import LINE_PARAMETERS, Hatching

DEFAULT = Path("contours.svg")


@with_options(Hatching, only=LINE_PARAMETERS, hand=Hand)
@with_groups
def contour(
    scan: Scan,
    output: Plate = DEFAULT,
    *,
    view: View = "anterior",
    subject: Subject,
    style: Style = "pen-and-ink",
    seed: Seed = 0,
    width: Width = 160,
    dpi: Dpi = 300,
    plotter: Plotter = False,
    size: Size = None,
    lens: Lens,
    reading: Reading,
    **parameters: Any,
) -> None:
    """Draw surfaces of a scan with contours and feature lines alone.

    `intaglio contour head.nii.gz -o head.svg`

    `intaglio contour head.nii.gz --hand --style pencil -o sketch.png`

    `intaglio contour head.nii.gz --hand-increment 10 --hand-deviation 1.5`

    `intaglio contour ct.nii.gz --labels organs.nii.gz --label 5 --label 2,3`

    Contours are exact, or drawn in overlapping strokes with --hand. `--iso`, `--surface`, `--label` and `--tf` are those of
    `intaglio hatch`.
    """  # fmt: skip
    from intaglio.camera import view_direction
    from intaglio.plate import illustrate, parts_camera

    check_plate(output, plotter)
    parts_in = parts_named(subject, lambda name: styled(name or style, parameters))
    with as_written():
        view_direction(view)
    looking = camera_options(lens)
    with running() as steps:
        volume = read(steps, scan, reading)
        with steps.step("surfaces"):
            parts = [replace(part, lines_only=True) for part in parts_in(volume)]
            camera = parts_camera(parts, view, size, width_mm=width, **looking)
            check_rays(camera, RAY_LAYERS)
            check_pixels(output, camera, width, dpi)
        with steps.step("drawing") as progress:
            title = f"{volume.name}, {', '.join(part.title for part in parts)}, {view}"
            plate = illustrate(parts, camera=camera, seed=seed, width_mm=width, halo=subject.halo, title=title, progress=progress)
        with steps.step("writing"):
            plate.save(output, dpi=dpi, plotter=plotter)
    strokes = sum(len(layer.strokes) for layer in plate.layers)
    if strokes == 0:
        say("note: the plate is empty; is the surface in view?")
    out.print(f"{output}  {plate.width_mm:.0f} x {plate.height_mm:.0f} mm, {strokes} strokes, {steps.summary()}", markup=False)
