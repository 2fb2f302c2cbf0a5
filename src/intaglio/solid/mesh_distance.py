"""distance_field: the signed distance to a mesh, exact at every voxel."""

# After C. Sigg et al. 2003 and T. Kaehler, "Vergleich von Volumenmodellen", 2010, chapter 3 (triangle frames; sign by
# voxelization), but the other way round: a box of voxels is halved, and each half takes along the triangles that can be
# nearest to any point in it, until it is a leaf whose voxels ask all that are left.

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress, each, frozen, kernel
from intaglio.errors import InputError
from intaglio.mesh import TriangleMesh
from intaglio.solid.edges import net_edges
from intaglio.solid.grid import Shape, extent_of, grid_around
from intaglio.solid.narrow_band import fill_band, rods_of
from intaglio.solid.nearest import CHUNK, FAR, KEPT, halve, world
from intaglio.solid.point_triangle import frames_of, squared_distance
from intaglio.solid.scan_conversion import occupancy
from intaglio.volume import Volume

# Voxels along the side of a box that is not halved any more, and of one that a job fills.
LEAF, TILE = 4, 32
LEVELS = 3
# What np.float32 may do to a distance, as a part of the largest coordinate.
ROUNDING = 4e-6

# First voxel (x, y, z) and the triangles to look at.
Box = tuple[tuple[int, int, int], NDArray[np.int32]]


@kernel
def fill_leaf(x, y, z, cx, cy, cz, list_, count, frames, offsets, best, index, band, inside, field, closest):  # type: ignore[no-untyped-def]
    """Distances of LEAF^3 voxels from (x, y, z) on from their candidates, in coordinates that count from their middle c."""
    n = LEAF * LEAF * LEAF
    for v in range(n):
        best[v] = FAR
        index[v] = -1
    for m in range(count):
        triangle = list_[m]
        f = frames[triangle]
        r0, s0, t0 = (
            np.float32(f[0] * cx + f[1] * cy + f[2] * cz + f[9]),
            np.float32(f[3] * cx + f[4] * cy + f[5] * cz + f[10]),
            np.float32(f[6] * cx + f[7] * cy + f[8] * cz + f[11]),
        )
        a0, a1, a2 = np.float32(f[0]), np.float32(f[1]), np.float32(f[2])
        a3, a4, a5 = np.float32(f[3]), np.float32(f[4]), np.float32(f[5])
        a6, a7, a8 = np.float32(f[6]), np.float32(f[7]), np.float32(f[8])
        left, right, lx, ly, ll = np.float32(f[12]), np.float32(f[13]), np.float32(f[14]), np.float32(f[15]), np.float32(f[16])
        rx, ry, rl = np.float32(f[17]), np.float32(f[18]), np.float32(f[19])
        slack = np.float32(4e-7) * (abs(r0) + abs(s0) + left + right)
        for v in range(n):
            ox, oy, oz = offsets[0, v], offsets[1, v], offsets[2, v]
            r = r0 + (a0 * ox + a1 * oy + a2 * oz)
            s = s0 + (a3 * ox + a4 * oy + a5 * oz)
            t = t0 + (a6 * ox + a7 * oy + a8 * oz)
            d = squared_distance(r, s, t, left, right, lx, ly, ll, rx, ry, rl, slack)
            nearer = d < best[v]
            best[v] = d if nearer else best[v]
            index[v] = triangle if nearer else index[v]
    for k in range(min(LEAF, field.shape[0] - z)):
        for j in range(min(LEAF, field.shape[1] - y)):
            for i in range(min(LEAF, field.shape[2] - x)):
                v = (k * LEAF + j) * LEAF + i
                d = min(math.sqrt(best[v]), band)
                field[z + k, y + j, x + i] = -d if inside[z + k, y + j, x + i] else d
                if len(closest) and best[v] <= band * band:
                    closest[z + k, y + j, x + i] = index[v]


@kernel
def pick(list_, count, masks, half, out):  # type: ignore[no-untyped-def]
    """Copy the triangles that a half has to look at; how many these are."""
    picked = 0
    for m in range(count):
        out[picked] = list_[m]
        picked += masks[m] >> half & 1
    return picked


