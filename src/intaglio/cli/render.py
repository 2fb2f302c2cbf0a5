"""`intaglio render`."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import BadParameter, Option

from intaglio.cli.command import as_written
from intaglio.cli.console import out, running, say
from intaglio.cli.cuts import Cut, check_cuts, selections_of
from intaglio.cli.functions import function_of, transfer_function
from intaglio.cli.options import (
    Lens,
    MainLight,
    Reading,
    Scan,
    View,
    camera_options,
    check_rays,
    check_written,
    choice,
    lamps,
    number,
    read,
)
from intaglio.cli.parameters import with_groups
from intaglio.errors import InputError

if TYPE_CHECKING:
    from intaglio.rendering.raycast import Surface
    from intaglio.transfer_function import TransferFunction
    from intaglio.volume import Volume

PROJECTIONS = ("mip", "minip", "average")
MODES = ("emission-absorption", *PROJECTIONS, "isosurface")
CLASSIFY = ("pre", "post", "preintegrated")
INTERPOLATION = ("trilinear", "tricubic")
GRADIENT = ("central", "cell", "tricubic")
TRANSFER: Any = {"rich_help_panel": "What is seen"}
PICTURE: Any = {"rich_help_panel": "Picture"}
TF = "Colours and opacities of values"
SMALL = "that show less than this part of what the largest shows, such as a board"
ISO = "An isosurface, its colour and how opaque it is, 0 to 1; may be repeated."
EMPHASIS = "Show boundaries: nothing where the value changes by LOW per mm, all from HIGH on."
SIZE = "Pixels: the longer side, or width x height such as 800x600."
# Floats that a pixel needs: colours, as they are and as they are written.
LAYERS = 10
BONE = (0.96, 0.92, 0.82)
DEFAULT = Path("picture.png")


@with_groups
def render(
    scan: Scan,
    output: Annotated[Path, Option("--output", "-o", metavar="FILE", help="Picture to write: .png.", readable=False)] = DEFAULT,
    view: View = "anterior",
    tf: Annotated[str | None, transfer_function(TF, **TRANSFER)] = None,
    mode: Annotated[
        str | None, choice("--mode", "What a ray shows", MODES, show_default="emission-absorption", **TRANSFER)
    ] = None,
    iso: Annotated[
        list[str] | None, Option("--iso", metavar="VALUE[:#RRGGBB[:OPACITY]]", help=ISO, show_default=False, **TRANSFER)
    ] = None,
    islands: Annotated[float, number("--islands", f"Leave out pieces {SMALL}", 0, 1, **TRANSFER)] = 0,
    classify: Annotated[str, choice("--classify", "When values become colours", CLASSIFY, **TRANSFER)] = "post",
    step: Annotated[
        float, number("--step", "Distance of samples in voxels: smaller is finer and slower", 0.01, 16, **TRANSFER)
    ] = 0.5,
    interpolation: Annotated[str, choice("--interpolation", "Of values", INTERPOLATION, **TRANSFER)] = "trilinear",
    gradient: Annotated[str | None, choice("--gradient", "For light", GRADIENT, show_default=False, **TRANSFER)] = None,
    reach: Annotated[float, number("--reach", "How far central differences look, voxels", 0.01, 16, **TRANSFER)] = 1.0,
    emphasis: Annotated[
        str | None, Option("--emphasis", metavar="LOW:HIGH", help=EMPHASIS, show_default=False, **TRANSFER)
    ] = None,
    cut: Cut = None,
    ghost: Annotated[float, number("--ghost", "Opacity of the rims of tools that cut, shown as glass", 0, 1)] = 0.0,
    unlit: Annotated[bool, Option("--unlit", help="Colours as they are, without light.", **TRANSFER)] = False,
    background: Annotated[
        str, Option("--background", metavar="#RRGGBB", help="Behind the scan; or transparent.", **PICTURE)
    ] = "#ffffff",
    bits: Annotated[int, number("--bits", "Of each colour in the file, 8 or 16", 8, 16, kind=int, **PICTURE)] = 8,
    size: Annotated[str, Option("--size", metavar="N|WxH", help=SIZE, **PICTURE)] = "1024",
    light: MainLight = None,
    *,
    lens: Lens,
    reading: Reading,
) -> None:
    """Render a scan as a coloured picture, through what is translucent.

    `intaglio render head.nii.gz -o head.png`

    `intaglio render ct.nii.gz --tf ct-bone --view anterior-left`

    `intaglio render mr.nii.gz --mode mip --background #000000`

    `intaglio render ct.nii.gz --iso -300:#e8b89a:0.4 --iso 300`

    Without --tf, one that suits the scan is chosen and named; of distances and labels, the surface is shown.
    """  # fmt: skip
    from intaglio.camera import Camera, view_direction
    from intaglio.rendering.raycast import render as picture_of
    from intaglio.transfer_function_2d import TransferFunction2D

    check_written(output, (".png",))
    if mode == "isosurface" and tf:
        raise BadParameter("cannot be isosurface with a transfer function; say what is seen with --iso", param_hint="'--mode'")
    if iso and (tf or mode not in (None, "isosurface")):
        raise BadParameter("cannot be given with --tf, nor with another --mode than isosurface", param_hint="'--iso'")
    if bits not in (8, 16):
        raise BadParameter(f"must be 8 or 16, not {bits}", param_hint="'--bits'")
    through = mode in (None, "emission-absorption")
    if interpolation == "tricubic" and (classify != "post" or not through):
        raise BadParameter("tricubic needs --mode emission-absorption and --classify post", param_hint="'--interpolation'")
    if emphasis is not None and (classify != "post" or not through):
        raise BadParameter("needs --mode emission-absorption and --classify post", param_hint="'--emphasis'")
    if islands and mode in PROJECTIONS:
        raise BadParameter(f"cannot be left out with --mode {mode}", param_hint="'--islands'")
    slopes = _slopes(emphasis) if emphasis is not None else None
    surfaces = [_surface(text) for text in iso or ()]
    paper = _background(background)
    pixels = _size(size)
    with as_written():
        view_direction(view)
        lights = lamps(light)
    function_for = function_of(tf)
    looking = camera_options(lens)
    check_cuts(cut)
    with running() as steps:
        volume = read(steps, scan, reading)
        with steps.step("preparing"):
            function = function_for(volume) if function_for else None
            if mode is None and function is None and not surfaces:
                volume, surfaces = _solid(volume)
            how = mode or ("isosurface" if surfaces else "emission-absorption")
            if how == "isosurface" and not surfaces:
                surfaces = [_body(volume)]
            elif how == "emission-absorption" and function is None:
                function = _suitable(volume)
            shown = None if how in PROJECTIONS else function
            camera = Camera.looking(view, _seen(volume, shown, surfaces, islands), pixels, **looking)
            check_rays(camera, LAYERS)
            colours = TransferFunction2D.emphasized(function, volume.range, slopes) if function and slopes else function
        with steps.step("rendering") as progress:
            ways: dict[str, Any] = {"mode": how, "classify": classify, "interpolation": interpolation, "gradient": gradient}
            image = picture_of(
                volume, colours, camera, surfaces=surfaces, step=step, reach=reach, lit=not unlit, lights=lights, islands=islands,
                selections=selections_of(cut, volume), ghost=ghost, background=paper, progress=progress, **ways,
            )  # fmt: skip
        with steps.step("writing"):
            image.save(output, bits=bits)
    if (image.array == image.array[0, 0]).all():
        say("note: the picture is empty; is the transfer function made for values like these? `intaglio info` tells them")
    height, width = image.array.shape[:2]
    out.print(f"{output}  {width} x {height} pixels, {bits} bits, {steps.summary()}", markup=False)


def _slopes(text: str) -> tuple[tuple[float, float], tuple[float, float]]:
    """LOW:HIGH."""
    try:
        low, high = (float(part) for part in text.split(":"))
    except ValueError:
        low = high = -1.0
    if not 0 <= low < high < float("inf"):
        raise BadParameter(f"must be LOW:HIGH, ascending values per mm such as 20:100, not {text!r}", param_hint="'--emphasis'")
    return (low, 0.0), (high, 1.0)


def _surface(text: str) -> Surface:
    """VALUE, VALUE:#rrggbb or VALUE:#rrggbb:OPACITY."""
    value, _, look = text.partition(":")
    colour, _, opacity = look.partition(":")
    try:
        surface = float(value), _rgb(colour) if colour else BONE, float(opacity or 1)
    except ValueError:
        surface = None
    if surface is None or not 0 <= surface[2] <= 1 or not math.isfinite(surface[0]):
        forms = "VALUE, VALUE:#rrggbb or VALUE:#rrggbb:OPACITY such as 300:#f0e6d0:0.5"
        raise BadParameter(f"must be {forms}, not {text!r}", param_hint="'--iso'")
    return surface


