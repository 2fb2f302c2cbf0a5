"""Contours as strokes: heavier where more lies behind them and on the side away from the light."""

from __future__ import annotations

import numpy as np

from intaglio.drawing import Layer, Strokes
from intaglio.gbuffer import GBuffer
from intaglio.ink.contours import occluding_contours
from intaglio.ink.strokes import arc_length, pack, runs, smoothed, taper


def contour_layer(
    gb: GBuffer, mm_per_pixel: float, *, width: float = 0.42, shortest: float = 1.2, colour: str = "#000000", opacity: float = 1.0
) -> Layer:
    """The occluding contours as strokes; width and shortest in mm on paper."""
    contours = occluding_contours(gb)
    points, offsets = contours.points, contours.offsets
    if len(points) == 0:
        return Layer("contour", Strokes.none(), colour=colour)
    # A jump as deep as a tenth of the subject counts like the background.
    depth = gb.depth[gb.mask]
    reach = 0.1 * float(depth.max() - depth.min()) + 1e-6
    strength = np.sqrt(np.clip(contours.jump / reach, 0.0, 1.0))

    # Faint contours must be longer to stay: noise makes short ones.
    length = arc_length(points, offsets)[offsets[1:] - 1] * mm_per_pixel
    mean = np.add.reduceat(strength, offsets[:-1]) / np.diff(offsets)
    index, offsets = runs(np.repeat(length >= shortest * (3.0 - 2.0 * mean), np.diff(offsets)), offsets)
    if len(index) == 0:
        return Layer("contour", Strokes.none(), colour=colour)
    points, strength, light = points[index], strength[index], contours.light[index]
    weight = smoothed((0.5 + 0.5 * strength) * (1.15 - 0.45 * light), offsets, 12)
    points = smoothed(points, offsets, 2) * np.float32(mm_per_pixel)

    # An end that fades into the surface is drawn out; one that meets another contour is not.
    first, last = offsets[:-1], offsets[1:] - 1
    closed = (points[first] == points[last]).all(axis=1)
    begin = np.where(closed | (strength[first] > 0.6), 0.0, 8 * width)
    end = np.where(closed | (strength[last] > 0.6), 0.0, 8 * width)
    thickness = width * weight * taper(points, offsets, begin, end)
    return Layer("contour", pack(points, thickness, np.full(len(points), opacity), offsets), colour=colour)
