"""The main job: from a volume to a hatched plate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from intaglio.camera import Camera
from intaglio.compute import Progress
from intaglio.drawing import Drawing
from intaglio.errors import InputError
from intaglio.gbuffer import GBuffer
from intaglio.ink.hatching import hatching_layers
from intaglio.ink.lines import line_layers
from intaglio.ink.styles import Hatching, style as named_style
from intaglio.lighting import Light, Material
from intaglio.rendering.isosurface import isosurface
from intaglio.rendering.isovalue import body_surface
from intaglio.rendering.skipping import SURFACE, surface_blocks, surface_corners
from intaglio.selection import Selection
from intaglio.volume import Volume

# A key from the upper left, and a weak lamp beside the viewer that models what the key leaves in shadow.
PLATE_LIGHTS = (Light(intensity=0.72), Light(direction=(0.5, 0.0, 0.8), intensity=0.25))
PLATE_MATERIAL = Material(ambient=0.06, diffuse=0.95, specular=0.12, shininess=12.0)

# Pieces smaller than this part of the largest one are dust, cables or a corner of the table.
ISLANDS = 0.01
# How finely a surface is seen for a plate, if nobody says.
RAYS_PER_MM = 6.4


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
    """`Camera.looking` at the part of the volume that holds the surface, so that empty margins of a scan do not count.

    size  as there; by default 6.4 pixels for each mm of a plate `width_mm` wide
    """
    blocks = surface_blocks(volume, iso, islands)
    points = surface_corners(volume, blocks) if (blocks == SURFACE).any() else volume
    camera = Camera.looking(view, points, size or 1024, **options)
    if size is None:
        across, longer = camera.size[0], max(camera.size)
        camera = Camera.looking(view, points, min(8192, round(RAYS_PER_MM * width_mm * longer / across)), **options)
    return camera


def draw(
    gb: GBuffer,
    hatching: Hatching,
    *,
    width_mm: float = 160.0,
    seed: int = 0,
    title: str = "",
    progress: Progress | None = None,
) -> Drawing:
    """Hatching, feature lines and contours of what is in a G-buffer, on paper `width_mm` wide."""
    if not 5 <= width_mm <= 5000:
        raise InputError(f"width_mm must be between 5 and 5000, not {width_mm!r}")
    width, height = gb.camera.size
    mm = width_mm / width
    layers = hatching_layers(gb, hatching, mm, seed=seed, progress=progress) + line_layers(gb, hatching, mm)
    return Drawing(tuple(layers), width_mm, height * mm, hatching.paper, title)


def hatch(
    volume: Volume,
    *,
    iso: float | None = None,
    camera: Camera | None = None,
    style: str | Hatching = "pencil",
    seed: int = 0,
    width_mm: float = 160.0,
    islands: float = ISLANDS,
    selections: Sequence[Selection] = (),
    lights: Sequence[Light] = PLATE_LIGHTS,
    material: Material = PLATE_MATERIAL,
    progress: Progress | None = None,
    **parameters: Any,
) -> Drawing:
    """Hatch the isosurface of a volume: G-buffer, direction field, streamlines, strokes, contours.

    iso         default: the surface of the body, as `body_surface` finds it
    camera      default: anterior, fitted to the surface; its image sets the plate's proportions and fineness
    style       a name from `styles()`, or a Hatching; single parameters of it may be given as keywords
    width_mm    of the paper
    islands     pieces smaller than this part of the largest one are left out
    selections  tools that cut the body open
    Equal input and seed give an equal Drawing, whatever the number of threads. InputError for what cannot be drawn.
    """
    hatching = named_style(style, **parameters)
    iso = body_surface(volume)[0] if iso is None else iso
    camera = camera or surface_camera(volume, iso, width_mm=width_mm, islands=islands)
    gb = isosurface(
        volume, iso, camera, lights=lights, material=material, islands=islands, selections=selections, progress=progress
    )
    return draw(gb, hatching, width_mm=width_mm, seed=seed, title=f"{volume.name}, iso {iso:g}", progress=progress)
