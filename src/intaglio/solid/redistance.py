"""redistance: the distance to the isosurface of any scalar field."""

# J. Mullikin, "The vector distance transform in two and three dimensions", 1992: voxels pass closest points on to neighbours.

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import LANES, Progress, frozen, kernel, lanes, strips, thread_count
from intaglio.errors import InputError
from intaglio.solid.closest import bend, closest_point, nearest_crossing, to_paraboloid
from intaglio.solid.field import Side, check_level, grid_spacing, stages
from intaglio.volume import Volume, check_volume

# Voxels from the surface up to which the closest point is found on the field itself.
REFINED = 2.0
# How far from a known closest point, in voxels, the surface is taken to go on as a paraboloid.
REACH = 3.0
NONE = np.uint32(0)
FAR = 1e9
BLOCK = 32


@kernel
def _near(begin, end, voxels, iso, near, count):  # type: ignore[no-untyped-def]
    """near = voxels of cells that hold the surface: among the 27 about them both signs occur; count = those of a slice."""
    nz, ny, nx = voxels.shape
    inside = np.empty((3, ny, nx), np.uint8)
    total = np.empty(nx, np.int32)
    for z in range(begin, end):
        for k in range(3):
            s = min(max(z + k - 1, 0), nz - 1)
            for y in range(ny):
                for x in range(nx):
                    inside[k, y, x] = np.uint8(voxels[s, y, x] < iso)
        n = 0
        for y in range(ny):
            total[:] = 0
            for k in range(3):
                for j in range(3):
                    row = inside[k, min(max(y + j - 1, 0), ny - 1)]
                    for x in range(nx):
                        total[x] += np.int32(row[x])
            for x in range(nx):
                all_ = total[max(x - 1, 0)] + total[x] + total[min(x + 1, nx - 1)]
                mixed = 0 < all_ < 27
                near[z, y, x] = np.uint32(mixed)
                n += mixed
        count[z] = n


@kernel
def _place(begin, end, voxels, iso, spacing, first, sites, owner):  # type: ignore[no-untyped-def]
    """Columns of sites: the surface's points closest to the near voxels, in mm from the first voxel, and how it bends there."""
    nz, ny, nx = voxels.shape
    weights = np.empty((3, 3, 4))
    spline = np.empty(10)
    p = np.empty(3)
    out = np.empty(3)
    other = np.empty(3)
    limit = 2.0 * math.sqrt(spacing[0] ** 2 + spacing[1] ** 2 + spacing[2] ** 2)
    for z in range(begin, end):
        n = first[z]
        for y in range(ny):
            for x in range(nx):
                if owner[z, y, x] == NONE:
                    continue
                p[0], p[1], p[2] = x, y, z
                simple = nearest_crossing(voxels, iso, spacing, x, y, z, other)
                d = closest_point(voxels, iso, spacing, p, p, weights, spline, out)
                if d > min(limit, 1.5 * simple):
                    d = simple
                    out[:] = other
                if d < limit:
                    for i in range(3):
                        sites[i, n] = out[i] * spacing[i]
                    bend(voxels, spacing, out, weights, spline, sites[:, n])
                    owner[z, y, x] = n
                else:
                    sites[:, n] = FAR
                    owner[z, y, x] = NONE
                n += 1


