"""The main job: from a volume to a hatched plate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from intaglio.camera import Camera
from intaglio.compute import Progress
from intaglio.drawing import Drawing, Layer
from intaglio.errors import InputError
from intaglio.gbuffer import GBuffer
from intaglio.ink.beginnings import Beginnings
from intaglio.ink.carry import carried
from intaglio.ink.hatching import hatched, hatching_layers
from intaglio.ink.lines import line_layers, lined
from intaglio.ink.streamlines import Streamlines
from intaglio.ink.styles import Hatching, style as named_style
from intaglio.ink.visibility import Clearance, clearance, hide, surround, unhidden, visible
from intaglio.lighting import Light, Material
from intaglio.parts import ISLANDS, Part, faded, parts_of
from intaglio.rendering.isosurface import isosurface
from intaglio.rendering.skipping import Inside
from intaglio.selection import Selection
from intaglio.transfer_function import TransferFunction
from intaglio.volume import Volume

# A key from the upper left, and a weak lamp beside the viewer that models what the key leaves in shadow.
PLATE_LIGHTS = (Light(intensity=0.72), Light(direction=(0.5, 0.0, 0.8), intensity=0.25))
PLATE_MATERIAL = Material(ambient=0.06, diffuse=0.95, specular=0.12, shininess=12.0)

# How finely a surface is seen for a plate, if nobody says.
RAYS_PER_MM = 6.4
# Paper left free beside a contour in what lies behind it, mm.
HALO = 0.5


def surface_camera(
    volume: Volume,
    iso: float,
    view: Any = "anterior",
    size: int | tuple[int, int] | None = None,
    *,
    width_mm: float = 160.0,
    islands: float = ISLANDS,
    **options: Any,
) -> Camera:
    """`parts_camera` for one isosurface."""
    return parts_camera([Part(volume=volume, iso=iso, islands=islands)], view, size, width_mm=width_mm, **options)


def parts_camera(
    parts: Sequence[Part],
    view: Any = "anterior",
    size: int | tuple[int, int] | None = None,
    *,
    width_mm: float = 160.0,
    **options: Any,
) -> Camera:
    """`Camera.looking` at the blocks of the volumes that hold surfaces, so that empty margins of a scan do not count.

    size  as there; by default 6.4 pixels for each mm of a plate `width_mm` wide
    """
    if not parts:
        raise InputError("parts must hold at least one Part, not none")
    points = np.concatenate([part.corners for part in parts])
    camera = Camera.looking(view, points, size or 1024, **options)
    if size is None:
        across, longer = camera.size[0], max(camera.size)
        camera = Camera.looking(view, points, min(8192, round(RAYS_PER_MM * width_mm * longer / across)), **options)
    return camera


def draw(
    gb: GBuffer,
    hatching: str | Hatching,
    *,
    width_mm: float = 160.0,
    seed: int = 0,
    title: str = "",
    progress: Progress | None = None,
) -> Drawing:
    """Hatching, feature lines and contours of what is in a G-buffer, on paper `width_mm` wide, in a style or one of that name."""
    hatching, mm = named_style(hatching), _pixel_on_paper(gb.camera, width_mm)
    layers = hatching_layers(gb, hatching, mm, seed=seed, progress=progress) + line_layers(gb, hatching, mm, seed=seed)
    return on_paper(gb, hatching, layers, width_mm, title)


def draw_lines(gb: GBuffer, hatching: str | Hatching, *, width_mm: float = 160.0, seed: int = 0, title: str = "") -> Drawing:
    """Contours and feature lines alone of what is in a G-buffer, on paper `width_mm` wide."""
    hatching, mm = named_style(hatching), _pixel_on_paper(gb.camera, width_mm)
    return on_paper(gb, hatching, line_layers(gb, hatching, mm, seed=seed), width_mm, title)


def on_paper(gb: GBuffer, hatching: Hatching, layers: Sequence[Layer], width_mm: float, title: str) -> Drawing:
    """Layers in a style's brush on its paper."""
    width, height = gb.camera.size
    brushed = tuple(replace(layer, brush=hatching.brush) for layer in layers)
    return Drawing(brushed, width_mm, height * width_mm / width, hatching.paper, title, hatching.grain)


def _pixel_on_paper(camera: Camera, width_mm: float) -> float:
    if not 5 <= width_mm <= 5000:
        raise InputError(f"width_mm must be between 5 and 5000, not {width_mm!r}")
    return width_mm / camera.size[0]


