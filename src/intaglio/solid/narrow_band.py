"""Distances within a band of a few voxels: every triangle asks the voxels of its box, grown by the band."""

# C. Sigg, R. Peikert, M. Gross, "Signed distance transform using graphics hardware", 2003: scan conversion of a slab about each
# triangle. Here tiles own their voxels, and each tile goes through the triangles whose boxes meet it.
# Where a surface bends little, what is nearest to a triangle lies above or below it and hardly aside: a voxel whose nearest
# point is on an edge or a vertex, d away, is aside of each triangle there by no more than d times the sine of the angle
# between its normal and the others there. Hence a triangle asks the voxels of a rod along its normal.

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress, each, frozen, helper, kernel, strips
from intaglio.solid.grid import Shape
from intaglio.solid.normal_cones import normals_and_spread
from intaglio.solid.point_triangle import FRAME, frame_of, squared_distance

# Voxels along the side of a tile, and those of a packet along x.
TILE, PACKET = 32, 8
# Triangles that are made ready at a time.
CHUNK = 128
# Voxels that rounding may move a triangle by, and more.
ROUNDED = 1e-3
# Voxels in the rod of a triangle, on average, from which on the band is not narrow.
MANY = 6000


@helper
def _rod(axis, inverse, nx, ny, nz, aside):  # type: ignore[no-untyped-def]
    """Along an axis of the grid, voxels for a mm along the normal, and for all that is `aside` mm from it."""
    x, y, z = inverse[axis, 0], inverse[axis, 1], inverse[axis, 2]
    along = x * nx + y * ny + z * nz
    return along, aside * math.sqrt(max(x * x + y * y + z * z - along * along, 0.0)) + ROUNDED


@kernel
def _boxes(begin, end, points, triangles, normals, sines, inverse, band, shape, boxes):  # type: ignore[no-untyped-def]
    """First and last voxel (x, y, z, x, y, z) of the grid that each triangle may matter to; none where last < first."""
    for n in range(begin, end):
        a, b, c = triangles[n]
        for k in range(3):
            along, aside = _rod(k, inverse, normals[n, 0], normals[n, 1], normals[n, 2], band * sines[n])
            ball = math.sqrt(inverse[k, 0] ** 2 + inverse[k, 1] ** 2 + inverse[k, 2] ** 2)
            grow = min(aside + band * abs(along), band * ball + ROUNDED)
            low = min(points[a, k], min(points[b, k], points[c, k])) - grow
            high = max(points[a, k], max(points[b, k], points[c, k])) + grow
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
def _prepare(members, vertices, triangles, sines, matrix, inverse, reach, corners, frames, flat, rods):  # type: ignore[no-untyped-def]
    """Frames of some triangles, from their first corner, and along, low (x, y, z), high (x, y, z) of their rods in the grid."""
    # Nothing but reading first, for triangles of a tile may lie anywhere, and memory then is asked for many at once.
    for m in range(len(members)):
        for k in range(3):
            v = triangles[members[m], k]
            for i in range(3):
                corners[m, 3 * k + i] = vertices[v, i]
    for m in range(len(members)):
        ax, ay, az, bx, by, bz, cx, cy, cz = corners[m]
        f = frames[m]
        frame_of(0.0, 0.0, 0.0, bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az, f)
        for k in range(8):
            flat[m, k] = f[12 + k]
        for k in range(3):
            x, y, z = inverse[k, 0], inverse[k, 1], inverse[k, 2]
            along, aside = _rod(k, inverse, f[6], f[7], f[8], reach * sines[members[m]])
            first = x * (ax - matrix[0, 3]) + y * (ay - matrix[1, 3]) + z * (az - matrix[2, 3])
            second = x * (bx - ax) + y * (by - ay) + z * (bz - az)
            third = x * (cx - ax) + y * (cy - ay) + z * (cz - az)
            rods[m, k] = along
            rods[m, 3 + k] = first + min(0.0, min(second, third)) - aside
            rods[m, 6 + k] = first + max(0.0, max(second, third)) + aside


