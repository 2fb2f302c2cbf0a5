"""Options that commands share: those of reading a scan, of the camera, of the paper."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, BadParameter, Option

from intaglio.cli.command import as_written
from intaglio.cli.console import Steps, say
from intaglio.errors import InputError
from intaglio.ink.styles import STYLES
from intaglio.io.limits import check_memory
from intaglio.io.plates import PLATES, check_output

if TYPE_CHECKING:
    from intaglio.camera import Camera


def number(
    name: str,
    help: str,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    kind: type = float,
    unit: str = "NUMBER",
    **options: Any,
) -> Any:
    """An option that takes a finite number; one place for its range in the help and in the message."""
    span = f"{low:g} to {high:g}" if high < math.inf else f"{low:g} or more" if low > -math.inf else ""
    wanted = f"a {'whole ' if kind is int else ''}number" + (f", {span}" if span else "")

    def parse(text: Any) -> Any:
        try:
            value = kind(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and low <= value <= high):
            raise BadParameter(f"must be {wanted}, not {str(text)!r}", param_hint=f"'{name}'")
        return value

    return Option(name, help=f"{help} ({span})." if span else f"{help}.", metavar=unit, parser=parse, **options)


def choice(name: str, help: str, allowed: Iterable[str], metavar: str = "NAME", **options: Any) -> Any:
    """An option that takes one of a few words, which its help lists."""
    words = tuple(allowed)

    def parse(text: str) -> str:
        if (word := text.strip().lower()) not in words:
            raise BadParameter(f"must be one of {', '.join(words)}, not {text!r}", param_hint=f"'{name}'")
        return word

    return Option(name, help=f"{help}: {', '.join(words)}.", metavar=metavar, parser=parse, **options)


def numbers(text: str, name: str, *, same: bool = False) -> tuple[float, float, float]:
    """Three numbers; or one that stands for all, where that makes sense."""
    try:
        values = [float(part) for part in text.replace("x", ",").split(",")]
    except ValueError:
        values = []
    if same and len(values) == 1:
        values *= 3
    if len(values) != 3:
        raise BadParameter(f"must be three numbers such as 1,1,2.5, not {text!r}", param_hint=f"'{name}'")
    return values[0], values[1], values[2]


SCAN = "NIfTI, NRRD, MetaImage or raw file, multi-page TIFF, folder of DICOM, TIFF or PNG slices."
RAW = "Voxels and type of a raw file: XxYxZ,TYPE such as 256x256x128,uint8 or '103x94x161,>u2'."
READING: Any = {"rich_help_panel": "Reading"}

Scan = Annotated[Path, Argument(metavar="SCAN", help=SCAN, show_default=False, readable=False)]
Raw = Annotated[str | None, Option("--raw", metavar="LAYOUT", help=RAW, **READING)]
Spacing = Annotated[
    str | None, Option("--spacing", metavar="X,Y,Z", help="Distances of voxels in mm, instead of the file's.", **READING)
]
AXES = "Where columns, rows and slices run, instead of the file's: LPS is to the left, posterior, superior."
Axes = Annotated[str | None, Option("--axes", metavar="LETTERS", help=AXES, **READING)]
Fill = Annotated[float | None, number("--fill", "Value in place of voxels that are NaN or infinite", **READING)]
Series = Annotated[str | None, Option("--series", metavar="NUMBER|UID", help="Which DICOM series of a folder.", **READING)]
Index = Annotated[int | None, number("--index", "Which volume of a 4-D file", 0, kind=int, **READING)]


@dataclass(frozen=True)
class Reading:
    """How a scan is read where its file does not say."""

    raw: Raw = None
    spacing: Spacing = None
    axes: Axes = None
    fill: Fill = None
    series: Series = None
    index: Index = None


CAMERA: Any = {"rich_help_panel": "Camera and light"}
VIEWS = "anterior, posterior, left, right, superior, inferior; joined: anterior-left; or x,y,z: right, anterior, superior."
LIGHT = "Where the main light stands: right, up, to the viewer, such as -1,1,1."

View = Annotated[str, Option("--view", metavar="FROM", help=f"Where the viewer stands: {VIEWS}")]
MainLight = Annotated[str | None, Option("--light", metavar="X,Y,Z", help=LIGHT, **CAMERA)]
Perspective = Annotated[
    float | None, number("--perspective", "Opening angle; without it, parallel rays", 1, 120, unit="DEGREES", **CAMERA)
]
Distance = Annotated[
    float | None, number("--distance", "Of the eye from the centre, in place of the angle", 0, unit="MM", **CAMERA)
]
Zoom = Annotated[float, number("--zoom", "Enlarge the middle of the picture", 0.01, 1000, **CAMERA)]
Roll = Annotated[float, number("--roll", "Turn the picture clockwise", unit="DEGREES", **CAMERA)]


@dataclass(frozen=True)
class Lens:
    """How the eye looks."""

    perspective: Perspective = None
    distance: Distance = None
    zoom: Zoom = 1
    roll: Roll = 0


PAPER: Any = {"rich_help_panel": "Paper"}
FINER = "more see finer detail and take longer, on paper of the same size"
SMALL = "smaller than this part of the largest, such as dust and cables; 0 keeps all"
RAYS = "6.4 a mm of paper"
# Floats that a ray needs at least on its way to a stroke: what it hit, and tone and direction, smoothed.
RAY_LAYERS = 30

Plate = Annotated[Path, Option("--output", "-o", metavar="FILE", help="Plate to write: .svg, .pdf or .png.", readable=False)]
Iso = Annotated[float | None, number("--iso", "Value where the surface is; without it, the body's surface")]
SIDES = ("above", "below")
Inside = Annotated[
    str | None,
    choice("--inside", "Where the body is, seen from the isovalue", SIDES, "SIDE", show_default="above; below in distances"),
]
Style = Annotated[str, choice("--style", "How it is drawn", STYLES)]
Islands = Annotated[float | None, number("--islands", f"Leave out pieces {SMALL}", 0, 1)]
Seed = Annotated[int, number("--seed", "Of the hand's randomness: equal seed, equal plate", 0, kind=int)]
Width = Annotated[float, number("--width", "Width of the paper: wider holds more strokes", 5, 5000, unit="MM", **PAPER)]
Dpi = Annotated[float, number("--dpi", "Resolution of a PNG", 10, 2400, **PAPER)]
Plotter = Annotated[bool, Option("--plotter", help="SVG of plain lines, for pen plotters.", **PAPER)]
Size = Annotated[
    int | None, number("--size", f"Rays along the longer side: {FINER}", 1, 32768, kind=int, show_default=RAYS, **CAMERA)
]


def lamps(light: str | None) -> Any:
    """A plate's lights, with the main one where --light puts it."""
    from intaglio.lighting import Light
    from intaglio.plate import PLATE_LIGHTS

    if light is None:
        return PLATE_LIGHTS
    return (Light(direction=numbers(light, "--light"), intensity=PLATE_LIGHTS[0].intensity), *PLATE_LIGHTS[1:])


