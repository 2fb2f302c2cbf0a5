"""What of a surface's strokes is seen: hidden lines removed, and halos left free beside lines that pass in front."""

# A. Appel, F. J. Rohlf, A. J. Stein, "The haloed line effect for hidden line elimination", 1979.

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import kernel, strips
from intaglio.drawing import Dots, Layer, Strokes
from intaglio.gbuffer import GBuffer
from intaglio.ink.strokes import arc_length, pack, runs, sample

Floats = NDArray[np.float32]
# (h, w) pixels from a place to where a surface's strokes have to end, negative where they are not seen.
Clearance = NDArray[np.float32]

# Surfaces nearer to one another than this many pixels' sides are at one depth.
TIE = 1.0

_nearest: WeakKeyDictionary[GBuffer, Floats] = WeakKeyDictionary()


@kernel
def _hide(y0, y1, behind, front, edge, tie, clearance):  # type: ignore[no-untyped-def]
    """clearance = min of it and the distance in pixels, at most 1, to where `front` begins to hide, negative where it does.

    The border lies at the front's contours, where its depth jumps, or where the two depths cross.
    """
    h, w = front.shape
    for y in range(y0, y1):
        for x in range(w):
            hidden = front[y, x] < behind[y, x] - tie
            nearest = np.float32(1.0)
            for k in range(4):
                side = k >> 1
                step = 2 * (k & 1) - 1
                x2 = x + step * (1 - side)
                y2 = y + step * side
                if x2 < 0 or y2 < 0 or x2 >= w or y2 >= h or (front[y2, x2] < behind[y2, x2] - tie) == hidden:
                    continue
                part = edge[min(y, y2), min(x, x2), side]
                if part >= 0.0:
                    part = part if step > 0 else 1.0 - part
                else:
                    a = behind[y, x] - tie - front[y, x]
                    b = behind[y2, x2] - tie - front[y2, x2]
                    part = abs(a) / (abs(a) + abs(b)) if abs(a) + abs(b) < np.inf else 0.5
                nearest = min(nearest, np.float32(part))
            clearance[y, x] = min(clearance[y, x], -nearest if hidden else nearest)


@kernel
def _halo(points, offsets, depths, radii, behind, tie, clearance):  # type: ignore[no-untyped-def]
    """clearance = min of it and the distance in pixels to where the halo of a line ends, negative within, if behind it."""
    h, w = behind.shape
    for line in range(len(offsets) - 1):
        for i in range(offsets[line], offsets[line + 1] - 1):
            ax, ay = points[i, 0], points[i, 1]
            dx, dy = points[i + 1, 0] - ax, points[i + 1, 1] - ay
            depth = min(depths[i], depths[i + 1]) + tie
            # Beneath the line, and not only beside it: seen at a grazing angle, depth changes much from pixel to pixel.
            if depth >= behind[min(max(int(ay), 0), h - 1), min(max(int(ax), 0), w - 1)]:
                continue
            radius = max(radii[i], radii[i + 1])
            # Two pixels more, so that what is interpolated across the border is right.
            reach = radius + 2.0
            length = max(dx * dx + dy * dy, np.float32(1e-12))
            for y in range(max(0, int(min(ay, ay + dy) - reach)), min(h, int(max(ay, ay + dy) + reach) + 1)):
                for x in range(max(0, int(min(ax, ax + dx) - reach)), min(w, int(max(ax, ax + dx) + reach) + 1)):
                    if depth < behind[y, x]:
                        px, py = x + 0.5 - ax, y + 0.5 - ay
                        t = min(max((px * dx + py * dy) / length, 0.0), 1.0)
                        px, py = px - t * dx, py - t * dy
                        clearance[y, x] = min(clearance[y, x], np.float32(np.sqrt(px * px + py * py) - radius))


def _near(gb: GBuffer) -> Floats:
    """Depth as a contour has it, which lies between two pixels: the nearest of 3 x 3; beyond the outline it goes on a little."""
    from scipy import ndimage

    if gb not in _nearest:
        near = ndimage.minimum_filter(gb.depth, 3, mode="nearest")
        _nearest[gb] = np.where(np.isinf(near), ndimage.minimum_filter(near, 5, mode="nearest"), near)
    return _nearest[gb]


def clearance(gb: GBuffer) -> Clearance:
    """Of a surface with nothing before it: infinite."""
    return np.full(gb.depth.shape, np.inf, dtype=np.float32)