def _rgb(text: str) -> tuple[float, float, float]:
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", text):
        raise ValueError(text)
    return int(text[1:3], 16) / 255, int(text[3:5], 16) / 255, int(text[5:7], 16) / 255


def _background(text: str) -> tuple[float, float, float, float]:
    if text == "transparent":
        return 0.0, 0.0, 0.0, 0.0
    try:
        return *_rgb(text), 1.0
    except ValueError:
        raise BadParameter(f"must be #rrggbb or transparent, not {text!r}", param_hint="'--background'") from None


def _size(text: str) -> int | tuple[int, int]:
    sides = [int(part) if part.isdecimal() else 0 for part in text.split("x")]
    if not 1 <= len(sides) <= 2 or not all(1 <= side <= 32768 for side in sides):
        raise BadParameter(f"must be N or WxH, 1 to 32768 pixels, not {text!r}", param_hint="'--size'")
    return sides[0] if len(sides) == 1 else (sides[0], sides[1])


def _body(volume: Volume) -> Surface:
    from intaglio.rendering.isovalue import body_surface

    iso, what = body_surface(volume)
    say(f"note: no --iso given; showing {iso:g}, {what}")
    return iso, BONE, 1.0


def _solid(volume: Volume) -> tuple[Volume, list[Surface]]:
    """What has a surface rather than colours, and that surface: distances, and of labels the distances to them all."""
    import numpy as np

    from intaglio.rendering.isovalue import is_label_map
    from intaglio.solid.labels import label_distance

    if is_label_map(volume):
        say(f"note: {volume.name} holds labels; showing all of them as one body; `intaglio hatch --label` draws single ones")
        return label_distance(volume, [int(label) for label in np.unique(volume.array) if label]), [(0.0, BONE, 1.0)]
    return volume, [_body(volume)] if volume.distances else []


