"""`intaglio hatch`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from intaglio.cli.command import as_written
from intaglio.cli.console import out, running, say
from intaglio.cli.options import (
    RAY_LAYERS,
    Dpi,
    Lens,
    MainLight,
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
    lamps,
    read,
)
from intaglio.cli.parameters import styled, with_groups, with_options
from intaglio.cli.surfaces import Subject, parts_named
from intaglio.ink.hand import Hand
from intaglio.ink.styles import Hatching

DEFAULT = Path("plate.svg")


@with_options(Hatching, hand=Hand)
@with_groups
def hatch(
    scan: Scan,
    output: Plate = DEFAULT,
    *,
    view: View = "anterior",
    subject: Subject,
    style: Style = "pencil",
    seed: Seed = 0,
    width: Width = 160,
    dpi: Dpi = 300,
    plotter: Plotter = False,
    size: Size = None,
    light: MainLight = None,
    lens: Lens,
    reading: Reading,
    **parameters: Any,
) -> None:
    """Draw surfaces of a scan with hatching and contours.

    `intaglio hatch head.nii.gz -o head.svg`

    `intaglio hatch head.nii.gz --iso 300 --view anterior-left -o skull.pdf`

    `intaglio hatch head.nii.gz --cut plane:superior,20 --view superior-left`

    `intaglio hatch engine.raw --raw 256x256x128,uint8 --view 1,1,1 -o engine.png`

    `intaglio hatch head.nii.gz --surface 0.2:contour --surface 0.55:pencil`

    `intaglio hatch ct.nii.gz --labels organs.nii.gz --label 5:engraving:#8a2b1a`

    `intaglio hatch ct.nii.gz --tf ct-tissues`

    `intaglio info SCAN` tells which values surfaces can have. What is not 100% opaque, such as a contour, shows what is behind.

    Styles: **pencil** is soft, layers of short strokes; **graphite** finer and smoother, **charcoal** broad and rough;
    **pen-and-ink** bold, one layer of lines that swell; **engraving** fine and even, crossed in the dark; **woodcut** few and
    heavy; **chalk** bright strokes on dark paper. A PNG shows brush and paper, an SVG or PDF the strokes' outlines.
    """  # fmt: skip
    from intaglio.camera import view_direction
    from intaglio.plate import PLATE_MATERIAL, illustrate, parts_camera

    check_plate(output, plotter)
    parts_in = parts_named(subject, lambda name: styled(name or style, parameters))
    with as_written():
        view_direction(view)
        lights = lamps(light)
    looking = camera_options(lens)
    with running() as steps:
        volume = read(steps, scan, reading)
        with steps.step("surfaces"):
            parts = parts_in(volume)
            camera = parts_camera(parts, view, size, width_mm=width, **looking)
            check_rays(camera, RAY_LAYERS)
            check_pixels(output, camera, width, dpi)
        with steps.step("strokes") as progress:
            title = f"{volume.name}, {', '.join(part.title for part in parts)}, {view}"
            plate = illustrate(
                parts, camera=camera, seed=seed, width_mm=width, halo=subject.halo, lights=lights, material=PLATE_MATERIAL,
                title=title, progress=progress,
            )  # fmt: skip
        with steps.step("writing"):
            plate.save(output, dpi=dpi, plotter=plotter)
    strokes = sum(len(layer.strokes) for layer in plate.layers)
    if strokes == 0:
        say("note: the plate is empty; is the surface in view and darker than --white?")
    out.print(f"{output}  {plate.width_mm:.0f} x {plate.height_mm:.0f} mm, {strokes} strokes, {steps.summary()}", markup=False)
