"""Evenly spaced streamlines of a field of lines."""

# B. Jobard, W. Lefer, "Creating evenly-spaced streamlines of arbitrary density", 1997.

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import helper, kernel
from intaglio.errors import InputError

TURN = math.cos(math.radians(40.0))
# Points that a cell of the search grid holds, and where an empty place is.
PLACES = 16
# How near to others a line may begin that fills a gap, as a part of the separation.
NARROW = 0.65
# How long such a line must be at least, in separations.
LONGER = 6.0
NOWHERE = np.float32(1e9)


@dataclass(frozen=True, eq=False)
class Streamlines:
    """Polylines in pixels: line i is points[offsets[i]:offsets[i + 1]]; points (n, 2) float32, x right, y down."""

    points: NDArray[np.float32]
    offsets: NDArray[np.int64]

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


@helper
def _taken(cell, fx, fy, bound, own, at, lag):  # type: ignore[no-untyped-def]
    """Whether a cell (4, PLACES: x, y, line, arc) holds a point too near, other than of the line's own near part.

    All places at once, empty ones being far away: one vector instruction instead of a search.
    """
    hits = np.float32(0.0)
    for k in range(PLACES):
        dx = cell[0, k] - fx
        dy = cell[1, k] - fy
        other = (cell[2, k] != own) | (abs(cell[3, k] - at) >= lag)
        hits += np.float32(1.0) if (dx * dx + dy * dy < bound) & other else np.float32(0.0)
    return hits > np.float32(0.0)


@helper
def _far(x, y, limit, inverse, cells, own, at, lag):  # type: ignore[no-untyped-def]
    """No point of another line, nor of the line's own distant part, within `limit` of (x, y)."""
    # float32 all through: numba widens integers to 64 bits, which halves the lanes of the vector.
    fx, fy, bound = np.float32(x), np.float32(y), np.float32(limit * limit)
    own, at, lag = np.float32(own), np.float32(at), np.float32(lag)
    # The cell of the point itself first: where lines are dense it decides.
    if _taken(cells[int(y * inverse), int(x * inverse)], fx, fy, bound, own, at, lag):
        return False
    j0 = max(int((y - limit) * inverse), 0)
    i0 = max(int((x - limit) * inverse), 0)
    for j in range(j0, min(int((y + limit) * inverse) + 1, cells.shape[0])):
        for i in range(i0, min(int((x + limit) * inverse) + 1, cells.shape[1])):
            if _taken(cells[j, i], fx, fy, bound, own, at, lag):
                return False
    return True


@helper
def _enter(x, y, inverse, count, cells, own, at):  # type: ignore[no-untyped-def]
    """Note a point in its cell; False when the cell is full."""
    j = int(y * inverse)
    i = int(x * inverse)
    k = count[j, i]
    if k == PLACES:
        return False
    cells[j, i, 0, k] = x
    cells[j, i, 1, k] = y
    cells[j, i, 2, k] = own
    cells[j, i, 3, k] = at
    count[j, i] = k + 1
    return True


