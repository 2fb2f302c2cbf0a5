"""Turntables: plates of a body that turns, whose strokes stay on its surface."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from intaglio.camera import Camera
from intaglio.compute import Progress
from intaglio.drawing import Drawing
from intaglio.errors import InputError
from intaglio.gbuffer import GBuffer
from intaglio.ink.carry import carried
from intaglio.ink.hatching import hatched
from intaglio.ink.lines import line_layers
from intaglio.ink.streamlines import Streamlines
from intaglio.ink.styles import Hatching, style as named_style
from intaglio.lighting import Light, Material
from intaglio.parts import ISLANDS
from intaglio.plate import PLATE_LIGHTS, PLATE_MATERIAL, on_paper
from intaglio.rendering.isosurface import isosurface
from intaglio.rendering.isovalue import body_surface
from intaglio.rendering.skipping import SURFACE, surface_blocks, surface_corners
from intaglio.selection import Selection
from intaglio.volume import Volume

# Views in which a body is looked at to find a camera that sees it whole while it turns.
AROUND = 24


def turntable(
    volume: Volume,
    *,
    iso: float | None = None,
    frames: int = 36,
    degrees: float = 360.0,
    view: Any = "anterior",
    size: int = 800,
    style: str | Hatching = "pen-and-ink",
    seed: int = 0,
    width_mm: float = 120.0,
    islands: float = ISLANDS,
    selections: Sequence[Selection] = (),
    lights: Sequence[Light] = PLATE_LIGHTS,
    material: Material = PLATE_MATERIAL,
    progress: Progress | None = None,
    camera: dict[str, Any] | None = None,
    **parameters: Any,
) -> Iterator[Drawing]:
    """Hatched plates of a body that turns about its long axis, one by one, each when it is asked for.

    frames, degrees  how many plates share what angle; the viewer walks round the body, to its left first
    size             rays along the longer side
    camera           more of what `Camera.looking` takes
    The rest as `hatch`. The streamlines of each plate are carried to the next one with the surface: they stay where there is
    room for them and they follow the form, grow at their ends, and new ones fill the gaps. A plate so depends on those
    before it; equal input and seed give equal plates. progress(done, frames) after each plate; an exception from it ends all.
    """
    if not (1 <= frames <= 3600 and int(frames) == frames):
        raise InputError(f"frames must be a whole number between 1 and 3600, not {frames!r}")
    if not (math.isfinite(degrees) and degrees != 0):
        raise InputError(f"degrees must be a number other than 0, not {degrees!r}")
    hatching = named_style(style, **parameters)
    iso = body_surface(volume)[0] if iso is None else iso
    cameras = _cameras(volume, iso, view, size, islands, [degrees * i / frames for i in range(frames)], camera or {})
    scene = {"lights": lights, "material": material, "islands": islands, "selections": selections}
    return _plates(volume, iso, cameras, hatching, scene, width_mm, seed, progress)


def _plates(
    volume: Volume,
    iso: float,
    cameras: list[Camera],
    hatching: Hatching,
    scene: dict[str, Any],
    width_mm: float,
    seed: int,
    progress: Progress | None,
) -> Iterator[Drawing]:
    before: GBuffer | None = None
    lines: list[Streamlines] = []
    for done, camera in enumerate(cameras):
        gb = isosurface(volume, iso, camera, **scene)
        mm = width_mm / camera.size[0]
        kept = [carried(layer, before, gb) for layer in lines] if before else []
        layers, lines = hatched(gb, hatching, mm, seed=seed, kept=kept)
        before = gb
        layers += line_layers(gb, hatching, mm, seed=seed)
        yield on_paper(gb, hatching, layers, width_mm, f"{volume.name}, iso {iso:g}, {done + 1}")
        if progress:
            progress(done + 1, len(cameras))


def _cameras(
    volume: Volume, iso: float, view: Any, size: int, islands: float, angles: list[float], options: dict[str, Any]
) -> list[Camera]:
    """One camera for each angle, all about the vertical through the middle of the surface, near enough to fill the plate."""
    blocks = surface_blocks(volume, iso, islands)
    points = surface_corners(volume, blocks) if (blocks == SURFACE).any() else np.asarray(volume.corners)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    around = [middle + (points - middle) @ _turn(360.0 * i / AROUND) for i in range(AROUND)]
    first = Camera.looking(view, np.concatenate(around), size, **options)
    return [
        replace(first, eye=middle + _turn(a) @ (first.eye - middle), forward=_turn(a) @ first.forward, up=_turn(a) @ first.up)
        for a in angles
    ]


def _turn(degrees: float) -> Any:
    """3x3 rotation about the superior axis."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
