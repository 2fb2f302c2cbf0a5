"""Which triangles can be nearest to a point of a box, decided for the eight halves of a box at once."""

# For a point q of the surface and a triangle T, |p - q|^2 - d(p, T)^2 is the largest of |p - q|^2 - |p - t|^2 over t in T, each
# linear in p, and so it is convex in p. Where it is not positive at the corners of a box it is not positive in the box, and T
# is never nearer than q. The q are the places of the surface nearest to the box's corners.

from __future__ import annotations

import math

import numpy as np

from intaglio.compute import helper, kernel, lanes
from intaglio.solid.point_triangle import FRAME, ZERO, nearest_place, squared_distance

# Triangles looked at together; distances of this many are kept while a box is halved, those of more are found twice.
CHUNK, KEPT = 32, 2048
FAR = np.float32(3e38)


@helper
def world(matrix, x, y, z):  # type: ignore[no-untyped-def]
    return (
        matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z + matrix[0, 3],
        matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z + matrix[1, 3],
        matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z + matrix[2, 3],
    )


@helper
def _load(frames, list_, first, count, table):  # type: ignore[no-untyped-def]
    """Frames of a chunk of triangles, one lane each; the last is repeated where there are fewer."""
    for m in range(CHUNK):
        f = frames[list_[first + min(m, count - 1)]]
        for c in range(FRAME):
            table[c, m] = f[c]


@helper
def _squares(table, points, slack, out, at):  # type: ignore[no-untyped-def]
    """Squared distances of the 27 points from each triangle of a chunk."""
    for p in range(27):
        x, y, z = points[0, p], points[1, p], points[2, p]
        row = out[p]
        for m in range(CHUNK):
            r = table[0, m] * x + table[1, m] * y + table[2, m] * z + table[9, m]
            s = table[3, m] * x + table[4, m] * y + table[5, m] * z + table[10, m]
            t = table[6, m] * x + table[7, m] * y + table[8, m] * z + table[11, m]
            row[at + m] = squared_distance(
                r, s, t, table[12, m], table[13, m], table[14, m], table[15, m], table[16, m], table[17, m], table[18, m],
                table[19, m], slack,
            )  # fmt: skip


@helper
def _near(squares, corner, at, limit, out):  # type: ignore[no-untyped-def]
    """Not negative in the lanes of triangles one of a box's corners is near to; how many these are."""
    c0, c1, c2, c3 = squares[corner[0]], squares[corner[1]], squares[corner[2]], squares[corner[3]]
    c4, c5, c6, c7 = squares[corner[4]], squares[corner[5]], squares[corner[6]], squares[corner[7]]
    for m in range(CHUNK):
        n = at + m
        out[m] = limit - min(min(min(c0[n], c1[n]), min(c2[n], c3[n])), min(min(c4[n], c5[n]), min(c6[n], c7[n])))
    some = 0
    for m in range(CHUNK):
        some += out[m] >= ZERO
    return some


@helper
def _beat(squares, corner, at, bound, out):  # type: ignore[no-untyped-def]
    """Negative in the lanes of triangles that some place is nearer than, whichever corner of the box one asks."""
    c0, c1, c2, c3 = squares[corner[0]], squares[corner[1]], squares[corner[2]], squares[corner[3]]
    c4, c5, c6, c7 = squares[corner[4]], squares[corner[5]], squares[corner[6]], squares[corner[7]]
    for j in range(8):
        b0, b1, b2, b3 = bound[j, 0], bound[j, 1], bound[j, 2], bound[j, 3]
        b4, b5, b6, b7 = bound[j, 4], bound[j, 5], bound[j, 6], bound[j, 7]
        for m in range(CHUNK):
            n = at + m
            low = max(max(b0 - c0[n], b1 - c1[n]), max(b2 - c2[n], b3 - c3[n]))
            high = max(max(b4 - c4[n], b5 - c5[n]), max(b6 - c6[n], b7 - c7[n]))
            out[m] = min(out[m], max(low, high))


