"""`intaglio hatch`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from intaglio.cli.console import numbers, out, running, said
from intaglio.cli.options import Fill, Index, Raw, Scan, Series, Spacing, read, with_options
from intaglio.errors import InputError
from intaglio.ink.styles import STYLES, Hatching
from intaglio.ink.styles import style as named_style


def _view(text: str) -> Any:
    return list(numbers(text, 3, "--view")) if any(c.isdigit() for c in text) else text


@with_options(Hatching)
def hatch(
    scan: Scan,
    output: Annotated[Path, typer.Option("--output", "-o", help="Plate to write: .svg, .pdf or .png.")] = Path("plate.svg"),
    iso: Annotated[float | None, typer.Option("--iso", help="Value of the surface; without it, the body's surface.")] = None,
    view: Annotated[
        str, typer.Option("--view", help="anterior, posterior, left, right, superior, inferior, several joined by '-', or x,y,z.")
    ] = "anterior",
    style: Annotated[str, typer.Option("--style", help=f"One of {', '.join(STYLES)}.")] = "pencil",
    width: Annotated[float, typer.Option("--width", min=5, max=5000, help="Width of the paper in mm.")] = 160.0,
    size: Annotated[int, typer.Option("--size", min=1, max=32768, help="Pixels of the surface's longer side; more sees finer.")] = 1024,
    dpi: Annotated[float, typer.Option("--dpi", min=10, max=2400, help="Resolution of a PNG.")] = 300.0,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of the hand's randomness; equal seed, equal plate.")] = 0,
    light: Annotated[
        str | None, typer.Option("--light", help="Direction towards the key light, x,y,z: right, up, to the viewer.")
    ] = None,
    plotter: Annotated[bool, typer.Option("--plotter", help="SVG of plain polylines for pen plotters.")] = False,
    perspective: Annotated[
        float | None, typer.Option("--perspective", min=1, max=120, help="Opening angle in degrees; without it, orthographic.", rich_help_panel="Camera")
    ] = None,
    distance: Annotated[
        float | None, typer.Option("--distance", help="Perspective from this many mm to the centre.", rich_help_panel="Camera")
    ] = None,
    zoom: Annotated[float, typer.Option("--zoom", help="Enlarge the middle of the picture.", rich_help_panel="Camera")] = 1.0,
    roll: Annotated[float, typer.Option("--roll", help="Turn the picture clockwise, degrees.", rich_help_panel="Camera")] = 0.0,
    raw: Raw = None,
    spacing: Spacing = None,
    fill: Fill = None,
    series: Series = None,
    index: Index = None,
    **parameters: Any,
) -> None:
    """Draw a surface of a scan with hatching and contours.

    `intaglio hatch head.nii.gz -o head.svg`

    `intaglio hatch head.nii.gz --iso 300 --view anterior-left --style pen-and-ink -o skull.pdf`

    `intaglio hatch engine.raw --raw 256x256x128,uint8 --view 1,1,1 -o engine.png --dpi 600`
    """
    from intaglio.plate import PLATE_LIGHTS, PLATE_MATERIAL, draw, surface_camera
    from intaglio.io.plates import check_output
    from intaglio.lighting import Light
    from intaglio.rendering.isosurface import isosurface
    from intaglio.rendering.isovalue import body_surface

    check_output(output)
    if plotter and output.suffix.lower() != ".svg":
        raise InputError(f"--plotter needs an .svg output, not {output.name!r}")
    hatching = named_style(style, **{k: v for k, v in parameters.items() if v is not None})
    direction = _view(view)
    lights = PLATE_LIGHTS
    if light:
        x, y, z = numbers(light, 3, "--light")
        lights = (Light(direction=(x, y, z), intensity=PLATE_LIGHTS[0].intensity), PLATE_LIGHTS[1])
    lens: dict[str, Any] = {}
    if perspective is not None or distance is not None:
        lens = {"projection": "perspective", "fov": perspective or 25.0, "distance": distance}
    with running() as steps:
        volume = read(steps, scan, raw, spacing, fill, series, index)
        with steps.step("surface") as progress:
            if iso is None:
                iso, what = body_surface(volume)
                said.print(f"note: no --iso given; drawing {iso:g}, {what}", markup=False)
            low, high = volume.range
            camera = surface_camera(volume, iso, direction, size, zoom=zoom, roll=roll, **lens)
            gb = isosurface(volume, iso, camera, lights=lights, material=PLATE_MATERIAL, progress=progress)
        with steps.step("strokes"):
            plate = draw(gb, hatching, width_mm=width, seed=seed, title=f"{volume.name}, iso {iso:g}, {view}")
        with steps.step("writing"):
            plate.save(output, dpi=dpi, plotter=plotter)
    strokes = sum(len(layer.strokes) for layer in plate.layers)
    if strokes == 0:
        said.print("note: the plate is empty; is the surface in view and darker than --white?", markup=False)
    out.print(f"{output}  {plate.width_mm:.0f} x {plate.height_mm:.0f} mm, {strokes} strokes, {steps.summary()}", markup=False)
