"""Suggestive contours: where a surface would turn away if it were seen a little more from the side."""

# D. DeCarlo, A. Finkelstein, S. Rusinkiewicz, A. Santella, "Suggestive contours for conveying shape", 2003: here in the
# image, from the G-buffer's normal curvature along the view.

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import helper, kernel, strips
from intaglio.gbuffer import GBuffer
from intaglio.ink.contours import chains, places
from intaglio.ink.smoothing import connections, smooth

Floats = NDArray[np.float32]

# Cosine of the angle to the viewer above which a surface is seen too squarely to be nearly a contour.
SQUARE = 0.94


@helper
def _rise(channels, links, pixel, y, x):  # type: ignore[no-untyped-def]
    """Derivative of the radial curvature along the surface towards the viewer, 1/mm2; 0 beside a contour.

    Towards the viewer is against the normal in the image; a step there is one on the surface foreshortened by n.v.
    """
    h, w = channels.shape[1:]
    if x < 1 or y < 1 or x >= w - 1 or y >= h - 1:
        return 0.0
    if min(min(links[0, y, x], links[1, y, x]), min(links[0, y, x - 1], links[1, y - 1, x])) < 0.5:
        return 0.0
    nx = channels[1, y, x]
    ny = channels[2, y, x]
    size = nx * nx + ny * ny
    if size < 1.0 - SQUARE * SQUARE or size > 0.999:
        return 0.0
    gx = 0.5 * (channels[0, y, x + 1] - channels[0, y, x - 1])
    gy = 0.5 * (channels[0, y + 1, x] - channels[0, y - 1, x])
    return -(gx * nx + gy * ny) / np.sqrt(size) * np.sqrt(1.0 - size) / pixel[y, x]


@kernel
def _zeros(y0, y1, channels, links, pixel, least, crossing, strength):  # type: ignore[no-untyped-def]
    """Between two pixels, the place where the radial curvature is zero and rises towards the viewer."""
    h, w = crossing.shape[:2]
    for y in range(y0, y1):
        for x in range(w):
            a = channels[0, y, x]
            for side in range(2):
                x2 = x + 1 - side
                y2 = y + side
                if x2 >= w or y2 >= h or links[side, y, x] < 0.05:
                    continue
                b = channels[0, y2, x2]
                if (a < 0.0) == (b < 0.0):
                    continue
                rise = min(_rise(channels, links, pixel, y, x), _rise(channels, links, pixel, y2, x2))
                if rise >= least:
                    crossing[y, x, side] = a / (a - b)
                    strength[y, x, side] = rise


def suggestive_contours(gb: GBuffer, *, sigma: float, least: float) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Lines where the radial curvature is zero and rises towards the viewer: contours of views nearby.

    sigma  pixels over which curvature and normals are averaged first, each surface for itself
    least  derivative of the radial curvature in 1/mm2 below which there is no line
    Returns points (n, 2) in pixels, strength (n,) in 1/mm2, and offsets of the lines.
    """
    h, w = gb.depth.shape
    frame = gb.camera.view_from_world.astype(np.float32)
    channels = np.empty((3, h, w), dtype=np.float32)
    channels[0] = gb.view_curvature
    channels[1], channels[2] = gb.normal @ frame[0], -(gb.normal @ frame[1])
    links = connections(gb)
    smooth(channels, links, sigma)
    crossing, strength = (np.full((h, w, 2), np.nan, dtype=np.float32) for _ in range(2))
    strips(_zeros, h, channels, links, gb.pixel_mm, np.float32(least), crossing, strength, size=32)
    order, offsets = chains(crossing, gb.depth)
    along = strength.reshape(-1)[order]
    return places(order, crossing), along, offsets
