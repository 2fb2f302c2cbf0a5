"""The surface of a sparse field, brick by brick."""

# W. Lorensen, H. Cline, "Marching cubes", 1987 (the cases are in cubes.py).
# Neighbouring bricks place the vertices on the edges that they share one by one, and those of one edge then become one.

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress, frozen, kernel, strips
from intaglio.errors import InputError
from intaglio.solid.cubes import cube_triangles
from intaglio.solid.field import stages
from intaglio.solid.surface import KEEP


@kernel
def _march(begin, end, places, samples, size, number, corners, starts, edges, cuts, triangles):  # type: ignore[no-untyped-def]
    """Bricks begin..end: for each vertex the edge of the fine grid and where on it; triangles of these vertices.

    Without room in `edges` it only counts: starts[n + 1] = vertices and triangles of brick n.
    """
    side = samples.shape[1]
    cells = side - 1
    mine = np.empty((3, side, side, side), dtype=np.int32)
    step = np.eye(3, dtype=np.int64)
    write = len(edges) > 0
    for n in range(begin, end):
        field = samples[n]
        vertex, triangle = (starts[n, 0], starts[n, 1]) if write else (0, 0)
        for k in range(side):
            for j in range(side):
                for i in range(side):
                    for axis in range(3):
                        u, v, w = i + step[axis, 0], j + step[axis, 1], k + step[axis, 2]
                        if max(u, v, w) == side or (field[k, j, i] < 0) == (field[w, v, u] < 0):
                            continue
                        if write:
                            x, y, z = cells * places[n, 2] + i, cells * places[n, 1] + j, cells * places[n, 0] + k
                            edges[vertex] = ((z * size[1] + y) * size[0] + x) * 3 + axis
                            cut = field[k, j, i] / (field[k, j, i] - field[w, v, u])
                            cuts[vertex] = min(max(cut, KEEP), np.float32(1.0) - KEEP)
                        mine[axis, k, j, i] = vertex
                        vertex += 1
        for k in range(cells):
            for j in range(cells):
                for i in range(cells):
                    case = np.int64(0)
                    for c in range(8):
                        case |= np.int64(field[k + (c >> 1 & 1), j + (c & 1), i + (c >> 2)] < 0) << c
                    if write:
                        for m in range(3 * number[case]):
                            edge = corners[case, m]
                            a, b = edge & 1, edge >> 1 & 1
                            if edge < 4:
                                one = mine[0, k + b, j + a, i]
                            elif edge < 8:
                                one = mine[1, k + b, j, i + a]
                            else:
                                one = mine[2, k, j + b, i + a]
                            triangles[triangle + m // 3, m % 3] = one
                    triangle += number[case]
        if not write:
            starts[n + 1, 0] = vertex
            starts[n + 1, 1] = triangle


def brick_surface(
    brick: NDArray[np.int32], samples: NDArray[np.float32], name: str, progress: Progress | None = None
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices (n, 3), in voxels of the fine grid, and triangles (m, 3) of the surface in the bricks of a SparseField."""
    number, corners = cube_triangles()
    counting, building = stages(progress, 2)
    places = np.argwhere(brick >= 0)
    size = samples.shape[1] * np.array(brick.shape[::-1])
    starts = np.zeros((len(places) + 1, 2), dtype=np.int64)
    edges, cuts, triangles = np.empty(0, np.int64), np.empty(0, np.float32), np.empty((0, 3), np.int32)
    fixed = (places, frozen(samples), size, number, corners, starts)
    strips(_march, len(places), *fixed, edges, cuts, triangles, size=256, progress=counting)
    np.cumsum(starts, axis=0, out=starts)
    if starts[-1, 1] == 0:
        raise InputError(f"{name}: no voxel lies inside, so it has no surface; take a finer grid")
    edges, cuts = np.empty(starts[-1, 0], np.int64), np.empty(starts[-1, 0], np.float32)
    triangles = np.empty((starts[-1, 1], 3), np.int32)
    strips(_march, len(places), *fixed, edges, cuts, triangles, size=256, progress=building)
    edges, kept, one = np.unique(edges, return_index=True, return_inverse=True)
    voxel, axis = np.divmod(edges, 3)
    vertices = np.stack([voxel % size[0], voxel // size[0] % size[1], voxel // (size[0] * size[1])], axis=1).astype(np.float64)
    vertices[np.arange(len(vertices)), axis] += cuts[kept]
    return vertices, one.astype(np.int32)[triangles]
