"""Evenly spaced streamlines of a field of lines."""

# B. Jobard, W. Lefer, "Creating evenly-spaced streamlines of arbitrary density", 1997.

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import helper, kernel
from intaglio.errors import InputError
from intaglio.ink.neighbours import NOWHERE, PLACES, enter, far, forget

TURN = math.cos(math.radians(40.0))
# Cosine of the angle to the field up to which a kept line follows it.
ALIKE = math.cos(math.radians(25.0))
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


@helper
def _direction(field, x, y, px, py):  # type: ignore[no-untyped-def]
    """Unit direction at (x, y), turned to agree with (px, py); (0, 0) where there is none."""
    h, w = field.shape[1:]
    fx = min(max(x - 0.5, 0.0), w - 1.001)
    fy = min(max(y - 0.5, 0.0), h - 1.001)
    i = int(fx)
    j = int(fy)
    i2 = min(i + 1, w - 1)
    j2 = min(j + 1, h - 1)
    u = fx - i
    v = fy - j
    c = (field[0, j, i] * (1 - u) + field[0, j, i2] * u) * (1 - v) + (field[0, j2, i] * (1 - u) + field[0, j2, i2] * u) * v
    s = (field[1, j, i] * (1 - u) + field[1, j, i2] * u) * (1 - v) + (field[1, j2, i] * (1 - u) + field[1, j2, i2] * u) * v
    r = math.sqrt(c * c + s * s)
    if r < 1e-3:
        return 0.0, 0.0
    # Half the angle: cos = sqrt((1 + c) / 2), with the larger of the two taken by the root.
    c /= r
    s /= r
    if c >= 0.0:
        dx = math.sqrt(0.5 + 0.5 * c)
        dy = 0.5 * s / dx
    else:
        dy = math.sqrt(0.5 - 0.5 * c)
        dx = 0.5 * s / dy
    if dx * px + dy * py < 0.0:
        return -dx, -dy
    return dx, dy


@kernel
def _grow(  # type: ignore[no-untyped-def]
    field, allowed, edge, stop, step, lag, inverse, count, cells, own, way, x, y, dx, dy, at, n, px, py, arc,
):  # fmt: skip
    """Go on from (x, y), point `at` of its line, in direction (dx, dy) or `way` -1 of the line, as long as there is room.

    Returns the number of points there then are, -1 when the arrays, -2 when a cell is too small.
    """
    h, w = allowed.shape
    while True:
        # Midpoint rule, the middle foreseen from the last step's direction: one look at the field a step.
        mx, my = _direction(field, x + 0.5 * step * dx, y + 0.5 * step * dy, dx, dy)
        if mx * dx + my * dy < TURN:
            return n
        nx = x + step * mx
        ny = y + step * my
        if not (0.0 <= nx < w and 0.0 <= ny < h):
            return n
        if not _passable(allowed, edge, x, y, nx, ny):
            return n
        at += way
        if not far(nx, ny, stop, inverse, cells, own, at, lag):
            return n
        if n >= len(px):
            return -1
        if not enter(nx, ny, inverse, count, cells, own, at):
            return -2
        x = nx
        y = ny
        dx = mx
        dy = my
        px[n] = x
        py[n] = y
        arc[n] = at
        n += 1


@helper
def _passable(allowed, edge, x, y, nx, ny):  # type: ignore[no-untyped-def]
    """Whether a line may go from one point to the next."""
    i = int(x)
    j = int(y)
    i2 = int(nx)
    j2 = int(ny)
    if allowed[j2, i2] == 0:
        return False
    if i2 != i and edge[j, min(i, i2), 0] >= 0.0:
        return False
    return not (j2 != j and edge[min(j, j2), i2, 1] >= 0.0)


@kernel
def _keep(  # type: ignore[no-untyped-def]
    field, allowed, edge, stop, shortest, lag, inverse, count, cells, held, held_offsets, px, py, arc, offsets, owner, origin,
):  # fmt: skip
    """Lay earlier lines again, in the pieces for which there is room and which still follow the field.

    Returns (points, lines), or (-1, 0) when the arrays, (-2, 0) when a cell is too small.
    """
    h, w = allowed.shape
    n = 0
    lines = 0
    for line in range(len(held_offsets) - 1):
        first = n
        for p in range(held_offsets[line], held_offsets[line + 1]):
            x = held[p, 0]
            y = held[p, 1]
            good = 0.0 <= x < w and 0.0 <= y < h
            if good:
                q = min(p + 1, held_offsets[line + 1] - 1)
                dx = held[q, 0] - held[q - 1, 0]
                dy = held[q, 1] - held[q - 1, 1]
                mx, my = _direction(field, x, y, dx, dy)
                size = math.sqrt(dx * dx + dy * dy)
                good = mx * dx + my * dy > ALIKE * size and (
                    _passable(allowed, edge, px[n - 1], py[n - 1], x, y) if n > first else allowed[int(y), int(x)] != 0
                )
            if good:
                good = far(x, y, stop, inverse, cells, lines, n - first, lag)
            if good:
                if n >= len(px):
                    return -1, 0
                if not enter(x, y, inverse, count, cells, lines, n - first):
                    return -2, 0
                px[n] = x
                py[n] = y
                arc[n] = n - first
                n += 1
            if not good or p == held_offsets[line + 1] - 1:
                if n - first < shortest:
                    forget(first, n, inverse, count, cells, px, py)
                    n = first
                else:
                    if lines + 2 >= len(offsets):
                        return -1, 0
                    owner[lines] = lines
                    origin[lines] = line
                    lines += 1
                    offsets[lines] = n
                    first = n
    return n, lines