@kernel
def _place(  # type: ignore[no-untyped-def]
    field, allowed, edge, separation, test, step, shortest, old, inverse, count, cells,
    px, py, arc, offsets,
):  # fmt: skip
    """Fill px, py with lines; returns (points, lines), or (-1, 0) when the arrays, (-2, 0) when a cell is too small."""
    h, w = allowed.shape
    capacity = len(px)
    lag = np.int32(3.0 * separation / step + 2.0)
    for p in range(len(old)):
        # A full cell keeps lines away as it is; points outside the picture keep nothing away.
        if 0.0 <= old[p, 0] < w and 0.0 <= old[p, 1] < h:
            _enter(old[p, 0], old[p, 1], inverse, count, cells, -1, 0)
    n = 0
    lines = 0
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
    longer = int(LONGER * separation / step)
    closed = np.zeros(across * down, dtype=np.bool_)
    while True:
        # The next place to begin: beside the lines there are, in their order; then any gap that is left.
        if queue < lines:
            if point >= offsets[queue + 1]:
                queue += 1
                if queue < lines:
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
        if not _far(sx, sy, room, inverse, cells, -2, 0, 0):
            if queue == lines and room == wide and not _far(sx, sy, narrow, inverse, cells, -2, 0, 0):
                closed[candidate - 1] = True
            continue
        fx, fy = _direction(field, sx, sy, 1.0, 0.0)
        if fx == 0.0 and fy == 0.0:
            continue

        # What fills gaps stays out of narrower ones, and is more than a dash.
        stop = separation * test if room == wide else narrow
        first = n
        for way in range(2):
            x = sx
            y = sy
            dx = fx if way == 0 else -fx
            dy = fy if way == 0 else -fy
            at = np.int32(0)
            while True:
                if way == 0 or at != 0:
                    if n >= capacity:
                        return -1, 0
                    if not _enter(x, y, inverse, count, cells, lines, at):
                        return -2, 0
                    px[n] = x
                    py[n] = y
                    arc[n] = at
                    n += 1
                # Midpoint rule, the middle foreseen from the last step's direction: one look at the field a step.
                mx, my = _direction(field, x + 0.5 * step * dx, y + 0.5 * step * dy, dx, dy)
                if mx * dx + my * dy < TURN:
                    break
                nx = x + step * mx
                ny = y + step * my
                if not (0.0 <= nx < w and 0.0 <= ny < h):
                    break
                i = int(x)
                j = int(y)
                i2 = int(nx)
                j2 = int(ny)
                if allowed[j2, i2] == 0:
                    break
                if i2 != i and edge[j, min(i, i2), 0] >= 0.0:
                    break
                if j2 != j and edge[min(j, j2), i2, 1] >= 0.0:
                    break
                at += np.int32(1) if way == 0 else np.int32(-1)
                if not _far(nx, ny, stop, inverse, cells, lines, at, lag):
                    break
                x = nx
                y = ny
                dx = mx
                dy = my
        if n - first < (shortest if room == wide else max(shortest, longer)):
            while n > first:
                n -= 1
                j = int(py[n] * inverse)
                i = int(px[n] * inverse)
                count[j, i] -= 1
                cells[j, i, 0, count[j, i]] = NOWHERE
            continue
        lines += 1
        if lines >= len(offsets):
            return -1, 0
        offsets[lines] = n
    return n, lines


@kernel
def _in_order(offsets, px, py, arc, out):  # type: ignore[no-untyped-def]
    """Lines grew both ways from their seeds; put their points in the order of arc."""
    for i in range(len(offsets) - 1):
        low = 0
        for p in range(offsets[i], offsets[i + 1]):
            low = min(low, arc[p])
        for p in range(offsets[i], offsets[i + 1]):
            q = offsets[i] + arc[p] - low
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
) -> Streamlines:
    """Lines along a field, `separation` pixels apart.

    field     (2, h, w) float32, cosine and sine of twice the angle; (0, 0) ends a line
    allowed   (h, w) where lines may run
    edge      (h, w, 2) the G-buffer's edges, which no line crosses
    test      a line ends when it comes closer than test * separation to another
    step      pixels between points; midpoint rule
    shortest  length in pixels below which a line is dropped; default the separation
    beside    (n, 2) points of earlier lines to keep away from: how a denser set is nested in a sparser one
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
    shortest = separation if shortest is None else shortest
    least = max(2, int(shortest / step) + 1)
    capacity = 1024 + int(1.6 * int(allowed.sum()) / (separation * step))
    size = separation
    while True:
        px, py, arc = (np.empty(capacity, dtype=t) for t in (np.float32, np.float32, np.int32))
        offsets = np.zeros(capacity // 2 + 2, dtype=np.int64)
        count = np.zeros((int(h / size) + 1, int(w / size) + 1), dtype=np.int32)
        cells = np.full((*count.shape, 4, PLACES), NOWHERE)
        n, lines = _place(
            field, allowed.view(np.uint8), edge, float(separation), float(test), float(step), least, old, 1.0 / size,
            count, cells, px, py, arc, offsets,
        )  # fmt: skip
        if n >= 0:
            break
        capacity, size = (2 * capacity, size) if n == -1 else (capacity, 0.7 * size)
    offsets = offsets[: lines + 1].copy()
    points = np.empty((n, 2), dtype=np.float32)
    _in_order(offsets, px, py, arc, points)
    return Streamlines(points, offsets)
