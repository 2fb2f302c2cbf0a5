"""A field on another grid, also where that reaches beyond its own."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress, frozen, kernel, strips
from intaglio.sampling import trilinear
from intaglio.solid.field import beyond, grid_spacing
from intaglio.solid.nearest import world
from intaglio.volume import Volume

# Voxels round the bodies that a covering grid has to hold.
MARGIN = 2


@kernel
def _resample(begin, end, voxels, field_from_grid, steps, trim, out):  # type: ignore[no-untyped-def]
    """out = the field at the grid's voxels. A body that touches the border of its grid ends there.

    The surface lies in the field's box, so that its nearest point, seen from outside, is behind the nearest one of the box by at
    least a right angle: the distance is at least the root of both squares.
    """
    nz, ny, nx = voxels.shape
    for k in range(begin, end):
        for j in range(out.shape[1]):
            for i in range(out.shape[2]):
                x, y, z = world(field_from_grid, i, j, k)
                d = trilinear(voxels, x, y, z)
                a, b, c = beyond(x, nx) * steps[0], beyond(y, ny) * steps[1], beyond(z, nz) * steps[2]
                away = a * a + b * b + c * c
                if away > 1e-12:
                    d = max(d, 0.0)
                    d = math.sqrt(d * d + away)
                elif trim:
                    depth = min(min(x, nx - 1.0 - x) * steps[0], min(y, ny - 1.0 - y) * steps[1], min(z, nz - 1.0 - z) * steps[2])
                    d = max(d, -depth)
                out[k, j, i] = d


def resample(field: Volume, grid: Volume, progress: Progress | None = None) -> NDArray[np.float32]:
    """The field's values at the voxels of `grid`: trilinear; float32, an own copy.

    Outside of its own grid a lower bound of the distance: the root of the squares of the value at the nearest point of its
    grid, if positive, and of the distance from there. A body that its grid cuts off ends at the outermost voxels, where the
    other grid goes on.
    """
    field_from_grid = field.index_from_world @ grid.world_from_index
    if field.shape == grid.shape and np.abs(field_from_grid - np.eye(4)).max() < 1e-6:
        return field.array.astype(np.float32)
    corners = (grid.corners @ field.index_from_world[:3, :3].T) + field.index_from_world[:3, 3]
    last = np.array(field.shape[::-1]) - 1.0
    trim = bool((corners < -1e-6).any() or (corners > last + 1e-6).any())
    steps = grid_spacing(field).astype(np.float64)
    out = np.empty(grid.shape, dtype=np.float32)
    voxels = frozen(field.samples.astype(np.float32, copy=False))
    strips(_resample, len(out), voxels, field_from_grid, steps, trim, out, size=4, progress=progress)
    return out


def _body_corners(field: Volume) -> NDArray[np.float64]:
    """(8, 3) or (0, 3) world corners of the box of voxels that are not outside."""
    body = field.array <= 0
    ends = []
    for axes in ((0, 1), (0, 2), (1, 2)):  # leaves x, y, z
        used = np.flatnonzero(body.any(axis=axes))
        if len(used) == 0:
            return np.empty((0, 3))
        ends.append((used[0], used[-1]))
    index = np.array([(x, y, z) for z in ends[2] for y in ends[1] for x in ends[0]], dtype=np.float64)
    return index @ field.world_from_index[:3, :3].T + field.world_from_index[:3, 3]


def covering_grid(fields: Sequence[Volume]) -> Volume:
    """The first field's grid, extended by whole voxels until it holds the bodies of all; its values mean nothing."""
    first = fields[0]
    corners = np.concatenate([_body_corners(field) for field in fields[1:]] + [first.corners])
    index = corners @ first.index_from_world[:3, :3].T + first.index_from_world[:3, 3]
    last = np.array(first.shape[::-1]) - 1
    low = np.where(index.min(axis=0) < -1e-6, np.floor(index.min(axis=0)) - MARGIN, 0).astype(int)
    high = np.where(index.max(axis=0) > last + 1e-6, np.ceil(index.max(axis=0)) + MARGIN, last).astype(int)
    world_from_index = first.world_from_index.copy()
    world_from_index[:3, 3] += first.world_from_index[:3, :3] @ low
    x, y, z = high - low + 1
    # Nothing is stored: one value, seen everywhere.
    return Volume(np.broadcast_to(np.float32(0), (z, y, x)), world_from_index, first.name)