@kernel
def _place(  # type: ignore[no-untyped-def]
    field, allowed, edge, separation, test, step, shortest, old, held, held_offsets, inverse, count, cells,
    px, py, arc, offsets, owner, origin,
):  # fmt: skip
    """Fill px, py with parts of lines; returns (points, parts, lines), or -1 when the arrays, -2 when a cell is too small.

    Part k is offsets[k]:offsets[k + 1] and belongs to line owner[k], which continues line origin[owner[k]] of `held`, or -1.
    """
    h, w = allowed.shape
    lag = np.int32(3.0 * separation / step + 2.0)
    for p in range(len(old)):
        # A full cell keeps lines away as it is; points outside the picture keep nothing away.
        if 0.0 <= old[p, 0] < w and 0.0 <= old[p, 1] < h:
            enter(old[p, 0], old[p, 1], inverse, count, cells, -1, 0)
    longer = max(shortest, int(LONGER * separation / step))
    n, lines = _keep(
        field, allowed, edge, separation * test, longer, lag, inverse, count, cells, held, held_offsets,
        px, py, arc, offsets, owner, origin,
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
            dx, dy = _direction(field, px[a], py[a], px[a] - px[a - way], py[a] - py[a - way])
            last = n
            n = _grow(
                field, allowed, edge, separation * test, step, lag, inverse, count, cells, line, way,
                px[a], py[a], dx, dy, arc[a], n, px, py, arc,
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
            dx, dy = _direction(field, px[point], py[point], 1.0, 0.0)
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
        if not (0.0 <= sx < w and 0.0 <= sy < h) or allowed[int(sy), int(sx)] == 0:
            continue
        if not far(sx, sy, room, inverse, cells, -2, 0, 0):
            if queue == parts and room == wide and not far(sx, sy, narrow, inverse, cells, -2, 0, 0):
                closed[candidate - 1] = True
            continue
        fx, fy = _direction(field, sx, sy, 1.0, 0.0)
        if fx == 0.0 and fy == 0.0:
            continue

        # What fills gaps stays out of narrower ones, and is more than a dash.
        stop = separation * test if room == wide else narrow
        first = n
        if n >= len(px):
            return -1, 0, 0
        if not enter(sx, sy, inverse, count, cells, lines, 0):
            return -2, 0, 0
        px[n] = sx
        py[n] = sy
        arc[n] = 0
        n += 1
        for way in (1, -1):
            n = _grow(
                field, allowed, edge, stop, step, lag, inverse, count, cells, lines, way, sx, sy, way * fx, way * fy, 0,
                n, px, py, arc,
            )  # fmt: skip
            if n < 0:
                return n, 0, 0
        if n - first < (shortest if room == wide else longer):
            forget(first, n, inverse, count, cells, px, py)
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
    edge = np.full((h, w, 2), np.nan, dtype=np.float32) if edge is None else edge
    old = np.zeros((0, 2), dtype=np.float32) if beside is None else beside
    none = np.zeros(0, dtype=np.int64)
    held = Streamlines(np.zeros((0, 2), dtype=np.float32), np.zeros(1, dtype=np.int64), none) if kept is None else kept
    shortest = separation if shortest is None else shortest
    least = max(2, int(shortest / step) + 1)
    capacity = 1024 + int(1.6 * int(allowed.sum()) / (separation * step))
    size = separation
    while True:
        px, py, arc = (np.empty(capacity, dtype=t) for t in (np.float32, np.float32, np.int32))
        offsets, owner, origin = (np.zeros(capacity // 2 + 4, dtype=np.int64) for _ in range(3))
        count = np.zeros((int(h / size) + 1, int(w / size) + 1), dtype=np.int32)
        cells = np.full((*count.shape, 4, PLACES), NOWHERE)
        n, parts, lines = _place(
            field, allowed.view(np.uint8), edge, float(separation), float(test), float(step), least, old,
            held.points, held.offsets, 1.0 / size, count, cells, px, py, arc, offsets, owner, origin,
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
    number[new] = np.arange(new.sum()) + held.number.max(initial=-1) + 1
    return Streamlines(points, ends, number)
