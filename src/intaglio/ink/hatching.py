"""Hatching: tone from evenly spaced strokes along the surface's form."""

# M. Gerl, "Volume hatching", 2006: strokes cut from streamlines by light, layers of tone, crosshatching.
# Unlike there, layers are nested: each one's lines run between those of the layer before.

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress
from intaglio.drawing import Layer
from intaglio.errors import InputError
from intaglio.gbuffer import GBuffer
from intaglio.ink.carry import bent
from intaglio.ink.direction import direction_field
from intaglio.ink.margin import margin
from intaglio.ink.section import section_darkness, section_layer
from intaglio.ink.smoothing import blurred
from intaglio.ink.streamlines import Streamlines, streamlines
from intaglio.ink.styles import Hatching
from intaglio.ink.toned import Printed, Tone, toned

Floats = NDArray[np.float32]

# Length of lines per area, times separation, that can be counted on: `streamlines` lays 0.87 on a flat sheet and less on a
# wrinkled body, where lines are to be heavier. What runs between other lines, or across in dark spots, gets less room.
DENSITY = 0.82
LATER = 0.7


def darkness(gb: GBuffer, hatching: Hatching, mm_per_pixel: float) -> Floats:
    """(h, w) requested tone: the share of the paper to be covered, 0 .. what all layers together can print.

    From the light, averaged a little on each surface so that noise does not break strokes, less the light that hollows
    of a radius up to a few mm on paper do not get. On paper darker than the ink, strokes are where it is bright.
    Sections have tones of their own, see `section_darkness`.
    """
    light = gb.brightness
    if hatching.hollows > 0:
        radius = 4.0 * gb.pixel_mm / mm_per_pixel
        light = (light - hatching.hollows * np.clip(-gb.curvature[..., 1] * radius, 0.0, 1.0)).astype(np.float32)
    light = blurred(gb, light, hatching.blur / mm_per_pixel)
    d = np.clip((hatching.white - light) / (hatching.white - hatching.black), 0.0, 1.0)
    if hatching.bright:
        d = 1.0 - d
    dark = np.where(gb.mask, tones(hatching)[-1].end * d**hatching.contrast, 0.0).astype(np.float32)
    return np.where(gb.cut, section_darkness(gb, hatching, mm_per_pixel), dark) if gb.cut.any() else dark


def tones(hatching: Hatching) -> list[Tone]:
    """The layers and the darkness that each adds, from what share of the paper its ink covers."""
    full = hatching.thickest * hatching.opacity
    out: list[Tone] = []
    covered = 0.0
    for cross, count in ((0, hatching.layers), (1, hatching.crosshatch)):
        inked = below = 0.0
        under = covered
        for i in range(count):
            lines = (LATER if out else DENSITY) / hatching.separation * (2 ** (i - 1) if i else 1)
            inked = min(inked + full * lines, 1.0)
            # Along the form, nested lines do not overlap; lines across cover what the others left free.
            covered = 1.0 - (1.0 - under) * (1.0 - inked)
            begin = below if i else under
            # A layer has nothing to add to paper that is covered already.
            if covered > begin:
                name = f"{'crosshatching' if cross else 'hatching'} {i + 1}"
                out.append(Tone(name, cross * hatching.angle, hatching.separation / 2**i, lines, begin, covered))
            below = covered
    return out


def _turned(field_: Floats, degrees: float) -> Floats:
    if degrees == 0.0:
        return field_
    c, s = math.cos(math.radians(2 * degrees)), math.sin(math.radians(2 * degrees))
    return np.stack([c * field_[0] - s * field_[1], s * field_[0] + c * field_[1]]).astype(np.float32)


def hatching_layers(
    gb: GBuffer, hatching: Hatching, mm_per_pixel: float, *, seed: int = 0, progress: Progress | None = None
) -> list[Layer]:
    """Layers of strokes whose ink covers as much paper as the light asks for; dark ends first.

    mm_per_pixel  scale of the plate
    seed          of the hand's randomness
    """
    return hatched(gb, hatching, mm_per_pixel, seed=seed, progress=progress)[0]


def hatched(
    gb: GBuffer,
    hatching: Hatching,
    mm_per_pixel: float,
    *,
    seed: int = 0,
    kept: Sequence[Streamlines] = (),
    progress: Progress | None = None,
) -> tuple[list[Layer], list[Streamlines]]:
    """The layers, and the streamlines that they were cut from; `kept` are a former picture's, carried into this one."""
    dark = darkness(gb, hatching, mm_per_pixel)
    lines_along = direction_field(gb, hatching.smoothing / mm_per_pixel, hatching.passes)
    layers: list[Layer] = []
    laid: list[Streamlines] = []
    beside: dict[float, Floats] = {}
    printed: list[Printed] = []
    plan = tones(hatching)
    finest = min(tone.separation for tone in plan)
    if finest < mm_per_pixel:
        raise InputError(
            f"lines {finest:.3g} mm apart need pixels of at most that size on paper, not {mm_per_pixel:.3g} mm: "
            "use a larger image (--size), smaller paper (--width) or a wider separation"
        )
    room = margin(gb.border, 0.5 * hatching.thickest / mm_per_pixel + 2.0)
    if gb.cut.any():
        layers.append(section_layer(gb, np.where(gb.cut, dark, np.float32(0.0)), room, hatching, mm_per_pixel, [seed, len(plan)]))
        dark[gb.cut] = 0.0
    for done, tone in enumerate(plan):
        if progress:
            progress(done, len(plan))
        field = _turned(lines_along, tone.angle)
        lines = streamlines(
            field,
            tone.separation / mm_per_pixel,
            allowed=dark > max(tone.begin - 2 * hatching.ragged, 0.0),
            edge=gb.border,
            test=hatching.evenness,
            beside=beside.get(tone.angle),
            kept=bent(kept[done], field) if kept else None,
        )
        beside[tone.angle] = np.concatenate([beside[tone.angle], lines.points]) if tone.angle in beside else lines.points
        after = plan[done + 1] if done + 1 < len(plan) else None
        strokes = toned(lines, dark, room, tone, printed, hatching, mm_per_pixel, [seed, done], after)
        laid.append(lines)
        layers.append(Layer(tone.name, strokes, colour=hatching.ink))
    if progress:
        progress(len(plan), len(plan))
    return layers, laid