def unhidden(gb: GBuffer, fronts: Sequence[GBuffer]) -> GBuffer:
    """The same surface, but its contours only where the side that makes them is not behind one of the opaque `fronts`.

    So a contour in sight is one line, and does not turn into another one that goes on behind.
    """
    hidden = np.zeros(gb.depth.shape, dtype=bool)
    for front in fronts:
        hidden |= front.depth < gb.depth - TIE * _pixel(gb)
    edge = gb.edge.copy()
    for side, here, there in ((0, np.s_[:, :-1], np.s_[:, 1:]), (1, np.s_[:-1, :], np.s_[1:, :])):
        of_nearer = np.where(gb.depth[here] < gb.depth[there], hidden[here], hidden[there])
        edge[*here, side][of_nearer] = np.nan
    return gb if np.array_equal(edge, gb.edge, equal_nan=True) else replace(gb, edge=edge)


def hide(free: Clearance, gb: GBuffer, front: GBuffer) -> None:
    """Take from `free`, the clearance of a surface, what an opaque one hides by lying before it."""
    strips(_hide, len(free), _near(gb), front.depth, front.edge, TIE * _pixel(gb), free, size=32)


def surround(free: Clearance, gb: GBuffer, front: GBuffer, lines: Strokes, mm_per_pixel: float, gap: float) -> None:
    """Take from `free`, the clearance of a surface, `gap` mm of paper on both sides of another's lines where it lies behind."""
    points = lines.points / np.float32(mm_per_pixel)
    depths = _near(front)[tuple(_pixels(points, free.shape))]
    radii = (0.5 * lines.width + gap) / np.float32(mm_per_pixel)
    _halo(points, lines.offsets, depths, radii.astype(np.float32), _near(gb), TIE * _pixel(gb), free)


def _pixel(gb: GBuffer) -> float:
    return float(gb.pixel_mm[gb.mask].mean()) if gb.mask.any() else 1.0


def _pixels(points: Floats, shape: tuple[int, ...]) -> NDArray[np.int64]:
    """(2, n) row and column of the pixel that each point lies in."""
    inside = np.clip(points[:, ::-1], 0, np.array(shape) - 1)
    return np.asarray(inside.T, dtype=np.int64)


def visible(layer: Layer, free: Clearance, mm_per_pixel: float, shortest: float = 1.0) -> Layer:
    """A layer where the clearance is positive: strokes cut at sub-pixel places, scraps below `shortest` mm gone; dots whole."""
    if np.isinf(free).all():
        return layer
    return replace(layer, strokes=_cut(layer.strokes, free, mm_per_pixel, shortest), dots=_kept(layer.dots, free, mm_per_pixel))


def _kept(dots: Dots, free: Clearance, mm_per_pixel: float) -> Dots:
    seen = sample(np.clip(free, -4.0, 4.0), dots.points / np.float32(mm_per_pixel)) > 0.0
    return Dots(dots.points[seen], dots.diameter[seen], dots.opacity[seen])


def _cut(strokes: Strokes, free: Clearance, mm_per_pixel: float, shortest: float) -> Strokes:
    values = sample(np.clip(free, -4.0, 4.0), strokes.points / np.float32(mm_per_pixel))
    if not (values <= 0.0).any():
        return strokes
    # A point more on every segment that crosses zero, where it does.
    inner = np.ones(len(values), dtype=bool)
    inner[strokes.offsets[1:] - 1] = False
    at = np.flatnonzero(inner & ((values > 0.0) != (np.append(values[1:], 0.0) > 0.0)))
    part = values[at] / (values[at] - values[at + 1])

    def with_crossings(data: Floats) -> Floats:
        t = part.reshape(-1, *[1] * (data.ndim - 1))
        return np.insert(data, at + 1, data[at] + t * (data[at + 1] - data[at]), axis=0)

    points, width, opacity = (with_crossings(a) for a in (strokes.points, strokes.width, strokes.opacity))
    offsets = strokes.offsets + np.searchsorted(at, strokes.offsets)
    index, offsets = runs(np.insert(values > 0.0, at + 1, True), offsets)
    points, width, opacity = points[index], width[index], opacity[index]
    if len(points) == 0:
        return Strokes.none()
    length = arc_length(points, offsets)[offsets[1:] - 1]
    index, offsets = runs(np.repeat(length >= shortest, np.diff(offsets)), offsets)
    return pack(points[index], width[index], opacity[index], offsets)
