"""sparse_field: the signed distance to a mesh in bricks about its surface, and at their corners elsewhere."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress, each, kernel, strips
from intaglio.errors import InputError
from intaglio.mesh import TriangleMesh
from intaglio.solid.field import stages
from intaglio.solid.grid import extent_of, grid_around
from intaglio.solid.mesh_distance import LEAF, Asked, Box, asked, band_width, distance_field, fill_leaf, halved, pick
from intaglio.solid.nearest import CHUNK, KEPT, halve, world
from intaglio.solid.scan_conversion import scan, slabs_of
from intaglio.solid.sparse import CELLS, SIDE, SparseField
from intaglio.volume import Volume

# From a brick's middle to its corners, in voxels.
RADIUS = math.sqrt(3) / 2 * CELLS
# A distance of zero keeps its sign as this, or else two bricks might not agree on it.
TINY = np.float32(1e-30)


@kernel
def _mark(begin, end, places, inside, samples):  # type: ignore[no-untyped-def]
    """Ones for the samples of bricks begin..end, of one layer, that lie inside."""
    for n in range(begin, end):
        y, x = CELLS * places[n, 1], CELLS * places[n, 2]
        for k in range(SIDE):
            for j in range(SIDE):
                for i in range(SIDE):
                    samples[n, k, j, i] = inside[k, y + j, x + i]


def _mark_layer(slab: tuple[Any, ...], begin: int, end: int, places: Any, samples: Any, shape: Any, doubt: Any) -> None:
    inside = np.zeros((SIDE, *shape[1:]), dtype=np.uint8)
    scan(*slab, slab[0], inside, doubt)
    _mark(begin, end, places, inside, samples)


@kernel
def _fill(begin, end, boxes, starts, members, brick, shifted, matrix, frames, offsets, band, slack, samples):  # type: ignore[no-untyped-def]
    """Distances for the marks in the bricks of boxes begin..end, which have two along each axis.

    shifted  matrix of an index that is less by a half: a box of voxels reaches from half before its first to half after its
             last, and a brick only from its first sample to its last
    """
    squares = np.empty((27, KEPT + CHUNK), dtype=np.float32)
    best = np.empty(LEAF * LEAF * LEAF, dtype=np.float32)
    index = np.empty(LEAF * LEAF * LEAF, dtype=np.int32)
    inside = np.empty((SIDE, SIDE, SIDE), dtype=np.uint8)
    closest = np.empty((0, 0, 0), dtype=np.int32)
    for b in range(begin, end):
        near = members[starts[b] : starts[b + 1]]
        size = len(near)
        lists = np.empty((2, size), dtype=np.int32)
        masks = np.empty((2, size), dtype=np.uint8)
        x, y, z = boxes[b]
        halve(CELLS * x, CELLS * y, CELLS * z, 2 * CELLS, shifted, near, size, frames, band, slack, squares, masks[0])
        for half in range(8):
            u, v, w = x + (half & 1), y + (half >> 1 & 1), z + (half >> 2)
            if u >= brick.shape[2] or v >= brick.shape[1] or w >= brick.shape[0] or brick[w, v, u] < 0:
                continue
            field = samples[brick[w, v, u]]
            count = pick(near, size, masks[0], half, lists[0])
            halve(CELLS * u, CELLS * v, CELLS * w, CELLS, shifted, lists[0], count, frames, band, slack, squares, masks[1])
            for k in range(SIDE):
                for j in range(SIDE):
                    for i in range(SIDE):
                        inside[k, j, i] = np.uint8(field[k, j, i])
            for leaf in range(8):
                i, j, k = LEAF * (leaf & 1), LEAF * (leaf >> 1 & 1), LEAF * (leaf >> 2)
                left = pick(lists[0], count, masks[1], leaf, lists[1])
                middle = LEAF * 0.5 - 0.5
                cx, cy, cz = world(matrix, CELLS * u + i + middle, CELLS * v + j + middle, CELLS * w + k + middle)
                fill_leaf(i, j, k, cx, cy, cz, lists[1], left, frames, offsets, best, index, band, inside, field, closest)
            for k in range(SIDE):
                for j in range(SIDE):
                    for i in range(SIDE):
                        if field[k, j, i] == 0:
                            field[k, j, i] = -TINY if inside[k, j, i] else TINY


def _wanted(mesh: TriangleMesh, corners: Volume, step: float, band: float, progress: Progress | None) -> NDArray[np.bool_]:
    """Which bricks come within the band of the surface, or nearly: asked at their middles."""
    matrix = corners.world_from_index.copy()
    matrix[:3, 3] += matrix[:3, :3] @ np.full(3, 0.5)
    middles = Volume(corners.array, matrix)
    # A hundredth of a voxel for rounding.
    reach = band + (RADIUS + 0.01) * step
    field = distance_field(mesh, like=middles, band=f"{1.1 * reach!r}mm", progress=progress)
    near: NDArray[np.bool_] = np.abs(field.array[:-1, :-1, :-1]) <= reach
    return near


def _boxes(mine: Asked, brick: NDArray[np.int32], shifted: Any, band: float) -> tuple[Any, Any, Any]:
    """Boxes of two bricks along each axis that hold any: first brick (n, 3), and their triangles, members[starts[n] :]."""
    z, y, x = (CELLS * n for n in brick.shape)
    side = 2
    while side < max(brick.shape):
        side *= 2
    boxes: list[Box] = [((0, 0, 0), np.arange(len(mine.frames), dtype=np.int32))]
    while side > 2:
        boxes = halved(boxes, CELLS * side, (z, y, x), shifted, mine.frames, band, mine.slack)
        side //= 2
        kept = []
        for place, near in boxes:
            i, j, k = (n // CELLS for n in place)
            if brick[k : k + side, j : j + side, i : i + side].max() >= 0:
                kept.append((place, near))
        boxes = kept
    starts = np.cumsum([0, *(len(near) for _, near in boxes)])
    return np.array([place for place, _ in boxes]) // CELLS, starts, np.concatenate([near for _, near in boxes])


def sparse_field(
    mesh: TriangleMesh,
    *,
    resolution: int | None = None,
    spacing: float | None = None,
    band: float | str | None = None,
    progress: Progress | None = None,
) -> SparseField:
    """The signed distance to a mesh on a fine grid, kept only about the surface: what memory it takes grows with that.

    resolution, spacing  the fine grid, as for distance_field
    band      how far from the surface every voxel is kept: a part of the mesh's longest extent, or mm such as "5mm"; without
              one, half a voxel, so that gradients on the surface are taken from kept ones
    progress  called with parts of the work done and in all

    Kept voxels have the values of distance_field, exact up to the rounding of np.float32. Elsewhere the field interpolates
    distances that are exact at every seventh voxel. See SparseField for what holds between the two. Besides the voxels, every
    343 cells of the grid take 8 bytes. The sign is that of voxelize, notes included; across a hole of an open mesh it changes
    where the distance is not zero, and away from the band only as finely as every seventh voxel.
    Raises InputError as distance_field does. Source: after Frisken et al. 2000.
    """
    shape, matrix = grid_around(mesh, resolution, spacing, None)
    step = float(matrix[0, 0])
    width = step / 2 if band is None else band_width(band, extent_of(mesh))
    if not math.isfinite(width):
        raise InputError('band must be finite in a sparse field; for "full" take distance_field')
    count = np.array([-(-(n - 1) // CELLS) for n in shape])
    z, y, x = (int(n) for n in CELLS * count + 1)
    whole = z, y, x
    asking, finding, marking, filling = stages(progress, 4)
    corners = Volume(np.broadcast_to(np.False_, tuple(count + 1)), matrix @ np.diag([CELLS, CELLS, CELLS, 1.0]))
    coarse = distance_field(mesh, like=corners, band="full", progress=asking).array
    wanted = _wanted(mesh, corners, step, width, finding)
    places = np.argwhere(wanted)
    brick = np.full(wanted.shape, -1, dtype=np.int32)
    brick[wanted] = np.arange(len(places))
    samples = np.zeros((len(places), SIDE, SIDE, SIDE), dtype=np.float32)

    slabs = slabs_of(mesh, whole, matrix, CELLS, shared=1)
    doubt = np.zeros((count[0], SIDE), dtype=np.int64)
    first = np.searchsorted(places[:, 0], np.arange(count[0] + 1))
    jobs = []
    for slab in slabs.jobs:
        layer = slab[0] // CELLS
        jobs.append((slab, first[layer], first[layer + 1], places, samples, whole, doubt[layer]))
    each(_mark_layer, jobs, progress=marking)
    some = bool(samples.any() or (coarse < 0).any())
    notes = slabs.notes_with(some, int(doubt[:, :CELLS].sum()))

    mine = asked(mesh, whole, matrix)
    shifted = mine.matrix.copy()
    shifted[:3, 3] += shifted[:3, :3] @ np.full(3, 0.5)
    shifted.flags.writeable = False
    # Of a brick that is kept, all samples are as near as this.
    reach = width + (2 * RADIUS + 0.1) * step
    boxes, starts, members = _boxes(mine, brick, shifted, reach)
    strips(
        _fill, len(boxes), boxes, starts, members, brick, shifted, mine.matrix, mine.frames, mine.offsets, reach, mine.slack,
        samples, size=8, progress=filling,
    )  # fmt: skip
    return SparseField(brick, samples, coarse, shape, matrix, f"distance to {mesh.name}", notes)
