"""The exact distance to the border of a mask or a label: signed, in mm, for any spacing."""

# P. Felzenszwalb, D. Huttenlocher, "Distance transforms of sampled functions", 2012: axis by axis, the lower envelope of
# parabolas. Here their feet are not voxels but the faces between voxels, so that one pass serves both sides of the border.

from __future__ import annotations

import math

import numpy as np

from intaglio.compute import Progress, frozen, helper, kernel, strips
from intaglio.errors import InputError
from intaglio.solid.field import grid_spacing, stages
from intaglio.volume import Volume, check_volume

# Columns copied together: two cache lines.
WIDTH = 32
# More than the square of any distance; a row without border.
FAR = np.float32(1e30)
NEVER = np.float32(1e9)


@kernel
def _along_x(begin, end, mask, spacing, field):  # type: ignore[no-untyped-def]
    """field = squared distance to the nearest border in the voxel's own row, negative inside; counted in voxels, so exactly."""
    half, one = np.float32(0.5), np.float32(1.0)
    for z in range(begin, end):
        for y in range(mask.shape[1]):
            row = mask[z, y]
            out = field[z, y]
            last = row.size - 1
            far = np.float32(1e15)
            for x in range(row.size):
                if x > 0 and row[x] != row[x - 1]:
                    far = half
                out[x] = far
                far += one
            far = np.float32(1e15)
            for x in range(last, -1, -1):
                if x < last and row[x] != row[x + 1]:
                    far = half
                d = min(out[x], far) * spacing
                out[x] = -d * d if row[x] else d * d
                far += one


@helper
def _envelope(f, spacing, foot, height, begin, out):  # type: ignore[no-untyped-def]
    """out = min over the faces j of (i - foot_j)² spacing² + height_j, or |f| where that is less.

    A face's height is the lesser square of the two voxels that share it, or 0 where they are on different sides: no way from one
    side reaches beyond that, so signs need no care.
    """
    zero, half = np.float32(0.0), np.float32(0.5)
    square = spacing * spacing
    scale = half / square
    top = -1
    for i in range(f.size - 1):
        h = zero if (f[i] < zero) != (f[i + 1] < zero) else min(abs(f[i]), abs(f[i + 1]))
        if h < FAR:
            x = np.float32(i) + half
            crossing = -half
            while top >= 0:
                crossing = (foot[top] + x) * half + (h - height[top]) * scale / (x - foot[top])
                if crossing > begin[top]:
                    break
                top -= 1
            if top < 0:
                crossing = -half
            if crossing < np.float32(f.size):
                top += 1
                foot[top] = x
                height[top] = h
                begin[top] = crossing
    if top < 0:
        for i in range(f.size):
            out[i] = abs(f[i])
        return
    begin[top + 1] = NEVER
    j = 0
    for i in range(f.size):
        x = np.float32(i)
        while begin[j + 1] < x:
            j += 1
        d = x - foot[j]
        out[i] = min(abs(f[i]), d * d * square + height[j])


@kernel
def _along_columns(begin, end, field, spacing, last):  # type: ignore[no-untyped-def]
    """The middle axis of (planes, n, columns), by groups of columns counted through all planes; roots, if it is the last."""
    n = field.shape[1]
    groups = -(-field.shape[2] // WIDTH)
    column = np.empty((WIDTH, n), np.float32)
    out = np.empty((WIDTH, n), np.float32)
    foot = np.empty(n + 1, np.float32)
    height = np.empty(n + 1, np.float32)
    start = np.empty(n + 2, np.float32)
    for group in range(begin, end):
        plane = field[group // groups]
        x0 = group % groups * WIDTH
        width = min(WIDTH, field.shape[2] - x0)
        for i in range(n):
            for c in range(width):
                column[c, i] = plane[i, x0 + c]
        for c in range(width):
            _envelope(column[c], spacing, foot, height, start, out[c])
        for i in range(n):
            for c in range(width):
                d = math.sqrt(out[c, i]) if last else out[c, i]
                plane[i, x0 + c] = -d if column[c, i] < np.float32(0.0) else d


def signed_distance(volume: Volume, label: int | None = None, *, progress: Progress | None = None) -> Volume:
    """Exact distance in mm from each voxel's centre to the border of a mask or a label, negative inside; float32.

    label  the value whose voxels are the body; None for all that are not 0
    The border is the faces between voxels of the body and others, so the zero level lies half-way between their centres;
    the grid's own border is none. Any spacing; exact to float32's rounding. Memory: the result alone.
    Raises InputError if the body is empty or fills the grid, voxels are floats, or the grid's axes are not perpendicular.
    """
    check_volume(volume)
    if volume.array.dtype.kind == "f":
        raise InputError(
            f"{volume.name}: must be a mask or labels, not {volume.array.dtype}; is it a scan? its surfaces have isovalues"
        )
    spacing = grid_spacing(volume)
    if label is None and volume.array.dtype.kind == "b":
        mask = volume.array
    else:
        mask = volume.array != 0 if label is None else volume.array == label
    if not mask.any():
        what = "no voxel is set" if label is None else f"no voxel has label {label}"
        raise InputError(f"{volume.name}: {what}, so there is no body to be distant from")
    if mask.all():
        raise InputError(f"{volume.name}: all voxels are of the body, so it has no border; take a larger grid")
    z, y, x = volume.shape
    out = np.empty(volume.shape, dtype=np.float32)
    first, second, third = stages(progress, 3)
    strips(_along_x, z, frozen(mask.view(np.uint8)), spacing[0], out, size=8, progress=first)
    for planes, step, last, stage in ((out, spacing[1], False, second), (out.reshape(1, z, y * x), spacing[2], True, third)):
        groups = len(planes) * -(-planes.shape[2] // WIDTH)
        strips(_along_columns, groups, planes, step, last, size=64, progress=stage)
    return Volume(out, volume.world_from_index, volume.name, distances=True)
