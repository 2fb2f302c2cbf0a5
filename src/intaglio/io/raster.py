"""A drawing as pixels: antialiased strokes of varying width and opacity, and brushed ones.

Coverage is blended in display values (sRGB as it is), as SVG and PDF viewers do, so that the three outputs agree:
black ink over 30 % of an area darkens its mean display value by 30 %.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from intaglio.brush import Brush, brush_named
from intaglio.compute import helper, kernel, tiles
from intaglio.drawing import Dots, Drawing, Image, Layer, Strokes
from intaglio.errors import InputError
from intaglio.io.simplify import dot_nodes, simplified, stroke_nodes
from intaglio.io.stamping import catch, stamp, stamps
from intaglio.io.tips import PAPER_TEXEL, paper_heights, tips

if TYPE_CHECKING:
    from intaglio.compute import Progress

TILE = 64
LARGEST = 400_000_000  # pixels
TOLERANCE = 0.04  # pixels

Coat = Callable[[int, int, NDArray[np.float32]], None]  # paints a tile whose upper left corner is (x0, y0)


def rasterize_drawing(drawing: Drawing, dpi: float, *, progress: Progress | None = None) -> Image:
    """The plate at round(mm / 25.4 * dpi) pixels a side; equal pixels whatever the thread count.

    InputError for a resolution outside 10..2400 dpi, or one that gives more than 400 million pixels.
    """
    canvas = np.ones((*pixel_size(drawing, dpi)[::-1], 4), dtype=np.float32)
    _paint_all(drawing, dpi, canvas[:, :, :3], progress)
    return Image(canvas, dpi)


def drawing_bytes8(drawing: Drawing, dpi: float, *, progress: Progress | None = None) -> NDArray[np.uint8]:
    """The same pixels as (height, width, 3) uint8, in a fifth of the memory."""
    canvas = np.empty((*pixel_size(drawing, dpi)[::-1], 3), dtype=np.uint8)
    _paint_all(drawing, dpi, canvas, progress)
    return canvas


def pixel_size(drawing: Drawing, dpi: float) -> tuple[int, int]:
    """(width, height) of the plate's picture."""
    return pixels_of(drawing.width_mm, drawing.height_mm, dpi)


def pixels_of(width_mm: float, height_mm: float, dpi: float) -> tuple[int, int]:
    """(width, height) in pixels of paper of this size. InputError for more than 400 million, and for a dpi outside 10..2400."""
    if not 10 <= dpi <= 2400:
        raise InputError(f"dpi must be between 10 and 2400, not {dpi!r}")
    width, height = (max(1, round(mm / 25.4 * dpi)) for mm in (width_mm, height_mm))
    if width * height > LARGEST:
        fits = math.floor(dpi * math.sqrt(LARGEST / (width * height)))
        raise InputError(
            f"dpi must be at most {fits} for a plate of {width_mm:g} x {height_mm:g} mm, not {dpi:g}"
            f" ({width} x {height} pixels); write .svg or .pdf instead"
        )
    return width, height


def _paint_all(drawing: Drawing, dpi: float, canvas: NDArray[Any], progress: Progress | None) -> None:
    size, scale = canvas.shape[:2], dpi / 25.4
    coats = [
        _pen(layers, scale, size) if brush is None else _brushed(layers, brush, drawing.grain, scale, size)
        for brush, layers in _runs(drawing.layers)
    ]
    paper = _rgb(drawing.paper)

    def paint(y0: int, y1: int, x0: int, x1: int) -> None:
        tile = np.empty((y1 - y0, x1 - x0, 3), dtype=np.float32)
        tile[:] = paper
        for coat in coats:
            coat(x0, y0, tile)
        canvas[y0:y1, x0:x1] = tile if canvas.dtype == np.float32 else tile * 255 + 0.5

    tiles(paint, size, tile=TILE, progress=progress)


def _runs(layers: Sequence[Layer]) -> list[tuple[Brush | None, list[Layer]]]:
    """Neighbouring layers that are painted at once: by the pen, or by one brush in one colour. Dots are the pen's."""
    parts: list[tuple[Brush | None, Layer]] = []
    for layer in layers:
        brush = brush_named(layer.brush)
        if brush is None:
            parts.append((None, layer))
            continue
        parts.append((brush, replace(layer, dots=Dots.none())))
        if len(layer.dots):
            parts.append((None, replace(layer, strokes=Strokes.none())))
    groups = groupby(parts, key=lambda part: (part[0], part[1].colour if part[0] else ""))
    return [(brush, [layer for _, layer in group]) for (brush, _), group in groups]


def _pen(layers: list[Layer], scale: float, size: tuple[int, int]) -> Coat:
    nodes, ends, colours, first = _packed(layers, scale)
    entries_of = _bins_of(nodes, ends, size)

    def coat(x0: int, y0: int, tile: NDArray[np.float32]) -> None:
        entries = entries_of(x0, y0)
        if len(entries):
            _paint(nodes, ends, first, colours, entries, x0, y0, tile)

    return coat