@kernel
def _fill_tile(x0, y0, z0, first_list, matrix, frames, offsets, band, slack, inside, field, closest):  # type: ignore[no-untyped-def]
    """A tile, its boxes halved until they are leaves, depth first."""
    nz, ny, nx = field.shape
    for z in range(z0, min(z0 + TILE, nz)):
        for y in range(y0, min(y0 + TILE, ny)):
            for x in range(x0, min(x0 + TILE, nx)):
                field[z, y, x] = -band if inside[z, y, x] else band
                if len(closest):
                    closest[z, y, x] = -1
    size = len(first_list)
    if size == 0:
        return
    lists = np.empty((LEVELS + 1, size), dtype=np.int32)
    for m in range(size):
        lists[0, m] = first_list[m]
    masks = np.empty((LEVELS, size), dtype=np.uint8)
    counts = np.zeros(LEVELS + 1, dtype=np.int64)
    counts[0] = size
    place = np.zeros((LEVELS + 1, 3), dtype=np.int64)
    place[0, 0], place[0, 1], place[0, 2] = x0, y0, z0
    turn = np.zeros(LEVELS, dtype=np.int64)
    squares = np.empty((27, KEPT + CHUNK), dtype=np.float32)
    best = np.empty(LEAF * LEAF * LEAF, dtype=np.float32)
    index = np.empty(LEAF * LEAF * LEAF, dtype=np.int32)
    level = 0
    while level >= 0:
        side = TILE >> level
        x, y, z = place[level, 0], place[level, 1], place[level, 2]
        if turn[level] == 0:
            halve(x, y, z, side, matrix, lists[level], counts[level], frames, band, slack, squares, masks[level])
        if turn[level] == 8:
            turn[level] = 0
            level -= 1
            continue
        half = turn[level]
        turn[level] += 1
        x += (half & 1) * (side >> 1)
        y += (half >> 1 & 1) * (side >> 1)
        z += (half >> 2) * (side >> 1)
        if x >= nx or y >= ny or z >= nz:
            continue
        count = pick(lists[level], counts[level], masks[level], half, lists[level + 1])
        if count == 0:
            continue
        if level == LEVELS - 1:
            half_leaf = LEAF * 0.5 - 0.5
            cx, cy, cz = world(matrix, x + half_leaf, y + half_leaf, z + half_leaf)
            fill_leaf(x, y, z, cx, cy, cz, lists[LEVELS], count, frames, offsets, best, index, band, inside, field, closest)
            continue
        level += 1
        counts[level] = count
        place[level, 0], place[level, 1], place[level, 2] = x, y, z


def _space_filling(corners: NDArray[np.float64]) -> NDArray[np.int64]:
    """An order of triangles (n, 3, 3) in which neighbours in space are mostly neighbours in memory."""
    middle = corners.sum(axis=1)
    low = middle.min(axis=0)
    cell = (31.99 / max(float((middle - low).max()), 1e-300) * (middle - low)).astype(np.uint16)
    key = np.zeros(len(corners), dtype=np.uint16)
    for bit in range(5):
        for axis in range(3):
            key |= (cell[:, axis] >> bit & 1) << np.uint16(3 * bit + axis)
    return np.argsort(key, kind="stable")


def _halves(
    box: Box, side: int, shape: Shape, matrix: Any, frames: NDArray[np.float64], band: float, slack: float, out: list[Box]
) -> None:
    """Append the halves of a box that are in the grid."""
    (x, y, z), candidates = box
    masks = np.zeros(len(candidates), dtype=np.uint8)
    if len(candidates):
        squares = np.empty((27, KEPT + CHUNK), dtype=np.float32)
        halve(x, y, z, side, matrix, candidates, len(candidates), frames, band, slack, squares, masks)
    half = side // 2
    for bit in range(8):
        at = x + half * (bit & 1), y + half * (bit >> 1 & 1), z + half * (bit >> 2)
        if at[0] < shape[2] and at[1] < shape[1] and at[2] < shape[0]:
            picked = np.empty(len(candidates), dtype=np.int32)
            out.append((at, picked[: pick(candidates, len(candidates), masks, bit, picked)].copy()))


def halved(
    boxes: list[Box], side: int, shape: Shape, matrix: Any, frames: NDArray[np.float64], band: float, slack: float
) -> list[Box]:
    """The halves of boxes that are in the grid."""
    halves: list[list[Box]] = [[] for _ in boxes]
    each(_halves, [(box, side, shape, matrix, frames, band, slack, out) for box, out in zip(boxes, halves, strict=True)])
    return [box for out in halves for box in out]


def _tiles(shape: Shape, matrix: NDArray[np.float64], frames: NDArray[np.float64], band: float, slack: float) -> list[Box]:
    """Every tile of the grid: the whole, halved until it is tiles."""
    side = TILE
    while side < max(shape):
        side *= 2
    boxes: list[Box] = [((0, 0, 0), np.arange(len(frames), dtype=np.int32))]
    while side > TILE:
        boxes = halved(boxes, side, shape, matrix, frames, band, slack)
        side //= 2
    return boxes


@dataclass(frozen=True)
class Asked:
    """A mesh made ready to be asked for distances from a grid's voxels, in coordinates that count from the grid's middle.

    order    of the triangles whose frames these are
    matrix   (4, 4) from the index of a voxel
    offsets  (3, LEAF^3) of a leaf's voxels from its middle
    slack    what rounding may do to a distance, mm
    """

    order: NDArray[np.int64]
    frames: NDArray[np.float64]
    matrix: NDArray[np.float64]
    offsets: NDArray[np.float32]
    slack: float


