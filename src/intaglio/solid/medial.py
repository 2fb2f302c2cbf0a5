"""medial_axis: the skeleton of a solid, where its closest surface changes sides."""

# M. Foskey, M. Lin, D. Manocha, "Efficient computation of a simplified medial axis", 2003: pruned by the angle at which the
# two closest points are seen.

from __future__ import annotations

import math

import numpy as np

from intaglio.compute import Progress, frozen, helper, kernel, strips
from intaglio.errors import InputError
from intaglio.solid.field import check_field, grid_spacing
from intaglio.volume import Volume

# By how much one axis has to be more across a sheet than the one before.
TIE = 1.02
# Voxels below the surface where the axis begins; above, steps of the grid pass for two sides.
SHALLOW = 1.5


@helper
def _upwards(voxels, spacing, x, y, z):  # type: ignore[no-untyped-def]
    """The unit vector to the closest point of the surface.

    Of the eight gradients that differences to one side give, the one whose length is nearest to 1: the sides of that one have the
    same closest surface.
    """
    nz, ny, nx = voxels.shape
    here = voxels[z, y, x]
    best = np.inf
    a = b = c = 0.0
    for octant in range(8):
        i, j, k = 2 * (octant & 1) - 1, (octant & 2) - 1, (octant >> 1 & 2) - 1
        if x + i < 0 or x + i >= nx or y + j < 0 or y + j >= ny or z + k < 0 or z + k >= nz:
            continue
        u = i * (voxels[z, y, x + i] - here) / spacing[0]
        v = j * (voxels[z, y + j, x] - here) / spacing[1]
        w = k * (voxels[z + k, y, x] - here) / spacing[2]
        size = math.sqrt(u * u + v * v + w * w)
        if size > 0.0 and abs(size - 1.0) < best:
            best = abs(size - 1.0)
            a, b, c = u / size, v / size, w / size
    return a, b, c


@kernel
def _medial(begin, end, voxels, spacing, shallow, least, out):  # type: ignore[no-untyped-def]
    """out = 1 where the way to the surface turns by more than the angle (cosine `least`) to a neighbour's that is no deeper."""
    nz, ny, nx = voxels.shape
    for z in range(begin, end):
        for y in range(ny):
            for x in range(nx):
                here = voxels[z, y, x]
                if here > -shallow:
                    continue
                a, b, c = _upwards(voxels, spacing, x, y, z)
                for side in range(6):
                    step = 2 * (side & 1) - 1
                    i = x + step if side < 2 else x
                    j = y + step if side // 2 == 1 else y
                    k = z + step if side >= 4 else z
                    if i < 0 or i >= nx or j < 0 or j >= ny or k < 0 or k >= nz:
                        continue
                    there = voxels[k, j, i]
                    # Of two equally deep ones the first; and only where the ways part, not where they meet.
                    if there < here or (there == here and step < 0):
                        continue
                    u, v, w = _upwards(voxels, spacing, i, j, k)
                    # Along the axis that is most across the sheet; the others would make stairs of it. Of equal ones the first.
                    p, q, r = TIE * TIE * (u - a), TIE * (v - b), w - c
                    apart = step * (p if side < 2 else q if side < 4 else r)
                    if apart > 0.0 and apart >= max(abs(p), max(abs(q), abs(r))) and a * u + b * v + c * w < least:
                        out[z, y, x] = 1
                        break


def medial_axis(field: Volume, angle: float = 60.0, *, progress: Progress | None = None) -> Volume:
    """The places in a solid that have two closest points on its surface, as a mask on the field's grid: sheets one voxel thick.

    field  signed distances in mm, negative inside; those of `redistance` or `signed_distance` after csg
    angle  degrees, more than 0, less than 180: the least at which the two closest points are seen from there. Small angles
           keep branches into every edge and bump; large ones only what lies between opposite walls
    Found to a voxel; begins 1.5 voxels below the surface. InputError for volumes that are no fields.
    """
    if not 0 < angle < 180:
        raise InputError(f"angle must be above 0 and below 180 degrees, not {angle!r}")
    spacing = grid_spacing(check_field(field)).astype(np.float64)
    out = np.zeros(field.shape, dtype=np.uint8)
    voxels = frozen(field.samples.astype(np.float32, copy=False))
    least = math.cos(math.radians(angle))
    strips(_medial, len(out), voxels, spacing, SHALLOW * float(spacing.min()), least, out, size=4, progress=progress)
    return Volume(out.view(np.bool_), field.world_from_index, field.name)
