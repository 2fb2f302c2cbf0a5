"""Hatching: tone from evenly spaced strokes along the surface's form."""

# M. Gerl, "Volume hatching", 2006: strokes cut from streamlines by light, layers of tone, crosshatching.
# Unlike there, layers are nested: each one's lines run between those of the layer before.

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress
from intaglio.drawing import Layer, Strokes
from intaglio.errors import InputError
from intaglio.gbuffer import GBuffer
from intaglio.ink.carry import bent
from intaglio.ink.density import line_density
from intaglio.ink.direction import direction_field
from intaglio.ink.smoothing import blurred
from intaglio.ink.streamlines import Streamlines, streamlines
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
# By how much a stroke's taper is shorter where it ends in a layer's full tone.
BLUNT = 0.65
# A stroke is drawn from this part of the tone of the thinnest line on, and where tone is next to nothing it must be
# longer than others by this many times the shortest.
EARLY = 0.75
FAINT = 4.0


@dataclass(frozen=True)
class _Tone:
    """One layer: `lines` mm for each mm2, turned by `angle`, `separation` mm apart, for the darkness from `begin` to `end`."""

    name: str
    angle: float
    separation: float
    lines: float
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
    full = hatching.thickest * hatching.opacity
    out: list[_Tone] = []
    covered = 0.0
    for cross, count in ((0, hatching.layers), (1, hatching.crosshatch)):
        inked = below = 0.0
        under = covered
        for i in range(count):
            lines = DENSITY / hatching.separation * (2 ** (i - 1) if i else 1)
            inked = min(inked + full * lines, 1.0)
            # Along the form, nested lines do not overlap; lines across cover what the others left free.
            covered = 1.0 - (1.0 - under) * (1.0 - inked)
            begin = below if i else under
            # A layer has nothing to add to paper that is covered already.
            if covered > begin:
                name = f"{'crosshatching' if cross else 'hatching'} {i + 1}"
                out.append(_Tone(name, cross * hatching.angle, hatching.separation / 2**i, lines, begin, covered))
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
        field = _turned(lines_along, tone.angle)
        lines = streamlines(
            field,
            tone.separation / mm_per_pixel,
            allowed=dark > max(tone.begin - 2 * hatching.ragged, 0.0),
            edge=gb.edge,
            test=hatching.evenness,
            beside=beside.get(tone.angle),
            kept=bent(kept[done], field) if kept else None,
        )
        beside[tone.angle] = np.concatenate([beside[tone.angle], lines.points]) if tone.angle in beside else lines.points
        strokes = _strokes(lines, dark, tone, hatching, mm_per_pixel, [seed, done])
        laid.append(lines)
        layers.append(Layer(tone.name, strokes, colour=hatching.ink))
    if progress:
        progress(len(plan), len(plan))
    return layers, laid


def _strokes(lines: Streamlines, dark: Floats, tone: _Tone, hatching: Hatching, mm_per_pixel: float, seed: list[int]) -> Strokes:
    """Cut streamlines where it is too bright for them; width and opacity from how dark it is and how many lines share that."""
    least = (hatching.thinnest / hatching.thickest) ** (1.0 / (1.0 - hatching.pressure)) if hatching.pressure < 1.0 else 0.0
    region = dark > tone.begin + EARLY * least * (tone.end - tone.begin)
    # One draw a number, so that a line that is kept from picture to picture keeps its chance.
    rng = np.random.default_rng(seed)
    points, offsets = lines.points, lines.offsets
    ragged = rng.normal(0.0, hatching.ragged, lines.number.max(initial=-1) + 1).astype(np.float32)
    number = lines.number[line_of(offsets)]
    load = (sample(dark, points) - tone.begin) / (tone.end - tone.begin)
    load += ragged[number] / (tone.end - tone.begin) * np.clip(1.0 - load, 0.0, 1.0)
    index, offsets = runs((load >= EARLY * least) & (load > 0.0), offsets)
    points, load, number = points[index], load[index], number[index]
    if len(points) == 0:
        return Strokes.none()
    # Faint strokes on bare paper must be longer to stay: on bright surfaces, short ones are noise.
    faint = 1.0 - np.minimum(np.maximum.reduceat(load, offsets[:-1]), 1.0) if tone.begin == 0.0 else 0.0
    long_enough = arc_length(points, offsets)[offsets[1:] - 1] * mm_per_pixel >= hatching.shortest * (1.0 + FAINT * faint)
    index, offsets = runs(np.repeat(long_enough, np.diff(offsets)), offsets)
    points, load, number = points[index], load[index], number[index]
    if len(points) == 0:
        return Strokes.none()
    if hatching.longest > 0:
        along = arc_length(points, offsets) * mm_per_pixel
        index, offsets = lifted(along, offsets, hatching.longest, rng, number[offsets[:-1]])
        points, load, number = points[index], load[index], number[index]
    turned = reversed_where(load[offsets[:-1]] < load[offsets[1:] - 1], offsets)
    points, load = points[turned], np.minimum(load[turned], 1.0)
    # Lines fade out where tone does; where others stop them in the dark, they would leave white flecks.
    fade = hatching.taper / mm_per_pixel * (1.0 - BLUNT * load)
    ends = taper(points, offsets, fade[offsets[:-1]], fade[offsets[1:] - 1])

    # Where lines lie less densely than planned, they are heavier, and the other way round.
    density = line_density(points, ends, offsets, region, tone.separation / mm_per_pixel).at(points)
    planned = np.float32(tone.lines * mm_per_pixel)
    load = np.clip(load * planned / np.maximum(density, 0.6 * planned), least, 1.0)
    points = points * np.float32(mm_per_pixel)
    if hatching.wobble > 0:
        aside = wander(offsets, arc_length(points, offsets), hatching.wobble, 9.0, rng, number[offsets[:-1]])
        points = points + sideways(points, offsets) * aside[:, None]
    width = hatching.thickest * load ** (1.0 - hatching.pressure) * ends
    opacity = hatching.opacity * load**hatching.pressure
    return pack(points, width, opacity, offsets)