def _brushed(layers: list[Layer], brush: Brush, grain: float, scale: float, size: tuple[int, int]) -> Coat:
    """Strokes of one brush and colour. Their pigment is summed before it catches on paper, so order does not matter."""
    strokes = [simplified(stroke_nodes(layer), layer.strokes.offsets, TOLERANCE / scale) for layer in layers]
    nodes = np.concatenate([n for n, _ in strokes])
    nodes[:, :3] *= scale
    begin = np.cumsum([0] + [len(n) for n, _ in strokes])
    offsets = np.concatenate([[0]] + [o[1:] + b for (_, o), b in zip(strokes, begin, strict=False)]).astype(np.int64)
    stamped, count = stamps(nodes, offsets, brush)
    ends = np.zeros(len(nodes), dtype=np.bool_)
    ends[offsets[1:] - 1] = True
    number = np.repeat(np.arange(len(offsets) - 1, dtype=np.int32), np.diff(offsets))
    entries_of = _bins_of(stamped, ends, size)
    texture, heights, colour = tips(brush).texture, paper_heights(), _rgb(layers[0].colour)
    # Bumps are never finer than pixels.
    texel = min(1.0 / (scale * PAPER_TEXEL), 2.6)

    def coat(x0: int, y0: int, tile: NDArray[np.float32]) -> None:
        entries = entries_of(x0, y0)
        if len(entries):
            load = np.zeros(tile.shape[:2], dtype=np.float32)
            stamp(
                stamped, count, number, entries, texture, not brush.image, np.float32(brush.jitter), brush.turning, x0, y0, load
            )
            catch(load, heights, texel, np.float32(grain * brush.grain), x0, y0, colour, tile)

    return coat


def _bins_of(
    nodes: NDArray[np.float32], ends: NDArray[np.bool_], size: tuple[int, int]
) -> Callable[[int, int], NDArray[np.int32]]:
    """What begins at nodes x, y, reach, ... and reaches a tile, by the tile's upper left corner."""
    tile = TILE
    starts, entries = _bins(np.ascontiguousarray(nodes[:, :4]), ends, size[1], size[0], tile)
    across = -(-size[1] // tile)

    def entries_of(x0: int, y0: int) -> NDArray[np.int32]:
        t = y0 // tile * across + x0 // tile
        return entries[starts[t] : starts[t + 1]]

    return entries_of


def _rgb(colour: str) -> NDArray[np.float32]:
    return np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)], dtype=np.float32)


def _packed(
    layers: list[Layer], scale: float
) -> tuple[NDArray[np.float32], NDArray[np.bool_], NDArray[np.float32], NDArray[np.int64]]:
    """All that is drawn, in order, as chains of discs; a dot is a chain of one.

    nodes (n, 4)   x, y, radius in pixels, opacity
    ends (n,)      whether a chain ends here
    colours (l, 3)  of the layers;  first (l,) node of each layer
    """
    parts, ends, first = [np.zeros((0, 4))], [np.zeros(0, dtype=np.bool_)], []
    total = 0
    for layer in layers:
        strokes, offsets = simplified(stroke_nodes(layer), layer.strokes.offsets, TOLERANCE / scale)
        dots = dot_nodes(layer)
        strokes[:, :3] *= scale
        dots[:, :3] *= scale
        # A disc with an edge one pixel soft has the area pi (r^2 + 1/12).
        square = dots[:, 2] ** 2
        dots[:, 3] *= np.minimum(3 * square, 1.0)
        dots[:, 2] = np.sqrt(np.maximum(square - 1 / 12, 0.25))
        first.append(total)
        parts += [strokes, dots]
        last = np.zeros(len(strokes), dtype=np.bool_)
        last[offsets[1:] - 1] = True
        ends += [last, np.ones(len(dots), dtype=np.bool_)]
        total += len(strokes) + len(dots)
    colours = np.stack([_rgb(layer.colour) for layer in layers])
    nodes = np.concatenate(parts).astype(np.float32)
    return nodes, np.concatenate(ends), colours, np.array(first, dtype=np.int64)


