"""Closest points on an isosurface: by Newton's method on the tricubic field."""

# D. Chopp, "Some improvements of the fast marching method", 2001; R. Saye, "High-order methods for computing distances to
# implicitly defined surfaces", 2014: a step to the surface along the gradient and a step along the surface to below the point.

from __future__ import annotations

import math

import numpy as np

from intaglio.compute import helper, kernel
from intaglio.sampling import tricubic

# Steps, the longest of them in voxels, and how near to the surface counts as on it.
STEPS = 12
LONGEST = 0.7
CLOSE = 1e-3


@kernel
def closest_point(voxels, iso, spacing, p, start, weights, spline, out):  # type: ignore[no-untyped-def]
    """out = the surface's point next to p, from `start` on; its distance in mm, or inf where that leads nowhere.

    All in index space but for the distance. spline is scratch (10,), weights (3, 3, 4). The field is the tricubic B-spline,
    corrected to fourth order by a sixth of the Laplacian.
    """
    smallest = min(spacing[0], min(spacing[1], spacing[2]))
    for i in range(3):
        out[i] = start[i]
    for _ in range(STEPS):
        tricubic(voxels, out[0], out[1], out[2], weights, spline)
        f = spline[0] - (spline[4] + spline[5] + spline[6]) / 6.0 - iso
        gx, gy, gz = spline[1] / spacing[0], spline[2] / spacing[1], spline[3] / spacing[2]
        square = gx * gx + gy * gy + gz * gz
        if square < 1e-20:
            return np.inf
        vx, vy, vz = (p[0] - out[0]) * spacing[0], (p[1] - out[1]) * spacing[1], (p[2] - out[2]) * spacing[2]
        along = (vx * gx + vy * gy + vz * gz) / square
        tx, ty, tz = vx - along * gx, vy - along * gy, vz - along * gz
        # How far to go along the surface depends on how it bends that way: of a ball's, r / (r + distance).
        ax, ay, az = tx / spacing[0], ty / spacing[1], tz / spacing[2]
        bend = spline[4] * ax * ax + spline[5] * ay * ay + spline[6] * az * az
        bend += 2.0 * (spline[7] * ax * ay + spline[8] * ax * az + spline[9] * ay * az)
        side = tx * tx + ty * ty + tz * tz
        slow = 1.0 / max(1.0 + along * bend / max(side, 1e-20), 0.5)
        dx, dy, dz = slow * tx - f / square * gx, slow * ty - f / square * gy, slow * tz - f / square * gz
        size = math.sqrt(dx * dx + dy * dy + dz * dz)
        short = min(1.0, LONGEST * smallest / max(size, 1e-20))
        out[0] += short * dx / spacing[0]
        out[1] += short * dy / spacing[1]
        out[2] += short * dz / spacing[2]
        if size < CLOSE * smallest:
            vx, vy, vz = (p[0] - out[0]) * spacing[0], (p[1] - out[1]) * spacing[1], (p[2] - out[2]) * spacing[2]
            nz, ny, nx = voxels.shape
            if min(out[0], min(out[1], out[2])) < -0.5 or out[0] > nx - 0.5 or out[1] > ny - 0.5 or out[2] > nz - 0.5:
                return np.inf
            return math.sqrt(vx * vx + vy * vy + vz * vz)
    return np.inf


@helper
def nearest_crossing(voxels, iso, spacing, x, y, z, out):  # type: ignore[no-untyped-def]
    """out = the nearest linear crossing on the edges from a voxel to its six neighbours; its distance, inf for none."""
    nz, ny, nx = voxels.shape
    here = voxels[z, y, x] - iso
    best = np.inf
    for axis in range(3):
        for step in range(-1, 2, 2):
            i = x + step if axis == 0 else x
            j = y + step if axis == 1 else y
            k = z + step if axis == 2 else z
            if 0 <= i < nx and 0 <= j < ny and 0 <= k < nz:
                there = voxels[k, j, i] - iso
                if (here < 0.0) != (there < 0.0):
                    t = here / (here - there)
                    if t * spacing[axis] < best:
                        best = t * spacing[axis]
                        out[0], out[1], out[2] = x, y, z
                        out[axis] += step * t
    return best
