"""surface: the isosurface of a field as a closed, oriented, manifold mesh."""

# W. Lorensen, H. Cline, "Marching cubes", 1987 (the cases are in cubes.py).
# W. Schroeder, R. Maynard, B. Geveci, "Flying edges", 2015: count first, so that threads can write to their places.

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress, frozen, helper, kernel, strips
from intaglio.errors import InputError
from intaglio.mesh import TriangleMesh
from intaglio.sampling import trilinear
from intaglio.solid.cubes import cube_triangles
from intaglio.solid.field import Side, check_level, stages
from intaglio.solid.labels import label_distance
from intaglio.volume import Volume, check_volume

# A vertex stays this part of a voxel's distance away from the voxels at its edge's ends, so that no triangle is without area.
KEEP = np.float32(1e-3)
# The value round the grid, where nothing is.
OUTSIDE = np.float32(-1e30)


@helper
def _load(voxels, z, pad, iso, sign, value, inside):  # type: ignore[no-untyped-def]
    """Slice z of the padded grid: positive where the body is, and whether it is."""
    height, width = value.shape
    for y in range(height):
        empty = z < pad or z >= voxels.shape[0] + pad or y < pad or y >= height - pad
        if empty:
            value[y, :] = OUTSIDE
            inside[y, :] = 0
        else:
            row = voxels[z - pad, y - pad]
            value[y, 0] = OUTSIDE
            value[y, width - 1] = OUTSIDE
            for x in range(row.size):
                value[y, x + pad] = sign * (row[x] - iso)
            for x in range(width):
                inside[y, x] = np.uint8(value[y, x] >= np.float32(0.0))


@helper
def _differ(a, b, count):  # type: ignore[no-untyped-def]
    n = np.int32(0)
    for i in range(count):
        n += np.int32(a[i] ^ b[i])
    return n


@helper
def _codes(low, high, y, code, cases):  # type: ignore[no-untyped-def]
    """The corners of a row of cells, eight bits for each; 0 for those within the body, too."""
    for x in range(code.size):
        code[x] = low[y, x] | low[y + 1, x] << np.uint8(1) | high[y, x] << np.uint8(2) | high[y + 1, x] << np.uint8(3)
    for x in range(code.size - 1):
        case = np.uint8(code[x] | code[x + 1] << np.uint8(4))
        cases[x] = np.uint8(0) if case == np.uint8(255) else case