@kernel
def _fill_tile(x0, y0, z0, members, vertices, triangles, sines, matrix, inverse, band, slack, inside, field, closest):  # type: ignore[no-untyped-def]
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
    corners, frames, rods = np.empty((CHUNK, 9)), np.empty((CHUNK, FRAME)), np.empty((CHUNK, 9))
    flat = np.empty((CHUNK, 8), dtype=np.float32)
    reach = band + slack
    # What a step along x, y and z of the grid does to r, s and t.
    step = np.empty((3, 3))
    for m in range(len(members)):
        n, at_hand = members[m], m % CHUNK
        if at_hand == 0:
            _prepare(
                members[m : m + CHUNK], vertices, triangles, sines, matrix, inverse, reach, corners, frames, flat, rods
            )  # fmt: skip
        f, rod = frames[at_hand], rods[at_hand]
        for axis in range(3):
            e0, e1, e2 = f[3 * axis], f[3 * axis + 1], f[3 * axis + 2]
            for k in range(3):
                step[axis, k] = e0 * matrix[0, k] + e1 * matrix[1, k] + e2 * matrix[2, k]
        px, py, pz = matrix[0, 3] - corners[at_hand, 0], matrix[1, 3] - corners[at_hand, 1], matrix[2, 3] - corners[at_hand, 2]
        r0 = f[0] * px + f[1] * py + f[2] * pz + f[9]
        s0 = f[3] * px + f[4] * py + f[5] * pz + f[10]
        t0 = f[6] * px + f[7] * py + f[8] * pz + f[11]
        drx, dsx, dtx = np.float32(step[0, 0]), np.float32(step[1, 0]), np.float32(step[2, 0])
        dry, dsy, dty = np.float32(step[0, 1]), np.float32(step[1, 1]), np.float32(step[2, 1])
        left, right, lx, ly, ll, rx, ry, rl = flat[at_hand]
        size = left + right + np.float32(PACKET) * (abs(drx) + abs(dsx)) + np.float32(TILE) * (abs(dry) + abs(dsy))
        # Along y, the part of a column of packets that is within the band from the triangle's plane.
        thick = reach + 0.5 * (PACKET - 1) * abs(step[2, 0])
        per_t = 1.0 / max(abs(step[2, 1]), 1e-9 * thick)
        per_t = per_t if step[2, 1] > 0 else -per_t
        half = thick * abs(per_t) + 1e-6 * TILE
        # In a layer of the grid is only a piece of the rod: from `down` to `up` along the normal, which is turned to point up.
        steep = abs(rod[2])
        along_x, along_y = (rod[0], rod[1]) if rod[2] >= 0.0 else (-rod[0], -rod[1])
        per_z = 1.0 / max(steep, 1e-9)
        first_z = int(math.ceil(max(rod[5] - reach * steep, float(z0))))
        last_z = int(math.floor(min(rod[8] + reach * steep, z0 + TILE - 1.0)))
        for z in range(first_z, last_z + 1):
            down, up = max((z - rod[8]) * per_z, -reach), min((z - rod[5]) * per_z, reach)
            first_x = int(math.ceil(max(rod[3] + min(down * along_x, up * along_x), float(x0))))
            last_x = int(math.floor(min(rod[6] + max(down * along_x, up * along_x), x0 + TILE - 1.0)))
            first = max(rod[4] + min(down * along_y, up * along_y), float(y0))
            last = min(rod[7] + max(down * along_y, up * along_y), y0 + TILE - 1.0)
            if last < first or last_x < first_x:
                continue
            for packet in range((first_x - x0) // PACKET, (last_x - x0) // PACKET + 1):
                x = x0 + packet * PACKET
                tilt = t0 + step[2, 0] * x + step[2, 2] * z
                middle = -(tilt + step[2, 0] * (0.5 * (PACKET - 1))) * per_t
                # Even, so that what is done beyond the end stays in the column.
                begin = int(math.ceil(min(max(middle - half, first), last + 1.0))) & -2
                end = int(math.floor(max(min(middle + half, last), first - 1.0)))
                r1 = np.float32(r0 + step[0, 0] * x + step[0, 1] * begin + step[0, 2] * z)
                s1 = np.float32(s0 + step[1, 0] * x + step[1, 1] * begin + step[1, 2] * z)
                t1 = np.float32(tilt + step[2, 1] * begin)
                eps = np.float32(4e-7) * (abs(r1) + abs(s1) + size)
                at = (((z - z0) * (TILE // PACKET) + packet) * TILE + begin - y0) * PACKET
                # Two rows at a time: vectors hold 16 numbers where they are long.
                for i in range((end - begin + 2) // 2 * 2 * PACKET):
                    u, w = np.float32(np.int32(i) & (PACKET - 1)), np.float32(np.int32(i) // PACKET)
                    r, s, t = r1 + (drx * u + dry * w), s1 + (dsx * u + dsy * w), t1 + (dtx * u + dty * w)
                    d = squared_distance(r, s, t, left, right, lx, ly, ll, rx, ry, rl, eps)
                    v = np.uintp(at + i)
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


@dataclass(frozen=True)
class Rods:
    """Where the triangles of a mesh may matter, in a grid.

    sines    (n,) of how far normals turn about each triangle
    boxes    (n, 6) int32, first and last voxel (x, y, z, x, y, z)
    inverse  (3, 3) to index space
    voxels   in a rod, on average
    """

    sines: NDArray[np.float32]
    boxes: NDArray[np.int32]
    inverse: NDArray[np.float64]
    voxels: float

    @property
    def narrow(self) -> bool:
        """Whether to ask all voxels of the rods takes less time than to halve the grid."""
        return self.voxels < MANY


def _volume(corners: NDArray[np.float64], sines: NDArray[np.float32], band: float) -> float:
    """Of a rod, mm^3, on average."""
    sides = np.roll(corners, -1, axis=1) - corners
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
    aside = band * sines
    return float(np.mean(area + np.linalg.norm(sides, axis=2).sum(axis=1) * aside + math.pi * aside**2)) * 2 * band


def rods_of(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    left: NDArray[np.int64],
    world_from_index: NDArray[np.float64],
    band: float,
    shape: Shape,
) -> Rods:
    inverse = np.linalg.inv(world_from_index)
    points = vertices @ inverse[:3, :3].T
    points += inverse[:3, 3]
    normals, sines = normals_and_spread(vertices, triangles, left)
    boxes = np.empty((len(triangles), 6), dtype=np.int32)
    inverse = frozen(inverse[:3, :3])
    strips(_boxes, len(triangles), points, frozen(triangles), normals, sines, inverse, band, shape, boxes, size=2**15)
    some = slice(None, None, 1 + len(triangles) // 4096)
    volume = _volume(vertices[triangles[some]], sines[some], band)
    return Rods(sines, boxes, inverse, volume * abs(float(np.linalg.det(inverse))))


def fill_band(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    rods: Rods,
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
    _sorted_into(tiles, rods.boxes, start, np.empty(0, dtype=np.int32))
    start = np.cumsum(start)
    members = np.empty(start[-1], dtype=np.int32)
    if len(members):
        _sorted_into(tiles, rods.boxes, start[:-1].copy(), members)
    mesh = (frozen(vertices), frozen(triangles), rods.sines)
    fixed = (*mesh, frozen(world_from_index), rods.inverse, band, slack, inside.view(np.uint8), field, closest)
    jobs = [
        (x * TILE, y * TILE, z * TILE, members[start[t] : start[t + 1]], *fixed) for t, (z, y, x) in enumerate(np.ndindex(tiles))
    ]
    each(_fill_tile, jobs, progress=progress)
