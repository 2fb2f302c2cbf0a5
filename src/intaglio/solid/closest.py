"""Closest points on an isosurface: by Newton's method on the tricubic field, or on the paraboloid about a known one."""

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


@helper
def bend(voxels, spacing, x, weights, spline, site):  # type: ignore[no-untyped-def]
    """site[3:12] = the unit normal n at x and K = P H P / |g| as xx, yy, zz, xy, xz, yz; 1/mm."""
    tricubic(voxels, x[0], x[1], x[2], weights, spline)
    a, b, c = spacing[0], spacing[1], spacing[2]
    nx, ny, nz = spline[1] / a, spline[2] / b, spline[3] / c
    size = max(math.sqrt(nx * nx + ny * ny + nz * nz), 1e-20)
    nx, ny, nz = nx / size, ny / size, nz / size
    xx, yy, zz = spline[4] / (a * a * size), spline[5] / (b * b * size), spline[6] / (c * c * size)
    xy, xz, yz = spline[7] / (a * b * size), spline[8] / (a * c * size), spline[9] / (b * c * size)
    # P H P = H - n h' - h n' + (n h) n n' with h = H n.
    hx, hy, hz = xx * nx + xy * ny + xz * nz, xy * nx + yy * ny + yz * nz, xz * nx + yz * ny + zz * nz
    s = hx * nx + hy * ny + hz * nz
    site[3], site[4], site[5] = nx, ny, nz
    site[6] = xx - 2.0 * nx * hx + s * nx * nx
    site[7] = yy - 2.0 * ny * hy + s * ny * ny
    site[8] = zz - 2.0 * nz * hz + s * nz * nz
    site[9] = xy - nx * hy - ny * hx + s * nx * ny
    site[10] = xz - nx * hz - nz * hx + s * nx * nz
    site[11] = yz - ny * hz - nz * hy + s * ny * nz


@helper
def to_paraboloid(site, px, py, pz, reach):  # type: ignore[no-untyped-def]
    """Distance from a point, given from the site, to the paraboloid that touches the surface there.

    At height a over the tangent plane and t beside the normal, the foot is at u = (I + a K)^-1 t.
    """
    nx, ny, nz = site[3], site[4], site[5]
    a = px * nx + py * ny + pz * nz
    tx, ty, tz = px - a * nx, py - a * ny, pz - a * nz
    xx, yy, zz = 1.0 + a * site[6], 1.0 + a * site[7], 1.0 + a * site[8]
    xy, xz, yz = a * site[9], a * site[10], a * site[11]
    cxx, cyy, czz = yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy
    cxy, cxz, cyz = xz * yz - xy * zz, xy * yz - xz * yy, xy * xz - xx * yz
    det = xx * cxx + xy * cxy + xz * cxz
    plain = math.sqrt(px * px + py * py + pz * pz)
    # Beyond the centre of curvature the foot is not a nearest point.
    if det < 0.01 or cxx + cyy + czz < 0.0:
        return plain
    ux = (cxx * tx + cxy * ty + cxz * tz) / det
    uy = (cxy * tx + cyy * ty + cyz * tz) / det
    uz = (cxz * tx + cyz * ty + czz * tz) / det
    if ux * ux + uy * uy + uz * uz > reach * reach:
        return plain
    sink = 0.5 * (site[6] * ux * ux + site[7] * uy * uy + site[8] * uz * uz)
    sink += site[9] * ux * uy + site[10] * ux * uz + site[11] * uy * uz
    x, y, z = px - ux + sink * nx, py - uy + sink * ny, pz - uz + sink * nz
    return min(plain, math.sqrt(x * x + y * y + z * z))