def _suitable(volume: Volume) -> TransferFunction:
    """ct-bone in Hounsfield units; otherwise colours that begin where the body does and end at the brightest voxel."""
    from intaglio.rendering.isovalue import SKIN_HU, body_surface
    from intaglio.transfer_function import TransferFunction

    iso, what = body_surface(volume)
    if iso == SKIN_HU and "Hounsfield" in what:
        say("note: no --tf given; showing ct-bone, for the values are Hounsfield units")
        return TransferFunction.preset("ct-bone")
    low, high = volume.range
    function = TransferFunction.preset("mr-default", (0.0, 1.0))
    first, begin = function.points[0].value, function.points[1].value
    if not low < iso < high:
        raise InputError(f"{volume.name}: no value parts body from surroundings; say what is seen with --tf")
    say(f"note: no --tf given; showing mr-default, from {iso:g}, {what}, to {high:g}")
    return function.mapped((first, begin, 1.0), (low, iso, high))


def _seen(volume: Volume, function: TransferFunction | None, surfaces: list[Surface], islands: float) -> Any:
    """What must be in the picture: blocks in which something is visible; the whole volume where nothing is, or all."""
    import numpy as np

    from intaglio.rendering.pieces import shown_pieces, surface_pieces
    from intaglio.rendering.skipping import SURFACE, min_max_blocks, surface_corners

    low, high = min_max_blocks(volume)
    if surfaces:
        levels = np.array([value for value, _, _ in surfaces], dtype=np.float32)
        seen = np.any([(low < level) & (high >= level) for level in levels], axis=0)
        seen = surface_pieces(volume, levels, seen, islands)
    elif function is not None and volume.range[0] < volume.range[1]:
        seen = shown_pieces(volume, function, function.visible(low, high), islands)
    else:
        return volume
    return surface_corners(volume, seen.astype("uint8") * SURFACE) if seen.any() else volume
