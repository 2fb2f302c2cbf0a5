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
def _far(x, y, limit, size, head, following, px, py, line, arc, own, at, lag):  # type: ignore[no-untyped-def]
    """No point of another line, nor of the line's own distant part, within `limit` of (x, y)."""
    cy = int(y / size)
    cx = int(x / size)
    bound = limit * limit
    for j in range(max(cy - 1, 0), min(cy + 2, head.shape[0])):
        for i in range(max(cx - 1, 0), min(cx + 2, head.shape[1])):
            p = head[j, i]
            while p >= 0:
                dx = px[p] - x
                dy = py[p] - y
                if dx * dx + dy * dy < bound and not (line[p] == own and abs(arc[p] - at) < lag):
                    return False
                p = following[p]
    return True


@kernel
def _place(field, allowed, edge, separation, test, step, shortest, old, head, following, px, py, line, arc, offsets):  # type: ignore[no-untyped-def]
    """Fill px, py with lines; returns (points, lines), or (-1, 0) when the arrays are too small."""
    h, w = allowed.shape
    capacity = len(px)
    stop = separation * test
    lag = int(3.0 * separation / step) + 2
    n = old
    for p in range(n):
        j = int(py[p] / separation)
        i = int(px[p] / separation)
        following[p] = head[j, i]
        head[j, i] = p
    lines = 0
    offsets[0] = n
    queue = 0
    candidate = 0
    spread = max(1.0, 0.5 * separation)
    across = int(math.ceil(w / spread))
    down = int(math.ceil(h / spread))
    stride = max(1, int(0.5 * separation / step))
    point = n
    side = 0
    while True:
        # The next place to begin: beside the lines there are, in their order; then any gap that is left.
        if queue < lines:
            if point >= offsets[queue + 1]:
                queue += 1
                if queue < lines:
                    point = offsets[queue]
                continue
            dx, dy = _direction(field, px[point], py[point], 1.0, 0.0)
            sx = px[point] + (separation if side == 0 else -separation) * -dy
            sy = py[point] + (separation if side == 0 else -separation) * dx
            if side == 1:
                point += stride
            side = 1 - side
        else:
            if candidate >= across * down:
                break
            sx = (candidate % across + 0.5) * spread
            sy = (candidate // across + 0.5) * spread
            candidate += 1
        if not (0.0 <= sx < w and 0.0 <= sy < h) or allowed[int(sy), int(sx)] == 0:
            continue
        if not _far(sx, sy, 0.98 * separation, separation, head, following, px, py, line, arc, -1, 0, 0):
            continue
        fx, fy = _direction(field, sx, sy, 1.0, 0.0)
        if fx == 0.0 and fy == 0.0:
            continue

        first = n
        for way in range(2):
            x = sx
            y = sy
            dx = fx if way == 0 else -fx
            dy = fy if way == 0 else -fy
            at = 0
            while True:
                if way == 0 or at != 0:
                    if n >= capacity:
                        return -1, 0
                    px[n] = x
                    py[n] = y
                    line[n] = lines
                    arc[n] = at
                    j = int(y / separation)
                    i = int(x / separation)
                    following[n] = head[j, i]
                    head[j, i] = n
                    n += 1
                # Midpoint rule.
                mx, my = _direction(field, x + 0.5 * step * dx, y + 0.5 * step * dy, dx, dy)
                nx = x + step * mx
                ny = y + step * my
                if (mx == 0.0 and my == 0.0) or not (0.0 <= nx < w and 0.0 <= ny < h):
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
                ex, ey = _direction(field, nx, ny, mx, my)
                if ex * dx + ey * dy < TURN:
                    break
                at += 1 if way == 0 else -1
                if not _far(nx, ny, stop, separation, head, following, px, py, line, arc, lines, at, lag):
                    break
                x = nx
                y = ny
                dx = ex
                dy = ey
        if n - first < shortest:
            while n > first:
                n -= 1
                head[int(py[n] / separation), int(px[n] / separation)] = following[n]
            continue
        lines += 1
        if lines >= len(offsets):
            return -1, 0
        offsets[lines] = n
        if lines == 1:
            point = offsets[0]
    return n, lines


@kernel
def _in_order(offsets, first, px, py, arc, out):  # type: ignore[no-untyped-def]
    """Lines grew both ways from their seeds; put their points in the order of arc."""
    for i in range(len(offsets) - 1):
        low = 0
        for p in range(offsets[i], offsets[i + 1]):
            low = min(low, arc[p])
        for p in range(offsets[i], offsets[i + 1]):
            q = offsets[i] - first + arc[p] - low
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
    h, w = field.shape[1:]
    step = min(step, 0.5 * test * separation)
    allowed = np.ones((h, w), dtype=bool) if allowed is None else allowed
    edge = np.full((h, w, 2), np.nan, dtype=np.float32) if edge is None else edge
    old = np.zeros((0, 2), dtype=np.float32) if beside is None else beside
    shortest = separation if shortest is None else shortest
    least = max(2, int(shortest / step) + 1)
    capacity = len(old) + 1024 + int(1.5 * int(allowed.sum()) / (separation * step))
    while True:
        px, py = np.empty(capacity, dtype=np.float32), np.empty(capacity, dtype=np.float32)
        px[: len(old)], py[: len(old)] = old[:, 0], old[:, 1]
        line = np.full(capacity, -2, dtype=np.int32)
        arc = np.zeros(capacity, dtype=np.int32)
        head = np.full((int(h / separation) + 1, int(w / separation) + 1), -1, dtype=np.int32)
        following = np.empty(capacity, dtype=np.int32)
        offsets = np.zeros(capacity // 2 + 2, dtype=np.int64)
        n, lines = _place(
            field, allowed.view(np.uint8), edge, float(separation), float(test), float(step), least,
            len(old), head, following, px, py, line, arc, offsets,
        )  # fmt: skip
        if n >= 0:
            break
        capacity *= 2
    offsets = offsets[: lines + 1].copy()
    points = np.empty((n - len(old), 2), dtype=np.float32)
    _in_order(offsets, len(old), px, py, arc, points)
    return Streamlines(points, offsets - len(old))