@kernel
def _bins(nodes, ends, width, height, tile):  # type: ignore[no-untyped-def]
    """For each tile of the image the nodes at which something begins that reaches it, in order (compressed rows)."""
    across, down = -(-width // tile), -(-height // tile)
    starts = np.zeros(across * down + 1, np.int64)
    fill = np.zeros(across * down, np.int64)
    entries = np.empty(0, np.int32)
    for sweep in range(2):
        if sweep == 1:
            for t in range(across * down):
                starts[t + 1] += starts[t]
                fill[t] = starts[t]
            entries = np.empty(starts[-1], np.int32)
        for i in range(len(nodes)):
            j = i if ends[i] else i + 1
            if ends[i] and i > 0 and not ends[i - 1]:
                continue
            ax, ay, bx, by = nodes[i, 0], nodes[i, 1], nodes[j, 0], nodes[j, 1]
            reach = max(nodes[i, 2], nodes[j, 2]) + np.float32(0.71)
            top, bottom = min(ay, by) - reach, max(ay, by) + reach
            if top >= height or bottom < 0 or min(ax, bx) - reach >= width or max(ax, bx) + reach < 0:
                continue
            for ty in range(max(int(top) // tile, 0), min(int(bottom) // tile, down - 1) + 1):
                # Only the part of the segment whose ends come near this row of tiles.
                t0, t1 = np.float32(0.0), np.float32(1.0)
                if abs(by - ay) > np.float32(1e-3):
                    u, v = (ty * tile - reach - ay) / (by - ay), ((ty + 1) * tile + reach - ay) / (by - ay)
                    t0, t1 = min(max(min(u, v), t0), t1), max(min(max(u, v), t1), t0)
                x0, x1 = ax + t0 * (bx - ax), ax + t1 * (bx - ax)
                low, high = min(x0, x1) - reach, max(x0, x1) + reach
                if low >= width or high < 0:
                    continue
                for tx in range(max(int(low) // tile, 0), min(int(high) // tile, across - 1) + 1):
                    t = ty * across + tx
                    if sweep == 0:
                        starts[t + 1] += 1
                    else:
                        entries[fill[t]] = i
                        fill[t] += 1
    return starts, entries


@helper
def _covered(u, a, b, slope, bend):  # type: ignore[no-untyped-def]
    """C(u) - 1/2."""
    v = abs(u)
    if v <= b:
        return u * slope
    rest = max(a - v, np.float32(0.0))
    part = np.float32(0.5) - rest * rest * bend
    return part if u > np.float32(0.0) else -part


@kernel
def _paint(nodes, ends, first, colours, entries, x0, y0, canvas):  # type: ignore[no-untyped-def]
    """Lay the chains over a tile, one after the other.

    Within a chain the largest opacity counts, so that its joints are no darker than the rest:
    ink = max over segments of opacity(t) (C(r(t) - d) - C(-r(t) - d)), t and d the nearest point's place and distance,
    C(u) the part of a pixel's area that lies within u of its centre across the segment: the exact area of a straight
    edge, so that lines of any slant neither bead nor change their tone, and fade as they get thinner than a pixel.
    """
    zero, half, one = np.float32(0.0), np.float32(0.5), np.float32(1.0)
    height, width = canvas.shape[0], canvas.shape[1]
    ink = np.zeros(height * width, np.float32)
    touched = np.empty(height * width, np.int32)
    flat = canvas.reshape(height * width, 3)
    count = 0
    layer = 0
    left, top = np.float32(x0), np.float32(y0)
    for e in range(len(entries)):
        i = entries[e]
        j = i if ends[i] else i + 1
        while layer + 1 < len(first) and first[layer + 1] <= i:
            layer += 1
        ax, ay, ar, ao = nodes[i, 0] - left, nodes[i, 1] - top, nodes[i, 2], nodes[i, 3]
        dx, dy = nodes[j, 0] - left - ax, nodes[j, 1] - top - ay
        dr, do = nodes[j, 2] - ar, nodes[j, 3] - ao
        square = dx * dx + dy * dy
        inverse = one / square if square > np.float32(1e-12) else zero
        # A pixel's square seen along the segment: a trapezoid, 2a wide at its foot and 2b on top.
        wide, narrow = one, zero
        if inverse > zero:
            scale = math.sqrt(inverse)
            wide, narrow = max(abs(dx), abs(dy)) * scale, min(abs(dx), abs(dy)) * scale
        a, b = half * (wide + narrow), half * (wide - narrow)
        slope, bend = one / wide, half / max(wide * narrow, np.float32(1e-6))
        reach = max(ar, ar + dr) + a
        low = max(int(math.floor(min(ay, ay + dy) - reach)), 0)
        high = min(int(math.ceil(max(ay, ay + dy) + reach)), height)
        for py in range(low, high):
            y = np.float32(py) + half - ay
            t0, t1 = zero, one
            if abs(dy) > np.float32(1e-3):
                u, v = (y - reach) / dy, (y + reach) / dy
                t0, t1 = min(max(min(u, v), zero), one), max(min(max(u, v), one), zero)
            u, v = ax + t0 * dx, ax + t1 * dx
            begin = max(int(math.floor(min(u, v) - reach)), 0)
            end = min(int(math.ceil(max(u, v) + reach)), width)
            for px in range(begin, end):
                x = np.float32(px) + half - ax
                t = min(max((x * dx + y * dy) * inverse, zero), one)
                ex, ey = x - t * dx, y - t * dy
                r, d = ar + t * dr, math.sqrt(ex * ex + ey * ey)
                value = (_covered(r - d, a, b, slope, bend) + _covered(r + d, a, b, slope, bend)) * (ao + t * do)
                if value > zero:
                    k = py * width + px
                    old = ink[k]
                    if value > old:
                        ink[k] = value
                        if old == zero:
                            touched[count] = k
                            count += 1
        # The chain is over in this tile when the next entry lies beyond its end.
        over = e + 1 == len(entries)
        if not over:
            k = i
            following = entries[e + 1]
            while k < following and not ends[k]:
                k += 1
            over = k < following
        if over:
            for c in range(count):
                k = touched[c]
                opacity = ink[k]
                ink[k] = zero
                for channel in range(3):
                    flat[k, channel] += opacity * (colours[layer, channel] - flat[k, channel])
            count = 0