def centred(mesh: TriangleMesh, shape: Shape, matrix: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """The grid's matrix in coordinates that count from its middle, where np.float32 is finest, and the slack."""
    last = np.array(shape[::-1]) - 1.0
    local = matrix.copy()
    local[:3, 3] = -matrix[:3, :3] @ (last / 2)
    vertices = mesh.vertices + (local - matrix)[:3, 3]
    reach = max(float(np.abs(vertices).max()), float((np.abs(local[:3, :3]) @ (last + 1)).max()))
    return local, ROUNDING * reach


def asked(mesh: TriangleMesh, shape: Shape, matrix: NDArray[np.float64]) -> Asked:
    local, slack = centred(mesh, shape, matrix)
    corners = mesh.vertices[mesh.triangles] + (local - matrix)[:3, 3]
    order = _space_filling(corners)
    frames = frozen(frames_of(corners[order]))
    step = np.arange(LEAF) - (LEAF - 1) / 2
    z, y, x = np.meshgrid(step, step, step, indexing="ij")
    offsets = frozen((local[:3, :3] @ np.stack([x.ravel(), y.ravel(), z.ravel()])).astype(np.float32))
    return Asked(order, frames, frozen(local), offsets, slack)


def band_width(band: float | str, extent: float) -> float:
    """mm"""
    text = str(band).strip()
    try:
        if text == "full":
            return math.inf
        width = float(text.removesuffix("mm")) * (1.0 if text.endswith("mm") else extent)
    except ValueError:
        width = math.nan
    if not (math.isfinite(width) and width > 0):
        raise InputError(f'band must be a part of the extent such as 0.05, mm such as "5mm", or "full", not {band!r}')
    return width


@overload
def distance_field(
    mesh: TriangleMesh,
    *,
    resolution: int | None = ...,
    spacing: float | None = ...,
    like: Volume | None = ...,
    band: float | str = ...,
    return_closest: Literal[False] = ...,
    progress: Progress | None = ...,
) -> Volume: ...
@overload
def distance_field(
    mesh: TriangleMesh,
    *,
    resolution: int | None = ...,
    spacing: float | None = ...,
    like: Volume | None = ...,
    band: float | str = ...,
    return_closest: Literal[True],
    progress: Progress | None = ...,
) -> tuple[Volume, Volume]: ...


def distance_field(
    mesh: TriangleMesh,
    *,
    resolution: int | None = None,
    spacing: float | None = None,
    like: Volume | None = None,
    band: float | str = 0.05,
    return_closest: bool = False,
    progress: Progress | None = None,
) -> Volume | tuple[Volume, Volume]:
    """The signed distance to a mesh, negative inside: a volume of np.float32, mm; or two, with the nearest triangles.

    resolution, spacing, like  the grid, as for voxelize
    band            how far from the surface distances are wanted: a part of the mesh's longest extent, mm such as "5mm",
                    or "full". Farther away the field has the band's width, with its sign.
    return_closest  also a volume of int32: the number of the nearest triangle, -1 beyond the band
    progress        called with tiles of 32 x 32 x 32 voxels done and in all

    Distances are exact up to the rounding of np.float32, in all of the band or grid: no triangle is left out that could be the
    nearest. The sign is that of voxelize, notes included, and never that of a triangle's plane. For an open mesh it is that of
    the generalized winding number, and it changes across a hole where the distance is not zero.
    Raises InputError as voxelize does, and for a band that is none. Source: Sigg et al. 2003; Kaehler 2010.
    """
    shape, matrix = grid_around(mesh, resolution, spacing, like)
    width = band_width(band, extent_of(mesh))
    left = net_edges(mesh.triangles)
    inside, notes = occupancy(mesh, shape, matrix, left=left)
    local, slack = centred(mesh, shape, matrix)
    field = np.empty(shape, dtype=np.float32)
    closest = np.empty(shape if return_closest else (0, 0, 0), dtype=np.int32)
    vertices = mesh.vertices + (local - matrix)[:3, 3]
    rods = rods_of(vertices, mesh.triangles, left[0], local, width, shape) if math.isfinite(width) else None
    if rods and rods.narrow:
        fill_band(vertices, mesh.triangles, rods, local, width, slack, inside, field, closest, progress)
    else:
        mine = asked(mesh, shape, matrix)
        tiles = _tiles(shape, mine.matrix, mine.frames, width, mine.slack)
        fixed = (mine.matrix, mine.frames, mine.offsets, width, mine.slack, inside.view(np.uint8), field, closest)
        each(_fill_tile, [(*place, candidates, *fixed) for place, candidates in tiles], progress=progress)
        closest[closest >= 0] = mine.order[closest[closest >= 0]]
    distance = Volume(field, matrix, f"distance to {mesh.name}", notes, distances=True)
    if not return_closest:
        return distance
    return distance, Volume(closest, matrix, f"nearest triangles of {mesh.name}", notes)
