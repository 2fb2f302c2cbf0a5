"""Distances within a band of a few voxels: every triangle asks the voxels of its box, grown by the band."""

# C. Sigg, R. Peikert, M. Gross, "Signed distance transform using graphics hardware", 2003: scan conversion of a slab about each
# triangle. Here tiles own their voxels, and each tile goes through the triangles whose boxes meet it.

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress, each, frozen, kernel, lanes, strips
from intaglio.solid.grid import Shape
from intaglio.solid.point_triangle import FRAME, frame_of, squared_distance

# Voxels along the side of a tile, and those of a packet along x.
TILE, PACKET = 32, 8
# Voxels in the box of a triangle, on average, from which on the band is not narrow.
MANY = 4000


@kernel
def _boxes(begin, end, points, triangles, grow, shape, boxes):  # type: ignore[no-untyped-def]
    """First and last voxel (x, y, z, x, y, z) of the grid that each triangle may matter to; none where last < first."""
    for n in range(begin, end):
        a, b, c = triangles[n]
        for k in range(3):
            low = min(points[a, k], min(points[b, k], points[c, k])) - grow[k]
            high = max(points[a, k], max(points[b, k], points[c, k])) + grow[k]
            boxes[n, k] = int(math.ceil(min(max(low, 0.0), float(shape[2 - k]))))
            boxes[n, 3 + k] = int(math.floor(min(max(high, -1.0), shape[2 - k] - 1.0)))


