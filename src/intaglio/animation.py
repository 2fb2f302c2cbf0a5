"""Turntables: plates of a body that turns, whose strokes stay on its surfaces."""

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
from intaglio.lighting import Light, Material
from intaglio.parts import Part
from intaglio.plate import HALO, PLATE_LIGHTS, PLATE_MATERIAL, Frame, check_parts, illustrated, surfaces_of
from intaglio.volume import Volume

# Views in which a body is looked at to find a camera that sees it whole while it turns.
AROUND = 24


def turntable(
    subject: Volume | Sequence[Part],
    *,
    frames: int = 36,
    degrees: float = 360.0,
    view: Any = "anterior",
    size: int = 800,
    seed: int = 0,
    width_mm: float = 120.0,
    halo: float = HALO,
    paper: str | None = None,
    lights: Sequence[Light] = PLATE_LIGHTS,
    material: Material = PLATE_MATERIAL,
    title: str = "",
    progress: Progress | None = None,
    camera: dict[str, Any] | None = None,
    **surface: Any,
) -> Iterator[Drawing]:
    """Plates of a body that turns about its long axis, one by one, each when it is asked for.

    subject          Parts, drawn as by `illustrate`; or a Volume, drawn as by `hatch`, in "pen-and-ink" unless told otherwise
    frames, degrees  how many plates share what angle; the viewer walks round the body, to its left first
    size             rays along the longer side
    camera           more of what `Camera.looking` takes
    surface          of a Volume: iso, inside, transfer_function, style and its parameters, islands, selections
    The rest as `illustrate`. The streamlines of each plate are carried to the next one, each part's with its own surface: they
    stay where there is room for them and they follow the form, grow at their ends, and new ones fill the gaps. Strokes of
    contours drawn by hand begin where they did, and keep their chance. A plate so depends on those before it; equal input
    and seed give equal plates. progress(done, frames) after each plate; an exception from it ends all.
    """
    if not (1 <= frames <= 3600 and int(frames) == frames):
        raise InputError(f"frames must be a whole number between 1 and 3600, not {frames!r}")
    if not (math.isfinite(degrees) and degrees != 0):
        raise InputError(f"degrees must be a number other than 0, not {degrees!r}")
    if isinstance(subject, Volume):
        parts = surfaces_of(subject, **({"style": "pen-and-ink"} | surface))
    elif surface:
        raise InputError(f"{next(iter(surface))!r} must not be given with Parts: each says how it is drawn")
    else:
        parts = list(subject)
    check_parts(parts, halo)
    cameras = _cameras(parts, view, size, [degrees * i / frames for i in range(frames)], camera or {})
    title = title or f"{parts[0].volume.name}, {', '.join(part.title for part in parts)}"
    scene = {"seed": seed, "width_mm": width_mm, "halo": halo, "paper": paper, "lights": lights, "material": material}
    return _plates(parts, cameras, title, scene, progress)


def _plates(
    parts: list[Part], cameras: list[Camera], title: str, scene: dict[str, Any], progress: Progress | None
) -> Iterator[Drawing]:
    before: Frame | None = None
    for done, camera in enumerate(cameras):
        before = illustrated(parts, camera, title=f"{title}, {done + 1}", before=before, **scene)
        yield before.drawing
        if progress:
            progress(done + 1, len(cameras))


def _cameras(parts: list[Part], view: Any, size: int, angles: list[float], options: dict[str, Any]) -> list[Camera]:
    """One camera for each angle, all about the vertical through the middle of the surfaces, near enough to fill the plate."""
    points = np.concatenate([part.corners for part in parts])
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
