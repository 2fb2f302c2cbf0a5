"""`intaglio render`."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import BadParameter, Option

from intaglio.cli.console import out, running, say
from intaglio.cli.cuts import Cut, check_cuts, selections_of
from intaglio.cli.options import (
    Lens,
    MainLight,
    Reading,
    Scan,
    View,
    camera_options,
    lamps,
    number,
    read,
    with_groups,
)
from intaglio.errors import InputError

if TYPE_CHECKING:
    from intaglio.rendering.raycast import Surface
    from intaglio.transfer_function import TransferFunction
    from intaglio.volume import Volume

MODES = "emission-absorption, mip, minip, average, isosurface"
CLASSIFY = "pre, post, preintegrated"
INTERPOLATION = "trilinear, tricubic"
GRADIENT = "central, cell, tricubic"
TRANSFER: Any = {"rich_help_panel": "What is seen"}
PICTURE: Any = {"rich_help_panel": "Picture"}
PRESET = "Transfer function by name; ct-... for Hounsfield units, mr-... by the scan's range"
TF = "Transfer function of 3D Slicer (.vp.json, .vp) or ParaView (.json)."
ISO = "Isosurface, for that mode; may be given several times."
EMPHASIS = "Show boundaries: nothing where the value changes by LOW per mm, all from HIGH on."
SIZE = "Pixels: the longer side, or width x height such as 800x600."
BONE = (0.96, 0.92, 0.82)
DEFAULT = Path("picture.png")


@with_groups
def render(
    scan: Scan,
    output: Annotated[Path, Option("--output", "-o", metavar="FILE", help="Picture to write: .png.", readable=False)] = DEFAULT,
    view: View = "anterior",
    preset: Annotated[str | None, Option("--preset", metavar="NAME", help=f"{PRESET}.", **TRANSFER)] = None,
    tf: Annotated[Path | None, Option("--tf", metavar="FILE", help=TF, readable=False, **TRANSFER)] = None,
    mode: Annotated[str, Option("--mode", metavar="NAME", help=f"One of {MODES}.", **TRANSFER)] = "emission-absorption",
    iso: Annotated[
        list[str] | None, Option("--iso", metavar="VALUE:#RRGGBB:OPACITY", help=ISO, show_default=False, **TRANSFER)
    ] = None,
    classify: Annotated[str, Option("--classify", metavar="WHEN", help=f"One of {CLASSIFY}.", **TRANSFER)] = "post",
    step: Annotated[
        float, number("--step", "Distance of samples in voxels: smaller is finer and slower", 0.01, 16, **TRANSFER)
    ] = 0.5,
    interpolation: Annotated[
        str, Option("--interpolation", metavar="NAME", help=f"Of values, one of {INTERPOLATION}.", **TRANSFER)
    ] = "trilinear",
    gradient: Annotated[
        str | None, Option("--gradient", metavar="NAME", help=f"For light, one of {GRADIENT}.", show_default=False, **TRANSFER)
    ] = None,
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

    `intaglio render ct.nii.gz --preset ct-bone --view anterior-left`

    `intaglio render mr.nii.gz --mode mip --background #000000`

    `intaglio render ct.nii.gz --mode isosurface --iso 300:#f0e6d0:1`

    Without --preset and --tf, one that suits the scan is chosen and named.
    """  # fmt: skip
    from intaglio.camera import Camera, view_direction
    from intaglio.io.plates import check_output
    from intaglio.rendering.raycast import (
        CLASSIFY as WHEN,
        GRADIENT as GRADIENT_NAMES,
        INTERPOLATION as INTERPOLATION_NAMES,
        MODES as HOW,
        render as picture_of,
    )
    from intaglio.transfer_function import TransferFunction
    from intaglio.transfer_function_2d import TransferFunction2D

    check_output(output, (".png",))
    how = next((m for m in HOW if m == mode), None)
    when = next((c for c in WHEN if c == classify), None)
    if how is None:
        raise BadParameter(f"must be one of {MODES}, not {mode!r}", param_hint="'--mode'")
    if when is None:
        raise BadParameter(f"must be one of {CLASSIFY}, not {classify!r}", param_hint="'--classify'")
    if preset is not None and tf is not None:
        raise BadParameter("cannot be given together with --preset", param_hint="'--tf'")
    if preset is not None and preset not in TransferFunction.presets():
        raise BadParameter(f"must be one of {', '.join(TransferFunction.presets())}, not {preset!r}", param_hint="'--preset'")
    if how == "isosurface" and (preset or tf):
        raise BadParameter("cannot be isosurface with a transfer function; say what is seen with --iso", param_hint="'--mode'")
    if iso and how != "isosurface":
        raise BadParameter("needs --mode isosurface", param_hint="'--iso'")
    if bits not in (8, 16):
        raise BadParameter(f"must be 8 or 16, not {bits}", param_hint="'--bits'")
    between = next((i for i in INTERPOLATION_NAMES if i == interpolation), None)
    if between is None:
        raise BadParameter(f"must be one of {INTERPOLATION}, not {interpolation!r}", param_hint="'--interpolation'")
    slope = next((g for g in GRADIENT_NAMES if g == gradient), None)
    if gradient is not None and slope is None:
        raise BadParameter(f"must be one of {GRADIENT}, not {gradient!r}", param_hint="'--gradient'")
    if interpolation == "tricubic" and (when != "post" or how != "emission-absorption"):
        raise BadParameter("tricubic needs --mode emission-absorption and --classify post", param_hint="'--interpolation'")
    slopes = _slopes(emphasis) if emphasis is not None else None
    if slopes and (when != "post" or how != "emission-absorption"):
        raise BadParameter("needs --mode emission-absorption and --classify post", param_hint="'--emphasis'")
    surfaces = [_surface(text) for text in iso or ()]
    paper = _background(background)
    pixels = _size(size)
    view_direction(view)
    lights = lamps(light)
    looking = camera_options(lens)
    check_cuts(cut)
    function = TransferFunction.read(tf) if tf is not None else None
    with running() as steps:
        volume = read(steps, scan, reading)
        with steps.step("preparing"):
            if preset is not None:
                function = TransferFunction.preset(preset, volume.range)
            elif how == "isosurface" and not surfaces:
                surfaces = [_body(volume)]
            elif how == "emission-absorption" and function is None:
                function = _suitable(volume)
            shown = None if how in ("mip", "minip", "average") else function
            camera = Camera.looking(view, _seen(volume, shown, surfaces), pixels, **looking)
            colours = TransferFunction2D.emphasized(function, volume.range, slopes) if function and slopes else function
        with steps.step("rendering") as progress:
            image = picture_of(
                volume, colours, camera, mode=how, classify=when, surfaces=surfaces, step=step, interpolation=between,
                gradient=slope, reach=reach, lit=not unlit, lights=lights, selections=selections_of(cut, volume), ghost=ghost,
                background=paper, progress=progress,
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
    """VALUE:#rrggbb:OPACITY."""
    try:
        value, colour, opacity = text.split(":")
        surface = float(value), _rgb(colour), float(opacity)
    except ValueError:
        surface = None
    if surface is None or not 0 <= surface[2] <= 1 or surface[0] != surface[0]:
        raise BadParameter(f"must be VALUE:#rrggbb:OPACITY such as 300:#f0e6d0:0.5, not {text!r}", param_hint="'--iso'")
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


def _suitable(volume: Volume) -> TransferFunction:
    """ct-bone in Hounsfield units; otherwise colours that begin where the body does and end at the brightest voxel."""
    from intaglio.rendering.isovalue import SKIN_HU, body_surface
    from intaglio.transfer_function import TransferFunction

    iso, what = body_surface(volume)
    if iso == SKIN_HU and "Hounsfield" in what:
        say("note: no --preset given; showing ct-bone, for the values are Hounsfield units")
        return TransferFunction.preset("ct-bone")
    low, high = volume.range
    function = TransferFunction.preset("mr-default", (0.0, 1.0))
    first, begin = function.points[0].value, function.points[1].value
    if not low < iso < high:
        raise InputError(f"{volume.name}: no value parts body from surroundings; say what is seen with --preset or --tf")
    say(f"note: no --preset given; showing mr-default, from {iso:g}, {what}, to {high:g}")
    return function.mapped((first, begin, 1.0), (low, iso, high))


def _seen(volume: Volume, function: TransferFunction | None, surfaces: list[Surface]) -> Any:
    """What must be in the picture: blocks in which something is visible; the whole volume where nothing is, or all."""
    from intaglio.rendering.skipping import SURFACE, min_max_blocks, surface_blocks, surface_corners

    low, high = volume.range
    if surfaces:
        blocks = surface_blocks(volume, min(value for value, _, _ in surfaces))
    elif function is not None and low < high:
        blocks = function.visible(*min_max_blocks(volume)).astype("uint8") * SURFACE
    else:
        return volume
    return surface_corners(volume, blocks) if (blocks == SURFACE).any() else volume