def _surface(part: Part, camera: Camera, lights: Sequence[Light], material: Material, progress: Progress | None) -> GBuffer:
    volume, iso, inside = part.body
    return isosurface(
        volume, iso, camera, lights=lights, material=material, inside=inside, islands=part.smallest,
        selections=part.selections, progress=progress,
    )  # fmt: skip


def _seen(i: int, parts: Sequence[Part], surfaces: list[GBuffer], drawn: list[list[Layer]], mm: float, halo: float) -> Clearance:
    """Where strokes of part i are seen: not behind opaque parts, nor beside contours that pass in front."""
    free = clearance(surfaces[i])
    for j, other in enumerate(parts):
        if j == i:
            continue
        if other.opacity == 1:
            hide(free, surfaces[i], surfaces[j])
        for layer in drawn[j]:
            if layer.name == "contour" and halo > 0:
                surround(free, surfaces[i], surfaces[j], layer.strokes, mm, halo)
    return free


def check_parts(parts: Sequence[Part], halo: float) -> None:
    if not 0 <= halo <= 20:
        raise InputError(f"halo must be between 0 and 20 mm, not {halo!r}")
    if not parts:
        raise InputError("parts must hold at least one Part, not none")


def illustrate(
    parts: Sequence[Part],
    *,
    camera: Camera | None = None,
    seed: int = 0,
    width_mm: float = 160.0,
    halo: float = HALO,
    paper: str | None = None,
    lights: Sequence[Light] = PLATE_LIGHTS,
    material: Material = PLATE_MATERIAL,
    title: str = "",
    progress: Progress | None = None,
) -> Drawing:
    """Draw several surfaces on one plate: those behind transparent ones show through, those behind opaque ones do not.

    parts   what is drawn, the last one's strokes on top
    camera  default: anterior, fitted to all parts
    halo    mm left free on both sides of a contour in what lies behind it (Appel et al. 1979)
    paper   "#rrggbb"; default: that of the first part's style

    Skin as a veil, the skull under it in pencil:
    `illustrate([Part(volume=v, iso=0.2, opacity=0.3, lines_only=True), Part(volume=v, iso=0.55)])`.
    A liver of a label volume: `Part(volume=labels, label=5, style="engraving", colour="#8a2b1a")`.
    Cavities: `Part(volume=v, iso=(-math.inf, 600))`. Equal parts and seed give an equal Drawing.
    """
    check_parts(parts, halo)
    camera = camera or parts_camera(parts, width_mm=width_mm)
    return illustrated(
        parts, camera, seed=seed, width_mm=width_mm, halo=halo, paper=paper, lights=lights, material=material, title=title,
        progress=progress,
    ).drawing  # fmt: skip


@dataclass(frozen=True, eq=False)
class Frame:
    """A plate of a series, and what the next one needs of it: of each part its surface, its streamlines, its hand's strokes."""

    drawing: Drawing
    surfaces: list[GBuffer]
    lines: list[list[Streamlines]]
    beginnings: list[Beginnings]


def illustrated(
    parts: Sequence[Part],
    camera: Camera,
    *,
    seed: int,
    width_mm: float,
    halo: float,
    paper: str | None = None,
    lights: Sequence[Light] = PLATE_LIGHTS,
    material: Material = PLATE_MATERIAL,
    title: str = "",
    progress: Progress | None = None,
    before: Frame | None = None,
) -> Frame:
    """`illustrate`, with strokes carried over from the plate before, which shows the same parts from elsewhere."""
    mm = _pixel_on_paper(camera, width_mm)
    surfaces = [_surface(part, camera, lights, material, progress) for part in parts]
    drawn: list[list[Layer]] = []
    laid: list[list[Streamlines]] = []
    begun: list[Beginnings] = []
    for i, (part, gb) in enumerate(zip(parts, surfaces, strict=True)):
        tone: list[Layer] = []
        lines: list[Streamlines] = []
        if not part.lines_only:
            kept = [carried(layer, before.surfaces[i], gb) for layer in before.lines[i]] if before else []
            tone, lines = hatched(gb, part.hatching, mm, seed=seed, kept=kept, progress=progress)
        opaque = [front for j, front in enumerate(surfaces) if j != i and parts[j].opacity == 1]
        contours, beginnings = lined(
            unhidden(gb, opaque), part.hatching, mm, seed=seed, kept=before.beginnings[i] if before else None
        )
        drawn.append(tone + contours)
        laid.append(lines)
        begun.append(beginnings)
    layers: list[Layer] = []
    for i, part in enumerate(parts):
        free = _seen(i, parts, surfaces, drawn, mm, halo)
        prefix = f"{part.title}: " if len(parts) > 1 else ""
        for layer in drawn[i]:
            layers.append(
                replace(faded(visible(layer, free, mm), part.opacity), name=prefix + layer.name, brush=part.hatching.brush)
            )
    paper = paper or parts[0].hatching.paper
    title, grain = title or ", ".join(part.title for part in parts), parts[0].hatching.grain
    return Frame(Drawing(tuple(layers), width_mm, camera.size[1] * mm, paper, title, grain), surfaces, laid, begun)