@kernel
def _sorted_into(tiles, boxes, start, members):  # type: ignore[no-untyped-def]
    """Triangles of each tile, in order: members[start[t] : start[t + 1]]. Counts only where members is empty."""
    for n in range(len(boxes)):
        x0, y0, z0, x1, y1, z1 = boxes[n]
        if x0 > x1 or y0 > y1 or z0 > z1:
            continue
        for z in range(z0 // TILE, z1 // TILE + 1):
            for y in range(y0 // TILE, y1 // TILE + 1):
                for x in range(x0 // TILE, x1 // TILE + 1):
                    t = (z * tiles[1] + y) * tiles[2] + x
                    if len(members):
                        members[start[t]] = n
                        start[t] += 1
                    else:
                        start[t + 1] += 1


@kernel
def _fill_tile(x0, y0, z0, members, vertices, triangles, boxes, matrix, band, slack, inside, field, closest):  # type: ignore[no-untyped-def]
    """Distances from a tile's triangles, the members; farther away than the band, the band with its sign."""
    nz, ny, nx = field.shape
    far = np.float32(band)
    if len(members) == 0:
        for z in range(z0, min(z0 + TILE, nz)):
            for y in range(y0, min(y0 + TILE, ny)):
                for x in range(x0, min(x0 + TILE, nx)):
                    field[z, y, x] = -far if inside[z, y, x] else far
                for x in range(x0, min(x0 + TILE, nx) if len(closest) else x0):
                    closest[z, y, x] = -1
        return
    # By z, x // PACKET, y, x % PACKET: packets above one another stand together.
    best = np.full(TILE * TILE * TILE, far * far, dtype=np.float32)
    index = np.full(TILE * TILE * TILE, -1, dtype=np.int32)
    f = np.empty(FRAME)
    # What a step along x, y and z of the grid does to r, s and t.
    step = np.empty((3, 3))
    g = lanes()
    for n in members:
        a, b, c = triangles[n, 0], triangles[n, 1], triangles[n, 2]
        # Coordinates from the triangle's first corner, so that np.float32 will do.
        ax, ay, az = vertices[a, 0], vertices[a, 1], vertices[a, 2]
        frame_of(
            0.0, 0.0, 0.0, vertices[b, 0] - ax, vertices[b, 1] - ay, vertices[b, 2] - az,
            vertices[c, 0] - ax, vertices[c, 1] - ay, vertices[c, 2] - az, f,
        )  # fmt: skip
        for k in range(FRAME):
            g[k] = f[k]
        for axis in range(3):
            e0, e1, e2 = f[3 * axis], f[3 * axis + 1], f[3 * axis + 2]
            for k in range(3):
                step[axis, k] = e0 * matrix[0, k] + e1 * matrix[1, k] + e2 * matrix[2, k]
        px, py, pz = matrix[0, 3] - ax, matrix[1, 3] - ay, matrix[2, 3] - az
        r0 = f[0] * px + f[1] * py + f[2] * pz + f[9]
        s0 = f[3] * px + f[4] * py + f[5] * pz + f[10]
        t0 = f[6] * px + f[7] * py + f[8] * pz + f[11]
        drx, dsx, dtx = np.float32(step[0, 0]), np.float32(step[1, 0]), np.float32(step[2, 0])
        dry, dsy, dty = np.float32(step[0, 1]), np.float32(step[1, 1]), np.float32(step[2, 1])
        left, right, lx, ly, ll, rx, ry, rl = g[12], g[13], g[14], g[15], g[16], g[17], g[18], g[19]
        size = left + right + np.float32(PACKET) * (abs(drx) + abs(dsx)) + np.float32(TILE) * (abs(dry) + abs(dsy))
        # Along y, the part of a column of packets that is within the band from the triangle's plane.
        thick = band + slack + 0.5 * (PACKET - 1) * abs(step[2, 0])
        per_t = 1.0 / max(abs(step[2, 1]), 1e-9 * thick)
        per_t = per_t if step[2, 1] > 0 else -per_t
        half = thick * abs(per_t) + 1e-6 * TILE
        first, last = max(boxes[n, 1], y0), min(boxes[n, 4], y0 + TILE - 1)
        for z in range(max(boxes[n, 2], z0), min(boxes[n, 5], z0 + TILE - 1) + 1):
            for packet in range(max(boxes[n, 0] - x0, 0) // PACKET, min(boxes[n, 3] - x0, TILE - 1) // PACKET + 1):
                x = x0 + packet * PACKET
                tilt = t0 + step[2, 0] * x + step[2, 2] * z
                middle = -(tilt + step[2, 0] * (0.5 * (PACKET - 1))) * per_t
                # Even, so that what is done beyond the end stays in the column.
                begin = int(math.ceil(min(max(middle - half, float(first)), float(last + 1)))) & -2
                end = int(math.floor(max(min(middle + half, float(last)), float(first - 1))))
                r1 = np.float32(r0 + step[0, 0] * x + step[0, 1] * begin + step[0, 2] * z)
                s1 = np.float32(s0 + step[1, 0] * x + step[1, 1] * begin + step[1, 2] * z)
                t1 = np.float32(tilt + step[2, 1] * begin)
                eps = np.float32(4e-7) * (abs(r1) + abs(s1) + size)
                at = (((z - z0) * (TILE // PACKET) + packet) * TILE + begin - y0) * PACKET
                # Two rows at a time: vectors hold 16 numbers where they are long.
                for m in range((end - begin + 2) // 2 * 2 * PACKET):
                    u, w = np.float32(np.int32(m) & (PACKET - 1)), np.float32(np.int32(m) // PACKET)
                    r, s, t = r1 + (drx * u + dry * w), s1 + (dsx * u + dsy * w), t1 + (dtx * u + dty * w)
                    d = squared_distance(r, s, t, left, right, lx, ly, ll, rx, ry, rl, eps)
                    v = np.uintp(at + m)
                    nearer = d < best[v]
                    best[v] = d if nearer else best[v]
                    index[v] = n if nearer else index[v]
    for z in range(z0, min(z0 + TILE, nz)):
        for y in range(y0, min(y0 + TILE, ny)):
            for x in range(x0, min(x0 + TILE, nx), PACKET):
                at = (((z - z0) * TILE + (x - x0)) // PACKET * TILE + y - y0) * PACKET
                for i in range(min(PACKET, nx - x)):
                    d = np.float32(far if index[at + i] < 0 else math.sqrt(best[at + i]))
                    field[z, y, x + i] = -d if inside[z, y, x + i] else d
                    if len(closest):
                        closest[z, y, x + i] = index[at + i]


def boxes_of(
    vertices: NDArray[np.float64], triangles: NDArray[np.int32], world_from_index: NDArray[np.float64], band: float, shape: Shape
) -> NDArray[np.int32]:
    """(n, 6): first and last voxel (x, y, z, x, y, z) of the grid that may lie within the band from each triangle."""
    index_from_world = np.linalg.inv(world_from_index)
    points = vertices @ index_from_world[:3, :3].T + index_from_world[:3, 3]
    # How far a ball reaches along each axis of the grid, and more than rounding.
    grow = band * np.linalg.norm(index_from_world[:3, :3], axis=1) + 1e-3
    boxes = np.empty((len(triangles), 6), dtype=np.int32)
    strips(_boxes, len(triangles), points, frozen(triangles), grow, shape, boxes, size=2**15)
    return boxes


def is_narrow(boxes: NDArray[np.int32]) -> bool:
    """Whether to ask all voxels of these boxes takes less time than to halve the grid."""
    sides = np.maximum(boxes[:, 3:] - boxes[:, :3] + 1.0, 0.0)
    return bool(sides.prod(axis=1).mean() < MANY)


def fill_band(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    boxes: NDArray[np.int32],
    world_from_index: NDArray[np.float64],
    band: float,
    slack: float,
    inside: NDArray[np.bool_],
    field: NDArray[np.float32],
    closest: NDArray[np.int32],
    progress: Progress | None,
) -> None:
    """Fill `field` with signed distances, and `closest`, unless that is empty, with the nearest triangles."""
    tiles = tuple(-(-n // TILE) for n in field.shape)
    start = np.zeros(math.prod(tiles) + 1, dtype=np.int64)
    _sorted_into(tiles, boxes, start, np.empty(0, dtype=np.int32))
    start = np.cumsum(start)
    members = np.empty(start[-1], dtype=np.int32)
    if len(members):
        _sorted_into(tiles, boxes, start[:-1].copy(), members)
    fixed = (frozen(vertices), frozen(triangles), boxes, frozen(world_from_index), band, slack)
    out = (inside.view(np.uint8), field, closest)
    jobs = [
        (x * TILE, y * TILE, z * TILE, members[start[t] : start[t + 1]], *fixed, *out)
        for t, (z, y, x) in enumerate(np.ndindex(tiles))
    ]
    each(_fill_tile, jobs, progress=progress)
