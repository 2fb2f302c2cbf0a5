"""Feature lines inside a surface: valleys and ridges, where it bends most."""

# Y. Ohtake, A. Belyaev, H.-P. Seidel, "Ridge-valley lines on meshes via implicit surface fitting", 2004: here in the
# image, from the G-buffer's curvatures.

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import helper, kernel, strips
from intaglio.gbuffer import GBuffer
from intaglio.ink.contours import chains, places
from intaglio.ink.smoothing import connections, smooth

Floats = NDArray[np.float32]

# Cosine of the angle between neighbouring pixels' normals from which on there is an edge.
CREASE = 0.75
# A line bends more by this part than what is beside it; a ball or a rod bends everywhere alike and has none.
CONTRAST = 0.02


@kernel
def _bend(y0, y1, normal, curvature, direction, depth, frame, sign, channels):  # type: ignore[no-untyped-def]
    """channels = strength of the bend, and the double angle of the direction across it times that strength."""
    h, w = depth.shape
    for y in range(y0, y1):
        for x in range(w):
            if depth[y, x] == np.inf:
                continue
            k = curvature[y, x, 0] if sign > 0.0 else -curvature[y, x, 1]
            if k <= 0.0:
                continue
            ex, ey, ez = direction[y, x, 0], direction[y, x, 1], direction[y, x, 2]
            if sign < 0.0:
                nx, ny, nz = normal[y, x, 0], normal[y, x, 1], normal[y, x, 2]
                ex, ey, ez = ny * ez - nz * ey, nz * ex - nx * ez, nx * ey - ny * ex
            ix = frame[0, 0] * ex + frame[0, 1] * ey + frame[0, 2] * ez
            iy = -(frame[1, 0] * ex + frame[1, 1] * ey + frame[1, 2] * ez)
            size = ix * ix + iy * iy
            channels[0, y, x] = k
            if size > 1e-9:
                channels[1, y, x] = k * (ix * ix - iy * iy) / size
                channels[2, y, x] = k * 2.0 * ix * iy / size


@helper
def _across(channels, y, x):  # type: ignore[no-untyped-def]
    """Unit image direction across the bend at a pixel."""
    c = channels[1, y, x]
    s = channels[2, y, x]
    angle = 0.5 * np.arctan2(s, c)
    return np.cos(angle), np.sin(angle)


@helper
def _slope(k, y, x, dx, dy):  # type: ignore[no-untyped-def]
    h, w = k.shape
    gx = k[y, min(x + 1, w - 1)] - k[y, max(x - 1, 0)]
    gy = k[min(y + 1, h - 1), x] - k[max(y - 1, 0), x]
    return 0.5 * (gx * dx + gy * dy)


@helper
def _at(k, y, x):  # type: ignore[no-untyped-def]
    h, w = k.shape
    i = min(max(int(x), 0), w - 2)
    j = min(max(int(y), 0), h - 2)
    u = min(max(x - i, 0.0), 1.0)
    v = min(max(y - j, 0.0), 1.0)
    return (k[j, i] * (1 - u) + k[j, i + 1] * u) * (1 - v) + (k[j + 1, i] * (1 - u) + k[j + 1, i + 1] * u) * v


@kernel
def _creases(y0, y1, normal, depth, edge, frame, cosine, crossing):  # type: ignore[no-untyped-def]
    """Halfway between two pixels, where the normal turns by more than an angle and outwards."""
    h, w = depth.shape
    for y in range(y0, y1):
        for x in range(w):
            for side in range(2):
                x2 = x + 1 - side
                y2 = y + side
                if x2 >= w or y2 >= h or edge[y, x, side] >= 0.0 or depth[y, x] == np.inf or depth[y2, x2] == np.inf:
                    continue
                turn = 0.0
                opening = 0.0
                for c in range(3):
                    turn += normal[y, x, c] * normal[y2, x2, c]
                    step = frame[0, c] if side == 0 else -frame[1, c]
                    opening += (normal[y2, x2, c] - normal[y, x, c]) * step
                if turn < cosine and opening > 0.0:
                    crossing[y, x, side] = 0.5


@helper
def _inner(links, y, x):  # type: ignore[no-untyped-def]
    """Neither a contour nor the border of the picture beside the pixel."""
    if x == 0 or y == 0:
        return False
    return min(min(links[0, y, x], links[1, y, x]), min(links[0, y, x - 1], links[1, y - 1, x])) > 0.05


@kernel
def _crests(y0, y1, channels, links, least, reach, crossing):  # type: ignore[no-untyped-def]
    """Between two pixels, the place where the strength is greatest across the bend."""
    h, w = channels.shape[1:]
    k = channels[0]
    for y in range(y0, y1):
        for x in range(w):
            if k[y, x] < least:
                continue
            dx, dy = _across(channels, y, x)
            a = _slope(k, y, x, dx, dy)
            for side in range(2):
                x2 = x + 1 - side
                y2 = y + side
                if x2 >= w or y2 >= h or k[y2, x2] < least or not (_inner(links, y, x) and _inner(links, y2, x2)):
                    continue
                ex, ey = _across(channels, y2, x2)
                if dx * ex + dy * ey < 0.0:
                    ex = -ex
                    ey = -ey
                b = _slope(k, y2, x2, ex, ey)
                if a * b >= 0.0:
                    continue
                part = a / (a - b)
                px = x + part * (1 - side)
                py = y + part * side
                here = (1.0 - CONTRAST) * _at(k, py, px)
                if here > _at(k, py + reach * dy, px + reach * dx) and here > _at(k, py - reach * dy, px - reach * dx):
                    crossing[y, x, side] = part


def feature_lines(
    gb: GBuffer, kind: Literal["valley", "ridge"], *, sigma: float, least: float
) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Lines along which the surface bends most, inwards (valley) or outwards (ridge).

    sigma  pixels over which curvature is averaged first, each surface for itself
    least  curvature in 1/mm below which there is no line
    Returns points (n, 2) in pixels, strength (n,) in 1/mm, and offsets of the lines.
    """
    h, w = gb.depth.shape
    sign = 1.0 if kind == "ridge" else -1.0
    channels = np.zeros((3, h, w), dtype=np.float32)
    frame = gb.camera.view_from_world
    strips(_bend, h, gb.normal, gb.curvature, gb.direction, gb.depth, frame, sign, channels, size=32)
    links = connections(gb)
    smooth(channels, links, sigma)
    crossing = np.full((h, w, 2), np.nan, dtype=np.float32)
    strips(_crests, h, channels, links, np.float32(least), max(1.5, sigma), crossing, size=32)
    if kind == "ridge":
        # Where a scan's face cuts through the body, the surface has an edge but no curvature.
        strips(_creases, h, gb.normal, gb.depth, gb.border, frame, CREASE, crossing, size=32)
    order, offsets = chains(crossing, gb.depth)
    side = order % 2
    y, x = np.divmod(order // 2, w)
    strength = np.maximum(channels[0][y, x], channels[0][y + side, x + 1 - side])
    if kind == "ridge":
        turn = np.einsum("nc,nc->n", gb.normal[y, x], gb.normal[y + side, x + 1 - side])
        strength = np.where(turn < CREASE, np.maximum(strength, 4.0 * least), strength)
    return places(order, crossing), strength, offsets
