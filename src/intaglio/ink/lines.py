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
    length = arc_length(points, offsets)[offsets[1:] - 1] * mm_per_pixel
    index, offsets = runs(np.repeat(length >= shortest, np.diff(offsets)), offsets)
    if len(index) == 0:
        return Layer("contour", Strokes.none(), colour=colour)
    points, jump, light = points[index], contours.jump[index], contours.light[index]

    # A jump as deep as a tenth of the subject counts like the background.
    depth = gb.depth[gb.mask]
    reach = 0.1 * float(depth.max() - depth.min()) + 1e-6
    weight = (0.5 + 0.5 * np.sqrt(np.clip(jump / reach, 0.0, 1.0))) * (1.15 - 0.45 * light)
    weight = smoothed(weight, offsets, 12)
    points = smoothed(points, offsets, 2) * np.float32(mm_per_pixel)
    closed = np.all(points[offsets[:-1]] == points[offsets[1:] - 1], axis=1)
    ends = np.where(np.repeat(closed, np.diff(offsets)), 1.0, taper(points, offsets, 6 * width, 6 * width))
    return Layer("contour", pack(points, width * weight * ends, np.full(len(points), opacity), offsets), colour=colour)