def check_written(output: Path, kinds: Sequence[str]) -> None:
    """BadParameter for another extension, InputError where no file can be written; before long work."""
    if not output.name.lower().endswith(tuple(kinds)) and not os.path.isdir(output):
        names = f"{', '.join(kinds[:-1])} or {kinds[-1]}" if len(kinds) > 1 else kinds[0]
        raise BadParameter(f"must end in {names}, not {output.name!r}", param_hint="'--output'")
    check_output(output, kinds if os.path.isdir(output) else [output.suffix.lower()])


def check_plate(output: Path, plotter: bool) -> None:
    """`check_written` for a plate; plotters draw SVG."""
    check_written(output, PLATES)
    if plotter and output.suffix.lower() != ".svg":
        raise BadParameter(f"needs an .svg output, not {output.name!r}", param_hint="'--plotter'")


def check_rays(camera: Camera, layers: int) -> None:
    """InputError for a picture of so many float32 layers that do not fit in memory."""
    width, height = camera.size
    check_memory(f"a picture of {width} x {height} rays", 4 * layers * width * height, "take a smaller --size")


def check_pixels(output: Path, camera: Camera, width: float, dpi: float) -> None:
    """InputError for a PNG of too many pixels, before there are strokes to draw on it."""
    from intaglio.io.raster import pixels_of

    if output.suffix.lower() == ".png":
        pixels_of(width, width * camera.size[1] / camera.size[0], dpi)


def camera_options(lens: Lens) -> dict[str, Any]:
    """What `Camera.looking` takes."""
    options: dict[str, Any] = {"zoom": lens.zoom, "roll": lens.roll}
    if lens.perspective is not None or lens.distance is not None:
        options |= {"projection": "perspective", "fov": lens.perspective or 25.0, "distance": lens.distance}
    return options


def _layout(text: str, step: tuple[float, float, float] | None) -> tuple[tuple[int, int, int], str, tuple[float, float, float]]:
    shape, _, kind = text.partition(",")
    try:
        x, y, z = (int(part) for part in shape.split("x"))
    except ValueError:
        kind = ""
    if not kind.strip():
        raise BadParameter(
            f"must be XxYxZ,TYPE such as 256x256x128,uint8 or '103x94x161,>u2', not {text!r}", param_hint="'--raw'"
        )
    return (x, y, z), kind.strip(), step or (1.0, 1.0, 1.0)


def read(steps: Steps, scan: Path, how: Reading) -> Any:
    """The volume, with the reader's notes said."""
    from intaglio.io.geometry import directions
    from intaglio.io.meshes import KINDS
    from intaglio.io.volumes import read_volume

    step = numbers(how.spacing, "--spacing", same=True) if how.spacing is not None else None
    if step is not None and not all(math.isfinite(s) and s > 0 for s in step):
        raise BadParameter(f"must be three positive numbers, not {how.spacing!r}", param_hint="'--spacing'")
    if how.axes is not None:
        with as_written():
            directions(how.axes)
    layout = _layout(how.raw, step) if how.raw is not None else None
    if layout is None and scan.is_file():
        if scan.suffix.lower() in KINDS:
            raise InputError(
                f"{scan.name}: is a mesh, and this command takes volumes: "
                f"`intaglio distance {scan.name} -o {scan.stem}.nii.gz` makes one of it, which has the same surface; "
                "info, voxelize, distance, combine and --cut mesh:FILE take meshes"
            )
        if scan.name.lower().endswith((".raw", ".raw.gz")):
            raise InputError(
                f"{scan.name}: raw voxels have no header; say what they are with --raw, such as --raw 256x256x128,uint8"
            )
    with steps.step("reading") as progress:
        volume = read_volume(
            scan,
            raw=layout,
            spacing=None if layout else step,
            axes=how.axes,
            fill=how.fill,
            series=how.series,
            index=how.index,
            progress=progress,
        )
    for text in volume.notes:
        say(f"note: {text}")
    return volume