@helper
def _row(width):  # type: ignore[no-untyped-def]
    """Bytes for a row, and the same by eights, of which most are 0 and are passed over together."""
    marks = np.zeros(-(-width // 8) * 8, np.uint8)
    return marks, marks.view(np.uint64)


@kernel
def _count(begin, end, voxels, pad, iso, sign, number, counts):  # type: ignore[no-untyped-def]
    """counts[z] = crossings of x and y edges in a slice, of z edges above it, triangles above it."""
    height, width = voxels.shape[1] + 2 * pad, voxels.shape[2] + 2 * pad
    value = np.empty((height, width), np.float32)
    low = np.empty((height, width), np.uint8)
    high = np.empty((height, width), np.uint8)
    code = np.empty(width, np.uint8)
    cases, words = _row(width)
    _load(voxels, begin, pad, iso, sign, value, low)
    for z in range(begin, end):
        flat = np.int32(0)
        for y in range(height):
            flat += _differ(low[y], low[y, 1:], width - 1)
            if y + 1 < height:
                flat += _differ(low[y], low[y + 1], width)
        counts[z, 0] = flat
        if z + 1 == counts.shape[0]:
            break
        _load(voxels, z + 1, pad, iso, sign, value, high)
        upright = np.int32(0)
        triangles = np.int32(0)
        for y in range(height):
            upright += _differ(low[y], high[y], width)
            if y + 1 == height:
                break
            _codes(low, high, y, code, cases)
            for w in range(words.size):
                if words[w] != 0:
                    for x in range(8 * w, 8 * w + 8):
                        triangles += np.int32(number[cases[x]])
        counts[z, 1] = upright
        counts[z, 2] = triangles
        low, high = high, low


@helper
def _cut(a, b):  # type: ignore[no-untyped-def]
    """Where between values of different sign the surface is, 0..1 of the way."""
    return min(max(a / (a - b), KEEP), np.float32(1.0) - KEEP)


@helper
def _flat_vertices(z, pad, value, inside, start, write, along_x, along_y, vertices, marks, words):  # type: ignore[no-untyped-def]
    """Number the crossings in a slice from `start`, in the order of its voxels, and place them."""
    height, width = value.shape
    n = start
    for y in range(height):
        below = min(y + 1, height - 1)
        here, there = inside[y], inside[below]
        for x in range(width - 1):
            marks[x] = (here[x] ^ here[x + 1]) | (here[x] ^ there[x]) << np.uint8(1)
        marks[width - 1] = (here[width - 1] ^ there[width - 1]) << np.uint8(1)
        for w in range(words.size):
            if words[w] == 0:
                continue
            for x in range(8 * w, 8 * w + 8):
                if marks[x] & 1:
                    along_x[y, x] = n
                    if write:
                        vertices[n, 0] = np.float32(x - pad) + _cut(value[y, x], value[y, x + 1])
                        vertices[n, 1] = y - pad
                        vertices[n, 2] = z - pad
                    n += 1
                if marks[x] & 2:
                    along_y[y, x] = n
                    if write:
                        vertices[n, 0] = x - pad
                        vertices[n, 1] = np.float32(y - pad) + _cut(value[y, x], value[below, x])
                        vertices[n, 2] = z - pad
                    n += 1


@kernel
def _build(begin, end, voxels, pad, iso, sign, number, corners, starts, vertices, triangles):  # type: ignore[no-untyped-def]
    """The vertices of slices begin..end, in index space, and the triangles above them."""
    height, width = voxels.shape[1] + 2 * pad, voxels.shape[2] + 2 * pad
    low_value = np.empty((height, width), np.float32)
    high_value = np.empty((height, width), np.float32)
    low = np.empty((height, width), np.uint8)
    high = np.empty((height, width), np.uint8)
    code = np.empty(width, np.uint8)
    marks, words = _row(width)
    # Which vertex is on the x and y edges of the two slices, and on the z edges between.
    x_low, y_low, x_high, y_high, upright = np.empty((5, height, width), np.int32)
    _load(voxels, begin, pad, iso, sign, low_value, low)
    _flat_vertices(begin, pad, low_value, low, starts[begin, 0], True, x_low, y_low, vertices, marks, words)
    for z in range(begin, end):
        if z + 1 == starts.shape[0] - 1:
            break
        _load(voxels, z + 1, pad, iso, sign, high_value, high)
        _flat_vertices(z + 1, pad, high_value, high, starts[z + 1, 0], z + 1 < end, x_high, y_high, vertices, marks, words)
        n = starts[z, 1]
        t = starts[z, 2]
        for y in range(height):
            for x in range(width):
                marks[x] = low[y, x] ^ high[y, x]
            for w in range(words.size):
                if words[w] == 0:
                    continue
                for x in range(8 * w, 8 * w + 8):
                    if marks[x]:
                        upright[y, x] = n
                        vertices[n, 0] = x - pad
                        vertices[n, 1] = y - pad
                        vertices[n, 2] = np.float32(z - pad) + _cut(low_value[y, x], high_value[y, x])
                        n += 1
        marks[width - 1] = 0
        for y in range(height - 1):
            _codes(low, high, y, code, marks)
            for w in range(words.size):
                if words[w] == 0:
                    continue
                for x in range(8 * w, 8 * w + 8):
                    case = marks[x]
                    for k in range(3 * number[case]):
                        edge = corners[case, k]
                        i = edge & 1
                        j = edge >> 1 & 1
                        if edge < 4:
                            vertex = x_high[y + i, x] if j else x_low[y + i, x]
                        elif edge < 8:
                            vertex = y_high[y, x + i] if j else y_low[y, x + i]
                        else:
                            vertex = upright[y + j, x + i]
                        triangles[t + k // 3, k % 3] = vertex
                    t += number[case]
        low, high = high, low
        low_value, high_value = high_value, low_value
        x_low, x_high = x_high, x_low
        y_low, y_high = y_high, y_low


def _starts(counts: NDArray[np.int64]) -> tuple[NDArray[np.int64], int]:
    """Numbers of the first vertex in each slice, the first above it, and the first triangle above it; all triangles."""
    starts = np.zeros((len(counts) + 1, 3), dtype=np.int64)
    both = counts[:, :2].sum(axis=1)
    starts[1:, 0] = np.cumsum(both)
    starts[:-1, 1] = starts[:-1, 0] + counts[:, 0]
    starts[1:, 2] = np.cumsum(counts[:, 2])
    return starts, int(starts[-1, 2])


@kernel
def _place(begin, end, voxels, sign, world, matrix, vertices, placed, normals):  # type: ignore[no-untyped-def]
    """Vertices in the world; and unit normals: matrix times the central differences, at caps that of the grid's face."""
    nz, ny, nx = voxels.shape
    for n in range(begin, end):
        x, y, z = float(vertices[n, 0]), float(vertices[n, 1]), float(vertices[n, 2])
        for i in range(3):
            placed[n, i] = world[i, 0] * x + world[i, 1] * y + world[i, 2] * z + world[i, 3]
        a = b = c = 0.0
        if x < 0.0 or x > nx - 1.0:
            a = 1.0 if x > 0.0 else -1.0
        elif y < 0.0 or y > ny - 1.0:
            b = 1.0 if y > 0.0 else -1.0
        elif z < 0.0 or z > nz - 1.0:
            c = 1.0 if z > 0.0 else -1.0
        else:
            a = sign * (trilinear(voxels, x - 1.0, y, z) - trilinear(voxels, x + 1.0, y, z))
            b = sign * (trilinear(voxels, x, y - 1.0, z) - trilinear(voxels, x, y + 1.0, z))
            c = sign * (trilinear(voxels, x, y, z - 1.0) - trilinear(voxels, x, y, z + 1.0))
        u = matrix[0, 0] * a + matrix[0, 1] * b + matrix[0, 2] * c
        v = matrix[1, 0] * a + matrix[1, 1] * b + matrix[1, 2] * c
        w = matrix[2, 0] * a + matrix[2, 1] * b + matrix[2, 2] * c
        size = math.sqrt(u * u + v * v + w * w)
        scale = 1.0 / size if size > 0.0 else 0.0
        normals[n, 0] = scale * u
        normals[n, 1] = scale * v
        normals[n, 2] = scale * w


def surface(
    volume: Volume,
    iso: float | None = None,
    *,
    label: int | Collection[int] | None = None,
    smooth: bool = True,
    inside: Side | None = None,
    cap: bool = True,
    progress: Progress | None = None,
) -> TriangleMesh:
    """The isosurface of a volume as triangles, counter-clockwise seen from outside, in RAS+ mm, with normals of the field.

    iso     None for the body of a distance field (below 0) or a mask (set voxels); a value for that of a scan (from it up)
    label   instead of iso: the value, or several for one body of all, whose voxels are the body in a label volume
    smooth  labels without the steps of their voxels, by `label_distance`: what is three voxels wide or more is smoothed over two
            voxels, vertices move by a voxel and a half at most, the volume stays. False for the faces between voxels
    inside  on which side of the isovalue the body is, where that guess is wrong
    cap     close the mesh where the body leaves the grid, at the outermost voxels; open there otherwise
    Every edge has two triangles (one, where the mesh is open), every vertex one fan of them: a manifold. Vertices lie where
    the field, linear along the edges of the grid, takes the value, at least a thousandth of a voxel away from its voxels.
    Marching cubes; where a face is ambiguous, the body is parted. InputError if iso is outside the volume's values.
    """
    check_volume(volume)
    if label is not None:
        if iso is not None or inside is not None:
            raise InputError("label must stand alone, without iso and inside")
        labelling, progress = stages(progress, 2)
        volume = label_distance(volume, label, smooth=smooth, progress=labelling)
    level, side = check_level(volume, iso, inside)
    sign, pad = np.float32(side), int(cap)
    voxels = frozen(volume.samples.astype(np.float32, copy=False))
    number, corners = cube_triangles()
    counting, building, placing = stages(progress, 3)
    slices = len(voxels) + 2 * pad
    counts = np.zeros((slices, 3), dtype=np.int64)
    strips(_count, slices, voxels, pad, np.float32(level), sign, number, counts, size=16, progress=counting)
    starts, triangle_count = _starts(counts)
    if triangle_count == 0:
        raise InputError(f"{volume.name}: the body at {level:g} fills the grid, and so has no surface; close it with cap=True")
    vertices = np.empty((int(counts[:, :2].sum()), 3), dtype=np.float32)
    triangles = np.empty((triangle_count, 3), dtype=np.int32)
    strips(
        _build, slices, voxels, pad, np.float32(level), sign, number, corners, starts, vertices, triangles,
        size=16, progress=building,
    )  # fmt: skip
    normals, placed = np.empty_like(vertices), np.empty(vertices.shape)
    covariant = np.ascontiguousarray(volume.index_from_world[:3, :3].T)
    strips(
        _place, len(vertices), voxels, float(sign), volume.world_from_index, covariant, vertices, placed, normals,
        size=1 << 14, progress=placing,
    )  # fmt: skip
    if np.linalg.det(volume.world_from_index[:3, :3]) < 0:
        triangles = triangles[:, ::-1]
    return TriangleMesh(placed, triangles, volume.name, normals=normals)
