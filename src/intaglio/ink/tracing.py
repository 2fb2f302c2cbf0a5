"""One line through a field of lines, as far as there is room."""

from __future__ import annotations

import math

import numpy as np

from intaglio.compute import helper, kernel
from intaglio.ink.neighbours import far, forget, hide, reserve, show

# What a pixel's byte says: lines may be here; none goes from here to the right; none down.
OPEN, RIGHT, BELOW = np.uint8(1), np.uint8(2), np.uint8(4)
TURN = math.cos(math.radians(40.0))
# Cosine of the angle to the field up to which a kept line follows it.
ALIKE = math.cos(math.radians(25.0))


@kernel
def ways_of(begin, end, allowed, edge, ways):  # type: ignore[no-untyped-def]
    """Rows of the bytes that say where lines may go: in the cache, they are a tenth of what they come from."""
    for y in range(begin, end):
        for x in range(ways.shape[1]):
            way = OPEN if allowed[y, x] else np.uint8(0)
            way |= RIGHT if edge[y, x, 0] >= np.float32(0.0) else np.uint8(0)
            way |= BELOW if edge[y, x, 1] >= np.float32(0.0) else np.uint8(0)
            ways[y, x] = way


@helper
def direction(field, x, y, px, py):  # type: ignore[no-untyped-def]
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
    # Half the angle: (r + c, s) and (s, r - c) both point there; the longer one is taken.
    a = r + abs(c)
    norm = 1.0 / math.sqrt(2.0 * r * a)
    dx = (a if c >= 0.0 else s) * norm
    dy = (s if c >= 0.0 else a) * norm
    if dx * px + dy * py < 0.0:
        return -dx, -dy
    return dx, dy


@kernel
def grow(  # type: ignore[no-untyped-def]
    field, ways, stop, step, lag, inverse, count, cells, way, dx, dy, root, back, behind, n, px, py, arc, place,
):  # fmt: skip
    """Go on from point `root` of a line in direction (dx, dy), `way` -1 of the line, as long as there is room.

    A point keeps its own line away only from points more than `lag` after it; of those before the root there are `behind`,
    at root + back, root + 2 back ...  Returns the number of points there then are, -1 when the arrays, -2 when a cell is too
    small.
    """
    h, w = ways.shape
    first = n
    for k in range(min(lag, behind + 1)):
        p = root + k * back
        hide(px[p], py[p], inverse, cells, place[p])
    x = px[root]
    y = py[root]
    while True:
        # Midpoint rule, the middle foreseen from the last step's direction: one look at the field a step.
        mx, my = direction(field, x + 0.5 * step * dx, y + 0.5 * step * dy, dx, dy)
        if mx * dx + my * dy < TURN:
            break
        nx = x + step * mx
        ny = y + step * my
        if not (0.0 <= nx < w and 0.0 <= ny < h):
            break
        if not _passable(ways, x, y, nx, ny):
            break
        k = n - first + 1 - lag
        if k > 0:
            p = first + k - 1
            show(px[p], py[p], inverse, cells, place[p])
        elif -k <= behind:
            p = root - k * back
            show(px[p], py[p], inverse, cells, place[p])
        if not far(nx, ny, stop, inverse, cells):
            break
        if n >= len(px):
            return -1
        k = reserve(nx, ny, inverse, count)
        if k < 0:
            return -2
        x = nx
        y = ny
        dx = mx
        dy = my
        px[n] = x
        py[n] = y
        arc[n] = arc[root] + way * (n - first + 1)
        place[n] = k
        n += 1
    for p in range(max(first, n - lag), n):
        show(px[p], py[p], inverse, cells, place[p])
    for k in range(min(lag, behind + 1)):
        p = root + k * back
        show(px[p], py[p], inverse, cells, place[p])
    return n


@helper
def _passable(ways, x, y, nx, ny):  # type: ignore[no-untyped-def]
    """Whether a line may go from one point to the next."""
    i = int(x)
    j = int(y)
    i2 = int(nx)
    j2 = int(ny)
    if ways[j2, i2] & OPEN == 0:
        return False
    if i2 != i and ways[j, min(i, i2)] & RIGHT != 0:
        return False
    return j2 == j or ways[min(j, j2), i2] & BELOW == 0


@kernel
def keep(  # type: ignore[no-untyped-def]
    field, ways, stop, shortest, lag, inverse, count, cells, held, held_offsets,
    px, py, arc, place, offsets, owner, origin,
):  # fmt: skip
    """Lay earlier lines again, in the pieces for which there is room and which still follow the field.

    Returns (points, lines), or (-1, 0) when the arrays, (-2, 0) when a cell is too small.
    """
    h, w = ways.shape
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
                mx, my = direction(field, x, y, dx, dy)
                size = math.sqrt(dx * dx + dy * dy)
                good = mx * dx + my * dy > ALIKE * size and (
                    _passable(ways, px[n - 1], py[n - 1], x, y) if n > first else ways[int(y), int(x)] & OPEN != 0
                )
            if good:
                if n - first >= lag:
                    show(px[n - lag], py[n - lag], inverse, cells, place[n - lag])
                good = far(x, y, stop, inverse, cells)
            if good:
                if n >= len(px):
                    return -1, 0
                k = reserve(x, y, inverse, count)
                if k < 0:
                    return -2, 0
                px[n] = x
                py[n] = y
                arc[n] = n - first
                place[n] = k
                n += 1
            if not good or p == held_offsets[line + 1] - 1:
                if n - first < shortest:
                    forget(first, n, inverse, count, cells, px, py, place)
                    n = first
                else:
                    for q in range(max(first, n - lag), n):
                        show(px[q], py[q], inverse, cells, place[q])
                    if lines + 2 >= len(offsets):
                        return -1, 0
                    owner[lines] = lines
                    origin[lines] = line
                    lines += 1
                    offsets[lines] = n
                    first = n
    return n, lines