@kernel
def halve(x, y, z, side, matrix, list_, count, frames, band, slack, squares, masks):  # type: ignore[no-untyped-def]
    """Which triangles each of the eight halves of a box has to look at: one bit a half in masks[m].

    x, y, z, side   the box, in voxels; band: nothing farther away matters; slack: what rounding may do to a distance
    squares         (27, KEPT + CHUNK) scratch
    """
    points = np.empty((3, 27), dtype=np.float64)
    points32 = np.empty((3, 27), dtype=np.float32)
    for p in range(27):
        at = side * 0.5
        px, py, pz = world(matrix, x - 0.5 + at * (p % 3), y - 0.5 + at * (p // 3 % 3), z - 0.5 + at * (p // 9))
        points[0, p], points[1, p], points[2, p] = px, py, pz
        points32[0, p], points32[1, p], points32[2, p] = px, py, pz
    table = np.empty((FRAME, CHUNK), dtype=np.float32)
    stored = count <= KEPT
    # Floats that are not negative are ordered like the integers of the same bits, whose minimum is one instruction.
    bits = squares.view(np.int32)
    least = np.full(27, 2**31 - 1, dtype=np.int32)
    nearest = np.zeros(27, dtype=np.int32)
    for first in range(0, count, CHUNK):
        some = min(CHUNK, count - first)
        _load(frames, list_, first, some, table)
        at = first if stored else 0
        _squares(table, points32, np.float32(slack), squares, at)
        for p in range(27):
            smallest = bits[p, at]
            for m in range(at + 1, at + CHUNK):
                smallest = min(smallest, bits[p, m])
            if smallest < least[p]:
                least[p] = smallest
                m = 0
                while bits[p, at + m] != smallest:
                    m += 1
                nearest[p] = list_[first + m]
    places = np.empty((3, 27), dtype=np.float64)
    for p in range(27):
        qx, qy, qz = nearest_place(frames[nearest[p]], points[0, p], points[1, p], points[2, p])
        places[0, p], places[1, p], places[2, p] = qx, qy, qz
    # From any point of a half to its nearest corner it is at most half of the longest diagonal.
    reach = 0.0
    for p in range(4):
        a, b = (0, 26) if p == 0 else (2, 24) if p == 1 else (6, 20) if p == 2 else (8, 18)
        d = (points[0, a] - points[0, b]) ** 2 + (points[1, a] - points[1, b]) ** 2 + (points[2, a] - points[2, b]) ** 2
        reach = max(reach, math.sqrt(d) / 4)
    limit = (band + reach + slack) ** 2
    corner = np.empty((8, 8), dtype=np.int32)
    bound = np.empty((8, 8, 8), dtype=np.float32)
    near = np.empty(8, dtype=np.float32)
    for half in range(8):
        for k in range(8):
            corner[half, k] = (half & 1) + (k & 1) + 3 * ((half >> 1 & 1) + (k >> 1 & 1)) + 9 * ((half >> 2) + (k >> 2))
        near[half] = np.float32(limit)
        for j in range(8):
            q = corner[half, j]
            farthest = ZERO
            for k in range(8):
                p = corner[half, k]
                dx, dy, dz = places[0, q] - points[0, p], places[1, q] - points[1, p], places[2, q] - points[2, p]
                # At least (distance + slack) squared.
                above = np.float32((dx * dx + dy * dy + dz * dz) * 1.0001 + slack * slack * 10001.0)
                bound[half, j, k] = above
                farthest = max(farthest, above)
            near[half] = min(near[half], farthest)
    alive = lanes()
    for first in range(0, count, CHUNK):
        some = min(CHUNK, count - first)
        at = first if stored else 0
        if not stored:
            _load(frames, list_, first, some, table)
            _squares(table, points32, np.float32(slack), squares, at)
        for m in range(some):
            masks[first + m] = 0
        for half in range(8):
            if _near(squares, corner[half], at, near[half], alive) > 0:
                _beat(squares, corner[half], at, bound[half], alive)
                for m in range(some):
                    masks[first + m] |= np.uint8(alive[m] >= ZERO) << half