def surfaces_of(
    volume: Volume,
    *,
    iso: float | None = None,
    inside: Inside | None = None,
    transfer_function: TransferFunction | None = None,
    style: str | Hatching = "pencil",
    islands: float = ISLANDS,
    selections: Sequence[Selection] = (),
    **parameters: Any,
) -> list[Part]:
    """The surface at an isovalue, by default the body's, or those that a transfer function shows; arguments as for `hatch`."""
    hatching = named_style(style, **parameters)
    if transfer_function is None:
        return [Part(volume=volume, iso=iso, inside=inside, style=hatching, islands=islands, selections=selections)]
    if iso is not None:
        raise InputError(f"iso must not be given with a transfer function, which says where surfaces are, not {iso!r}")
    return parts_of(volume, transfer_function, style=hatching, islands=islands, selections=selections)


def hatch(
    volume: Volume,
    *,
    iso: float | None = None,
    inside: Inside | None = None,
    transfer_function: TransferFunction | None = None,
    camera: Camera | None = None,
    style: str | Hatching = "pencil",
    seed: int = 0,
    width_mm: float = 160.0,
    halo: float = HALO,
    islands: float = ISLANDS,
    selections: Sequence[Selection] = (),
    lights: Sequence[Light] = PLATE_LIGHTS,
    material: Material = PLATE_MATERIAL,
    progress: Progress | None = None,
    **parameters: Any,
) -> Drawing:
    """Hatch the isosurface of a volume: G-buffer, direction field, streamlines, strokes, contours.

    iso         default: the surface of the body, as `body_surface` finds it
    inside      on which side of iso the body is, "above" or "below"; default: above, but below in distances
    transfer_function  instead of iso: all the surfaces that it shows, see `parts_of`
    camera      default: anterior, fitted to the surface; its image sets the plate's proportions and fineness
    style       a name from `styles()`, or a Hatching; single parameters of it may be given as keywords
    width_mm    of the paper
    halo        see `illustrate`, which draws any surfaces of any volumes
    islands     pieces smaller than this part of the largest one are left out
    selections  tools that cut the body open
    Equal input and seed give an equal Drawing, whatever the number of threads. InputError for what cannot be drawn.
    """
    parts = surfaces_of(
        volume, iso=iso, inside=inside, transfer_function=transfer_function, style=style, islands=islands, selections=selections,
        **parameters,
    )  # fmt: skip
    title = f"{volume.name}, {transfer_function.name if transfer_function else parts[0].title}"
    return illustrate(
        parts, camera=camera, seed=seed, width_mm=width_mm, halo=halo, lights=lights, material=material, title=title,
        progress=progress,
    )  # fmt: skip


def contour(
    volume: Volume,
    *,
    iso: float | None = None,
    inside: Inside | None = None,
    camera: Camera | None = None,
    style: str | Hatching = "pen-and-ink",
    seed: int = 0,
    width_mm: float = 160.0,
    islands: float = ISLANDS,
    selections: Sequence[Selection] = (),
    progress: Progress | None = None,
    **parameters: Any,
) -> Drawing:
    """Draw the contours and feature lines of an isosurface, without hatching; arguments as for `hatch`.

    Contours are exact, or drawn in overlapping strokes with `hand=Hand()`.
    """
    hatching = named_style(style, **parameters)
    part = Part(volume=volume, iso=iso, inside=inside, style=hatching, islands=islands, selections=selections, lines_only=True)
    title = f"{volume.name}, iso {part.body[1]:g}"
    return illustrate([part], camera=camera, seed=seed, width_mm=width_mm, title=title, progress=progress)
