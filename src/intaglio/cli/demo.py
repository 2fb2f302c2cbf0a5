"""`intaglio demo`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from intaglio.cli.console import out, running
from intaglio.errors import InputError


def demo(
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="FOLDER", help="Folder for the plates; made if it does not exist.", readable=False
        ),
    ] = Path("plates"),
) -> None:
    """Draw plates of the head that comes with intaglio: pencil, pen-and-ink, and a shaded picture.

    `intaglio demo`

    `intaglio demo -o my-plates`
    """
    from intaglio.datasets import head
    from intaglio.ink.styles import style
    from intaglio.io.plates import check_output
    from intaglio.parts import ISLANDS
    from intaglio.plate import PLATE_LIGHTS, PLATE_MATERIAL, draw, surface_camera
    from intaglio.rendering.isosurface import isosurface
    from intaglio.rendering.isovalue import body_surface
    from intaglio.rendering.shade import shade

    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"folder {output} cannot be made: {error.strerror}; choose another with --output") from error
    check_output(output / "head-shaded.png")
    with running() as steps:
        with steps.step("reading"):
            volume = head()
            iso = body_surface(volume)[0]
            camera = surface_camera(volume, iso, (-0.75, 0.6, 0.35), 1280)
        with steps.step("surface") as progress:
            gb = isosurface(volume, iso, camera, lights=PLATE_LIGHTS, material=PLATE_MATERIAL, islands=ISLANDS, progress=progress)
        for name, dpi in (("pencil", 220.0), ("pen-and-ink", 220.0)):
            with steps.step(name):
                plate = draw(gb, style(name), title=f"Head, {name}")
                for extension in (".svg", ".pdf", ".png"):
                    plate.save(output / f"head-{name}{extension}", dpi=dpi)
            for extension in (".svg", ".pdf", ".png"):
                out.print(str(output / f"head-{name}{extension}"), markup=False)
        with steps.step("shaded"):
            shade(gb, reduce=2).save(output / "head-shaded.png")
        out.print(str(output / "head-shaded.png"), markup=False)
    out.print(steps.summary(), markup=False)