@kernel
def _sweep(begin, end, k, from_, owner, u, v, w, spacing):  # type: ignore[no-untyped-def]
    """Rows of plane k take the nearer ones of the sites that the nine voxels next to each have in plane `from_`.

    u, v, w are the sites' places in the order of owner's axes. owner has a border of one voxel that owns nothing.
    """
    columns = owner.shape[2] - 2
    a = np.float32(k - 1) * spacing[0]
    best = lanes()
    which = lanes()
    for j in range(begin, end):
        b = np.float32(j) * spacing[1]
        for first in range(0, columns, LANES):
            count = min(LANES, columns - first)
            mine = owner[k, j + 1, first + 1 : first + 1 + count]
            for i in range(count):
                n = mine[i]
                x, y, z = u[n] - a, v[n] - b, w[n] - np.float32(first + i) * spacing[2]
                best[i] = x * x + y * y + z * z
                which[i] = np.float32(9.0)
            for side in range(9):
                theirs = owner[from_, j + side // 3, first + side % 3 : first + side % 3 + count]
                for i in range(count):
                    n = theirs[i]
                    x, y, z = u[n] - a, v[n] - b, w[n] - np.float32(first + i) * spacing[2]
                    d = x * x + y * y + z * z
                    nearer = d < best[i]
                    best[i] = d if nearer else best[i]
                    which[i] = np.float32(side) if nearer else which[i]
            for i in range(count):
                side = int(which[i])
                if side < 9:
                    mine[i] = owner[from_, j + side // 3, first + i + side % 3]


@kernel
def _turn(begin, end, matrix, out):  # type: ignore[no-untyped-def]
    """out = the transpose, for blocks of columns."""
    for x0 in range(begin * BLOCK, min(end * BLOCK, matrix.shape[1]), BLOCK):
        for y0 in range(0, matrix.shape[0], BLOCK):
            for x in range(x0, min(x0 + BLOCK, matrix.shape[1])):
                for y in range(y0, min(y0 + BLOCK, matrix.shape[0])):
                    out[x, y] = matrix[y, x]


def _spread(
    owner: NDArray[np.uint32], sites: NDArray[np.float32], spacing: NDArray[np.float32], progress: Progress | None
) -> NDArray[np.uint32]:
    """Each voxel's nearest site: forth and back along each axis in turn, each way as far as a cone of 45 degrees reaches."""
    total = 2 * sum(owner.shape)
    done = 0
    axes = [2, 1, 0]
    other = np.empty(owner.size, dtype=np.uint32)
    for _ in range(3):
        n, rows, columns = owner.shape
        place = [np.ascontiguousarray(sites[a]) for a in axes]
        part = -(-(rows - 2) // thread_count())
        for k, from_ in [*((k, k - 1) for k in range(2, n - 1)), *((k, k + 1) for k in range(n - 3, 0, -1))]:
            strips(_sweep, rows - 2, k, from_, owner, *place, spacing[axes], size=part)
            done += 1
            if progress:
                progress(done, total)
        turned = other.reshape(rows * columns, n)
        strips(_turn, -(-rows * columns // BLOCK), owner.reshape(n, rows * columns), turned, size=64)
        owner, other = turned.reshape(rows, columns, n), owner.reshape(-1)
        axes = [*axes[1:], axes[0]]
    return owner


@kernel
def _measure(begin, end, voxels, iso, sign, spacing, owner, sites, out):  # type: ignore[no-untyped-def]
    """Signed distances to the surface about each voxel's site."""
    weights = np.empty((3, 3, 4))
    spline = np.empty(10)
    p = np.empty(3)
    start = np.empty(3)
    found = np.empty(3)
    voxel = max(spacing[0], max(spacing[1], spacing[2]))
    for z in range(begin, end):
        for y in range(out.shape[1]):
            for x in range(out.shape[2]):
                site = sites[owner[z, y, x]]
                d = to_paraboloid(
                    site, x * spacing[0] - site[0], y * spacing[1] - site[1], z * spacing[2] - site[2], REACH * voxel
                )
                if d < REFINED * voxel:
                    p[0], p[1], p[2] = x, y, z
                    for i in range(3):
                        start[i] = site[i] / spacing[i]
                    # Not much nearer, for there may be another sheet that the site has told nothing of.
                    refined = closest_point(voxels, iso, spacing, p, start, weights, spline, found)
                    d = refined if abs(refined - d) < 0.5 * voxel else d
                out[z, y, x] = -d if sign * (voxels[z, y, x] - iso) >= 0.0 else max(d, 1e-6)


def redistance(
    volume: Volume, iso: float | None = None, *, inside: Side | None = None, progress: Progress | None = None
) -> Volume:
    """Signed distance in mm to the isosurface of a scan or of any field, negative inside, over its whole grid; float32.

    iso     None for the zero level of a field that is negative inside, such as csg leaves it; a value for the body of a scan
    inside  on which side of the isovalue the body is, where that guess is wrong
    The surface is that of the tricubic field, to fourth order. Closest points are found on it for the voxels about it and passed
    on; each voxel measures to the paraboloid about the one it gets. On smooth surfaces exact to 0.001 voxel outside
    and most of the way to the medial axis, to 0.1 at it; at edges, which a sampled field blunts, to half a voxel. Signs
    are those of the voxels. Memory: 12 bytes a voxel.
    Raises InputError if iso is outside the volume's values, or the grid's axes are not perpendicular.
    """
    check_volume(volume)
    if volume.array.dtype.kind == "b":
        raise InputError(f"{volume.name}: is a mask, which has no smooth surface; use signed_distance")
    level, sign = check_level(volume, iso, inside)
    spacing = grid_spacing(volume).astype(np.float64)
    voxels = frozen(volume.samples.astype(np.float32, copy=False))
    z = len(voxels)
    marking, placing, spreading, measuring = stages(progress, 4)
    owner = np.zeros([n + 2 for n in volume.shape], dtype=np.uint32)
    inner = owner[1:-1, 1:-1, 1:-1]
    count = np.zeros(z, dtype=np.int64)
    strips(_near, z, voxels, level, inner, count, size=4, progress=marking)
    if not count.any():
        raise InputError(f"{volume.name}: no voxels are on both sides of {level:g}, so there is no surface")
    sites = np.empty((12, int(count.sum()) + 1), dtype=np.float32)
    sites[:, NONE] = FAR
    first = np.cumsum(count) - count + 1
    strips(_place, z, voxels, level, spacing, first, sites, inner, size=2, progress=placing)
    owner = _spread(owner, sites, spacing.astype(np.float32), spreading)
    out: NDArray[np.float32] = np.empty(volume.shape, dtype=np.float32)
    about = np.ascontiguousarray(sites.T)
    strips(_measure, z, voxels, level, sign, spacing, owner[1:-1, 1:-1, 1:-1], about, out, size=2, progress=measuring)
    return Volume(out, volume.world_from_index, volume.name, distances=True)
