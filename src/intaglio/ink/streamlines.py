"""Evenly spaced streamlines of a field of lines."""

# B. Jobard, W. Lefer, "Creating evenly-spaced streamlines of arbitrary density", 1997.

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import kernel, strips
from intaglio.errors import InputError
from intaglio.ink.neighbours import NOWHERE, PLACES, far, forget, reserve, show
from intaglio.ink.tracing import OPEN, direction, grow, keep, ways_of

# How near to others a line may begin that fills a gap, as a part of the separation.
NARROW = 0.65
# How long such a line must be at least, in separations.
LONGER = 6.0


@dataclass(frozen=True, eq=False)
class Streamlines:
    """Polylines in pixels: line i is points[offsets[i]:offsets[i + 1]]; points (n, 2) float32, x right, y down.

    number (m,) tells which line it is in a series of pictures: those that are kept from one to the next keep theirs.
    """

    points: NDArray[np.float32]
    offsets: NDArray[np.int64]
    number: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.offsets) - 1


@kernel
def _place(  # type: ignore[no-untyped-def]
    field, ways, separation, test, step, shortest, old, held, held_offsets, inverse, count, cells,
    px, py, arc, place, offsets, owner, origin,
):  # fmt: skip
    """Fill px, py with parts of lines; returns (points, parts, lines), or -1 when the arrays, -2 when a cell is too small.

    Part k is offsets[k]:offsets[k + 1] and belongs to line owner[k], which continues line origin[owner[k]] of `held`, or -1.
    """
    h, w = ways.shape
    lag = int(3.0 * separation / step + 2.0)
    for p in range(len(old)):
        # A full cell keeps lines away as it is; points outside the picture keep nothing away.
        if 0.0 <= old[p, 0] < w and 0.0 <= old[p, 1] < h:
            k = reserve(old[p, 0], old[p, 1], inverse, count)
            if k >= 0:
                show(old[p, 0], old[p, 1], inverse, cells, k)
    longer = max(shortest, int(LONGER * separation / step))
    n, lines = keep(
        field, ways, separation * test, longer, lag, inverse, count, cells, held, held_offsets,
        px, py, arc, place, offsets, owner, origin,
    )  # fmt: skip
    if n < 0:
        return n, 0, 0
    parts = lines
    # Only when all are there do their ends grow.
    for line in range(lines):
        begin = offsets[line]
        end = offsets[line + 1] - 1
        for way in (1, -1):
            a = end if way == 1 else begin
            dx, dy = direction(field, px[a], py[a], px[a] - px[a - way], py[a] - py[a - way])
            last = n
            n = grow(
                field, ways, separation * test, step, lag, inverse, count, cells, way, dx, dy, a, -way, end - begin,
                n, px, py, arc, place,
            )  # fmt: skip
            if n < 0:
                return n, 0, 0
            if n > last:
                if parts + 2 >= len(offsets):
                    return -1, 0, 0
                owner[parts] = line
                parts += 1
                offsets[parts] = n
    queue = 0
    candidate = 0
    spread = max(1.0, 0.75 * separation)
    across = int(math.ceil(w / spread))
    down = int(math.ceil(h / spread))
    stride = max(1, int(separation / step))
    point = 0
    side = 0
    # Lines are to begin a separation from others, but for rounding. What then is left free takes some that are nearer to
    # them, the widest gaps first, so that lines run in the middle of gaps.
    wide = 0.98 * separation
    narrow = min(max(test, NARROW) * separation, wide)
    room = wide
    closed = np.zeros(across * down, dtype=np.bool_)
    while True:
        # The next place to begin: beside the lines there are, in their order; then any gap that is left.
        if queue < parts:
            if point >= offsets[queue + 1]:
                queue += 1
                if queue < parts:
                    point = offsets[queue]
                continue
            dx, dy = direction(field, px[point], py[point], 1.0, 0.0)
            away = separation if side == 0 else -separation
            sx = px[point] - away * dy
            sy = py[point] + away * dx
            if side == 1:
                point += stride
            side = 1 - side
        else:
            if candidate >= across * down:
                if room <= narrow:
                    break
                room = max(room - 0.1 * separation, narrow)
                candidate = 0
            if closed[candidate]:
                candidate += 1
                continue
            sx = (candidate % across + 0.5) * spread
            sy = (candidate // across + 0.5) * spread
            candidate += 1
        if not (0.0 <= sx < w and 0.0 <= sy < h) or ways[int(sy), int(sx)] & OPEN == 0:
            continue
        if not far(sx, sy, room, inverse, cells):
            if queue == parts and room == wide and not far(sx, sy, narrow, inverse, cells):
                closed[candidate - 1] = True
            continue
        # Others only come nearer: what fails here fails later too.
        if queue == parts:
            closed[candidate - 1] = True
        fx, fy = direction(field, sx, sy, 1.0, 0.0)
        if fx == 0.0 and fy == 0.0:
            continue

        # What fills gaps stays out of narrower ones, and is more than a dash.
        stop = separation * test if room == wide else narrow
        first = n
        if n >= len(px):
            return -1, 0, 0
        k = reserve(sx, sy, inverse, count)
        if k < 0:
            return -2, 0, 0
        px[n] = sx
        py[n] = sy
        arc[n] = 0
        place[n] = k
        n += 1
        for way in (1, -1):
            # The second way, what the first one left lies behind.
            n = grow(
                field, ways, stop, step, lag, inverse, count, cells, way, way * fx, way * fy, first, 1, n - first - 1,
                n, px, py, arc, place,
            )  # fmt: skip
            if n < 0:
                return n, 0, 0
        if n - first < (shortest if room == wide else longer):
            forget(first, n, inverse, count, cells, px, py, place)
            n = first
            continue
        if parts + 2 >= len(offsets):
            return -1, 0, 0
        owner[parts] = lines
        origin[lines] = -1
        lines += 1
        parts += 1
        offsets[parts] = n
    return n, parts, lines


@kernel
def _in_order(parts, owner, px, py, arc, out, lines):  # type: ignore[no-untyped-def]
    """Lines grew both ways; put their points one after the other in the order of arc. `lines` becomes their offsets."""
    low = np.zeros(len(lines), dtype=np.int64)
    for k in range(len(parts) - 1):
        i = owner[k]
        lines[i + 1] += parts[k + 1] - parts[k]
        for p in range(parts[k], parts[k + 1]):
            low[i] = min(low[i], arc[p])
    for i in range(1, len(lines)):
        lines[i] += lines[i - 1]
    for k in range(len(parts) - 1):
        i = owner[k]
        for p in range(parts[k], parts[k + 1]):
            q = lines[i] + arc[p] - low[i]
            out[q, 0] = px[p]
            out[q, 1] = py[p]


def streamlines(
    field: NDArray[np.float32],
    separation: float,
    *,
    allowed: NDArray[np.bool_] | None = None,
    edge: NDArray[np.float32] | None = None,
    test: float = 0.6,
    step: float = 1.0,
    shortest: float | None = None,
    beside: NDArray[np.float32] | None = None,
    kept: Streamlines | None = None,
) -> Streamlines:
    """Lines along a field, `separation` pixels apart.

    field     (2, h, w) float32, cosine and sine of twice the angle; (0, 0) ends a line
    allowed   (h, w) where lines may run
    edge      (h, w, 2) the G-buffer's edges, which no line crosses
    test      a line ends when it comes closer than test * separation to another
    step      pixels between points; midpoint rule
    shortest  length in pixels below which a line is dropped; default the separation
    beside    (n, 2) points of earlier lines to keep away from: how a denser set is nested in a sparser one
    kept      lines to begin with, points about a step apart: they stay as far as there is room and they follow the field
    """
    if field.ndim != 3 or field.shape[0] != 2:
        raise InputError(f"field must be (2, height, width), not {field.shape}")
    if not separation >= 1.0:
        raise InputError(f"separation must be at least 1 pixel, not {separation!r}: use a larger image or a wider separation")
    if not 0.1 <= test <= 1.0:
        raise InputError(f"test must be between 0.1 and 1, not {test!r}")
    if not 0.05 <= step <= 1.0:
        raise InputError(f"step must be between 0.05 and 1 pixel, not {step!r}")
    if shortest is not None and not shortest >= 0.0:
        raise InputError(f"shortest must not be negative, not {shortest!r}")
    h, w = field.shape[1:]
    step = min(step, 0.7 * test * separation)
    allowed = np.ones((h, w), dtype=bool) if allowed is None else allowed
    ways = allowed.view(np.uint8)
    if edge is not None:
        ways = np.empty((h, w), dtype=np.uint8)
        strips(ways_of, h, allowed.view(np.uint8), edge, ways, size=64)
    old = np.zeros((0, 2), dtype=np.float32) if beside is None else beside
    none = np.zeros(0, dtype=np.int64)
    held = Streamlines(np.zeros((0, 2), dtype=np.float32), np.zeros(1, dtype=np.int64), none) if kept is None else kept
    shortest = separation if shortest is None else shortest
    least = max(2, int(shortest / step) + 1)
    capacity = 1024 + int(1.6 * int(allowed.sum()) / (separation * step))
    size = min(1.4 * separation, 12.0 * step)
    while True:
        px, py, arc, place = (np.empty(capacity, dtype=t) for t in (np.float32, np.float32, np.int32, np.int8))
        offsets, owner, origin = (np.zeros(capacity // 2 + 4, dtype=np.int64) for _ in range(3))
        count = np.zeros((int(h / size) + 1, int(w / size) + 1), dtype=np.int32)
        cells = np.full((*count.shape, 2, PLACES), NOWHERE)
        n, parts, lines = _place(
            field, ways, float(separation), float(test), float(step), least, old,
            held.points, held.offsets, 1.0 / size, count, cells, px, py, arc, place, offsets, owner, origin,
        )  # fmt: skip
        if n >= 0:
            break
        capacity, size = (2 * capacity, size) if n == -1 else (capacity, 0.7 * size)
    points = np.empty((n, 2), dtype=np.float32)
    ends = np.zeros(lines + 1, dtype=np.int64)
    _in_order(offsets[: parts + 1], owner, px, py, arc, points, ends)
    origin = origin[:lines]
    number = np.empty(lines, dtype=np.int64)
    new = origin < 0
    number[~new] = held.number[origin[~new]]
    # The lowest that are free, so that what goes by number does not grow with the series.
    number[new] = np.setdiff1d(np.arange(lines), number[~new])[: new.sum()]
    return Streamlines(points, ends, number)
