"""Hatching: tone from evenly spaced strokes along the surface's form."""

# M. Gerl, "Volume hatching", 2006: strokes cut from streamlines by light, layers of tone, crosshatching.
# Unlike there, layers are nested: each one's lines run between those of the layer before.

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress
from intaglio.drawing import Layer, Strokes
from intaglio.errors import InputError
from intaglio.gbuffer import GBuffer
from intaglio.ink.direction import direction_field
from intaglio.ink.smoothing import blurred
from intaglio.ink.streamlines import streamlines
from intaglio.ink.strokes import (
    arc_length,
    lifted,
    line_of,
    pack,
    reversed_where,
    runs,
    sample,
    sideways,
    taper,
    wander,
)
from intaglio.ink.styles import Hatching

Floats = NDArray[np.float32]

# Length of lines per area, times separation, that `streamlines` really lays: a little less than one line every separation.
DENSITY = 0.87


@dataclass(frozen=True)
class _Tone:
    """One layer: lines turned by `angle`, `separation` mm apart, carrying the darkness from `begin` to `end`."""

    name: str
    angle: float
    separation: float
    begin: float
    end: float


def darkness(gb: GBuffer, hatching: Hatching, mm_per_pixel: float) -> Floats:
    """(h, w) requested tone: the share of the paper to be covered, 0 .. what all layers together can print.

    From the light, averaged a little on each surface so that noise does not break strokes, less the light that hollows
    of a radius up to a few mm on paper do not get. On paper darker than the ink, strokes are where it is bright.
    """
    light = gb.brightness
    if hatching.hollows > 0:
        radius = 4.0 * gb.pixel_mm / mm_per_pixel
        light = (light - hatching.hollows * np.clip(-gb.curvature[..., 1] * radius, 0.0, 1.0)).astype(np.float32)
    light = blurred(gb, light, hatching.blur / mm_per_pixel)
    d = np.clip((hatching.white - light) / (hatching.white - hatching.black), 0.0, 1.0)
    if hatching.bright:
        d = 1.0 - d
    return np.where(gb.mask, tones(hatching)[-1].end * d**hatching.contrast, 0.0).astype(np.float32)


def tones(hatching: Hatching) -> list[_Tone]:
    """The layers and the darkness that each adds, from what share of the paper its ink covers."""
    full = DENSITY * hatching.thickest * hatching.opacity
    out: list[_Tone] = []
    covered = 0.0
    for cross, count in ((0, hatching.layers), (1, hatching.crosshatch)):
        lines = below = 0.0
        under = covered
        for i in range(count):
            more = full / hatching.separation * (2 ** (i - 1) if i else 1)
            lines = min(lines + more, 1.0)
            # Along the form, nested lines do not overlap; lines across cover what the others left free.
            covered = 1.0 - (1.0 - under) * (1.0 - lines)
            begin = below if i else under
            # A layer has nothing to add to paper that is covered already.
            if covered > begin:
                name = f"{'crosshatching' if cross else 'hatching'} {i + 1}"
                out.append(_Tone(name, cross * hatching.angle, hatching.separation / 2**i, begin, covered))
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
    rng = np.random.default_rng(seed)
    dark = darkness(gb, hatching, mm_per_pixel)
    lines_along = direction_field(gb, hatching.smoothing / mm_per_pixel, hatching.passes)
    layers: list[Layer] = []
    beside: dict[float, Floats] = {}
    plan = tones(hatching)
    finest = min(tone.separation for tone in plan)
    if finest < mm_per_pixel:
        raise InputError(
            f"lines {finest:.3g} mm apart need pixels of at most that size on paper, not {mm_per_pixel:.3g} mm: "
            "use a larger image (--size), smaller paper (--width) or a wider separation"
        )
    for done, tone in enumerate(plan):
        if progress:
            progress(done, len(plan))
        lines = streamlines(
            _turned(lines_along, tone.angle),
            tone.separation / mm_per_pixel,
            allowed=dark > max(tone.begin - 2 * hatching.ragged, 0.0),
            edge=gb.edge,
            test=hatching.evenness,
            beside=beside.get(tone.angle),
        )
        beside[tone.angle] = np.concatenate([beside[tone.angle], lines.points]) if tone.angle in beside else lines.points
        strokes = _strokes(lines.points, lines.offsets, dark, tone, hatching, mm_per_pixel, rng)
        layers.append(Layer(tone.name, strokes, colour=hatching.ink))
    if progress:
        progress(len(plan), len(plan))
    return layers


def _strokes(
    points: Floats,
    offsets: NDArray[np.int64],
    dark: Floats,
    tone: _Tone,
    hatching: Hatching,
    mm_per_pixel: float,
    rng: np.random.Generator,
) -> Strokes:
    """Cut streamlines where it is too bright for them; width and opacity from how dark it is."""
    ragged = rng.normal(0.0, hatching.ragged, len(offsets) - 1).astype(np.float32)
    if len(offsets) < 2:
        return Strokes.none()
    asked = sample(dark, points)
    load = np.clip((asked - tone.begin + ragged[line_of(offsets)]) / (tone.end - tone.begin), 0.0, 1.0)
    by_width = load ** (1.0 - hatching.pressure)
    index, offsets = runs((by_width * hatching.thickest >= hatching.thinnest) & (asked > 0.0), offsets)
    points, load = points[index], load[index]

    along = arc_length(points, offsets)
    long_enough = along[offsets[1:] - 1] * mm_per_pixel >= hatching.shortest if len(along) else np.zeros(0, dtype=bool)
    index, offsets = runs(np.repeat(long_enough, np.diff(offsets)), offsets)
    points, load = points[index], load[index]
    if len(points) == 0:
        return Strokes.none()

    if hatching.longest > 0:
        index, offsets = lifted(arc_length(points, offsets) * mm_per_pixel, offsets, hatching.longest, rng)
        points, load = points[index], load[index]
    turned = reversed_where(load[offsets[:-1]] < load[offsets[1:] - 1], offsets)
    points, load = points[turned] * np.float32(mm_per_pixel), load[turned]
    if hatching.wobble > 0:
        along = arc_length(points, offsets)
        points = points + sideways(points, offsets) * wander(offsets, along, hatching.wobble, 9.0, rng)[:, None]
    ends = taper(points, offsets, hatching.taper, hatching.taper)
    width = hatching.thickest * load ** (1.0 - hatching.pressure) * ends
    opacity = hatching.opacity * load**hatching.pressure
    return pack(points, width, opacity, offsets)
