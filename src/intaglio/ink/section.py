"""Sections: where a body is cut, it is ruled with even parallel lines, the darker the less dense what is cut is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from intaglio.drawing import Layer, Strokes
from intaglio.gbuffer import GBuffer
from intaglio.ink.contours import chains, places
from intaglio.ink.smoothing import blurred
from intaglio.ink.streamlines import streamlines
from intaglio.ink.strokes import arc_length, pack, runs, smoothed
from intaglio.ink.styles import Hatching
from intaglio.ink.toned import Tone, toned

Floats = NDArray[np.float32]

# Faces are ruled as if they were sliced by planes of this normal (view space): one that faces the viewer with lines that
# rise by 45 degrees to the right, others each in a direction of its own, round ones along their form.
SLICING = (1.0, -1.0, -0.7)
# How near lines may come where a face is round, as a part of their distance.
EVENNESS = 0.7
# Tone of the least and of the most dense, as a part of what the lines can print; bone is light, as in a radiograph.
DARKEST, LIGHTEST = 0.66, 0.1
# How much darker faces are that get no light.
SHADE = 0.5


def section_tone(hatching: Hatching) -> Tone:
    """Lines about as far apart as those along the form are in middle tones."""
    apart = hatching.separation / 2 ** (0.5 * (hatching.layers - 1))
    return Tone("section", 0.0, apart, 1.0 / apart, 0.0, min(hatching.thickest * hatching.opacity / apart, 1.0))


def section_darkness(gb: GBuffer, hatching: Hatching, mm_per_pixel: float) -> Floats:
    """(h, w) requested tone of sections, 0 elsewhere."""
    dense = blurred(gb, np.where(gb.cut, gb.section, 0.0).astype(np.float32), 0.5 * hatching.blur / mm_per_pixel)
    white = 1.0 - (DARKEST + (LIGHTEST - DARKEST) * dense)
    white *= 1.0 - SHADE * (1.0 - gb.brightness)
    d = white if hatching.bright else 1.0 - white
    return np.where(gb.cut, section_tone(hatching).end * d, 0.0).astype(np.float32)


def section_layer(gb: GBuffer, dark: Floats, room: Floats, hatching: Hatching, mm_per_pixel: float, seed: list[int]) -> Layer:
    """Lines across the sections, of the tone `dark` (0 elsewhere); `room` (h, w) is in pixels to their borders."""
    tone = section_tone(hatching)
    lines = streamlines(
        _slices(gb), tone.separation / mm_per_pixel, allowed=dark > 0.0, edge=gb.border, test=max(hatching.evenness, EVENNESS)
    )
    # Narrow faces are ruled as wide ones are.
    short = replace(hatching, shortest=min(0.5 * tone.separation, hatching.shortest))
    return Layer(tone.name, toned(lines, dark, room, tone, [], short, mm_per_pixel, seed), colour=hatching.ink)


def _slices(gb: GBuffer) -> Floats:
    """(2, h, w) cosine and sine of twice the angle of the faces' cuts with parallel planes."""
    along = np.cross(gb.normal @ gb.camera.view_from_world.T, SLICING)
    x, y = along[..., 0], -along[..., 1]
    size = np.maximum(x * x + y * y, 1e-12)
    return np.where(gb.cut, np.stack([x * x - y * y, 2.0 * x * y]) / size, 0.0).astype(np.float32)


def rim_layer(gb: GBuffer, mm_per_pixel: float, *, width: float, shortest: float, colour: str, opacity: float) -> Layer:
    """The outline of the sections where they meet the surface; lengths in mm on paper."""
    rim = np.where(np.isnan(gb.edge), gb.border, np.nan).astype(np.float32)
    order, offsets = chains(rim, gb.depth)
    points = smoothed(places(order, rim), offsets, 10) * np.float32(mm_per_pixel)
    length = arc_length(points, offsets)
    if len(points) == 0:
        return Layer("rim", Strokes.none(), colour=colour)
    index, offsets = runs(np.repeat(length[offsets[1:] - 1] >= shortest, np.diff(offsets)), offsets)
    points = points[index]
    n = len(points)
    return Layer("rim", pack(points, np.full(n, width), np.full(n, opacity), offsets), colour=colour)
