"""Options: numbers, those of reading a scan, and those that come from the fields of a parameter dataclass."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Container
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, get_type_hints

from typer import Argument, BadParameter, Option

from intaglio.cli.console import Steps, say
from intaglio.errors import InputError
from intaglio.ink.hand import Hand
from intaglio.ink.styles import Hatching, style


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
Fill = Annotated[float | None, number("--fill", "Value in place of voxels that are NaN or infinite", **READING)]
Series = Annotated[str | None, Option("--series", metavar="NUMBER|UID", help="Which DICOM series of a folder.", **READING)]
Index = Annotated[int | None, number("--index", "Which volume of a 4-D file", 0, kind=int, **READING)]


@dataclass(frozen=True)
class Reading:
    """How a scan is read where its file does not say."""

    raw: Raw = None
    spacing: Spacing = None
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

Plate = Annotated[Path, Option("--output", "-o", metavar="FILE", help="Plate to write: .svg, .pdf or .png.", readable=False)]
Iso = Annotated[float | None, number("--iso", "Value where the surface is; without it, the body's surface")]
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
    from intaglio.io.meshes import KINDS
    from intaglio.io.volumes import read_volume

    step = numbers(how.spacing, "--spacing", same=True) if how.spacing is not None else None
    layout = _layout(how.raw, step) if how.raw is not None else None
    if layout is None and scan.is_file():
        if scan.suffix.lower() in KINDS:
            raise InputError(
                f"{scan.name}: is a mesh, and this command draws scans; `intaglio info {scan.name}` tells about meshes"
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
            fill=how.fill,
            series=how.series,
            index=how.index,
            progress=progress,
        )
    for text in volume.notes:
        say(f"note: {text}")
    return volume


def _options_of(parameters: type, prefix: str = "", panel: str = "Style, parameter by parameter") -> list[inspect.Parameter]:
    """One command-line option for each field of a parameter dataclass; None means the style's own value."""
    out = []
    for item in fields(parameters):
        assert item.default is not MISSING
        name, kind = f"--{prefix}{item.name}".replace("_", "-"), type(item.default)
        low, high, text = item.metadata["low"], item.metadata["high"], item.metadata["help"]
        text = text[0].upper() + text[1:]
        look: Any = {"rich_help_panel": panel}
        if item.default is None:
            kind, option = bool, Option(f"{name}/--no-{name[2:]}", help=f"{text}.", show_default=False, **look)
        elif low is None:
            option = Option(name, metavar="TEXT", help=f"{text}.", **look)
        else:
            option = number(name, text, low, high, kind=kind, **look)
        annotation: Any = Annotated[kind | None, option]
        out.append(inspect.Parameter(prefix + item.name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation))
    return out


def with_groups(command: Callable[..., None]) -> Callable[..., None]:
    """Replace a command's parameters that are groups of options, such as Reading, by the options."""
    signature = inspect.signature(command, eval_str=True)
    groups: dict[str, Any] = {p.name: p.annotation for p in signature.parameters.values() if is_dataclass(p.annotation)}
    flat = []
    for parameter in signature.parameters.values():
        if parameter.name not in groups:
            flat.append(parameter)
            continue
        group = groups[parameter.name]
        hints = get_type_hints(group, include_extras=True)
        flat += [parameter.replace(name=f.name, default=f.default, annotation=hints[f.name]) for f in fields(group)]

    @wraps(command)
    def run(**given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{f.name: given.pop(f.name) for f in fields(group)})
        command(**given)

    run.__signature__ = signature.replace(parameters=flat)  # type: ignore[attr-defined]
    run.__annotations__ = {p.name: p.annotation for p in flat} | {"return": None}
    return run


def with_options(parameters: type, *, only: Container[str] | None = None, **parts: type) -> Callable[..., Callable[..., None]]:
    """Replace a command's **parameters by the options of a dataclass, so that each is declared once.

    only   names of the fields that matter to the command
    parts  dataclasses that fields hold; their options are --FIELD-NAME
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        signature = inspect.signature(command, eval_str=True)
        own = [p for p in signature.parameters.values() if p.kind is not inspect.Parameter.VAR_KEYWORD]
        derived = [p for p in _options_of(parameters) if only is None or p.name in only]
        helps = {item.name: item.metadata["help"] for item in fields(parameters)}
        for name, part in parts.items():
            derived += _options_of(part, f"{name}_", helps[name].capitalize())
        keyword = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in own] + derived
        command.__signature__ = signature.replace(parameters=keyword)  # type: ignore[attr-defined]
        command.__annotations__ = {p.name: p.annotation for p in keyword} | {"return": None}
        return command

    return decorate


def styled(name: str, parameters: dict[str, Any]) -> Hatching:
    """A style with what was given on the command line; any option of a hand's asks for contours by hand."""
    changes = {key: value for key, value in parameters.items() if value is not None}
    moves = {key: changes.pop(key) for key in list(changes) if key.startswith("hand_")}
    by_hand = changes.pop("hand", None)
    if by_hand is False and moves:
        option = next(iter(moves)).replace("_", "-")
        raise BadParameter("cannot be given together with --no-hand", param_hint=f"'--{option}'")
    own = style(name).hand
    if by_hand is not None or moves:
        hand = replace(own or Hand(), **{key.removeprefix("hand_"): value for key, value in moves.items()})
        changes["hand"] = None if by_hand is False else hand
    return style(name, **changes)
