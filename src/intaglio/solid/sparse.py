"""SparseField: a signed distance field that has voxels only about its surface."""

# S. Frisken et al., "Adaptively sampled distance fields", 2000 (detail where the surface is).
# K. Museth, "VDB: high-resolution sparse volumes with dynamic topology", 2013 (bricks of voxels below a table).

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from intaglio.compute import Progress, frozen, kernel, strips
from intaglio.errors import InputError
from intaglio.mesh import TriangleMesh
from intaglio.sampling import trilinear
from intaglio.solid.brick_surface import brick_surface
from intaglio.solid.field import beyond
from intaglio.solid.nearest import world
from intaglio.volume import Volume

# Cells along the side of a brick, which has one sample more: neighbours share those on their common faces. Two boxes of
# four samples, which is what distances are taken for at once.
CELLS = 7
SIDE = CELLS + 1


@kernel
def _value(brick, samples, coarse, step, x, y, z):  # type: ignore[no-untyped-def]
    """The field at (x, y, z) in voxels; outside of the grid a lower bound of the distance, as in resample.py."""
    nz, ny, nx = brick.shape
    a, b, c = beyond(x, CELLS * nx + 1), beyond(y, CELLS * ny + 1), beyond(z, CELLS * nz + 1)
    x = min(max(x, 0.0), CELLS * nx)
    y = min(max(y, 0.0), CELLS * ny)
    z = min(max(z, 0.0), CELLS * nz)
    i, j, k = min(int(x) // CELLS, nx - 1), min(int(y) // CELLS, ny - 1), min(int(z) // CELLS, nz - 1)
    n = brick[k, j, i]
    if n >= 0:
        d = trilinear(samples[n], x - CELLS * i, y - CELLS * j, z - CELLS * k)
    else:
        d = trilinear(coarse, x / CELLS, y / CELLS, z / CELLS)
    away = (a * a + b * b + c * c) * step * step
    if away > 0.0:
        d = math.sqrt(max(d, 0.0) ** 2 + away)
    return d


@kernel
def _at(begin, end, brick, samples, coarse, step, points, out):  # type: ignore[no-untyped-def]
    for p in range(begin, end):
        out[p] = _value(brick, samples, coarse, step, points[p, 0], points[p, 1], points[p, 2])


@kernel
def _slopes(begin, end, brick, samples, coarse, step, points, out):  # type: ignore[no-untyped-def]
    """Central differences over one voxel."""
    for p in range(begin, end):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        for axis in range(3):
            a, b, c = 0.5 * (axis == 0), 0.5 * (axis == 1), 0.5 * (axis == 2)
            after = _value(brick, samples, coarse, step, x + a, y + b, z + c)
            out[p, axis] = after - _value(brick, samples, coarse, step, x - a, y - b, z - c)


@kernel
def _on_grid(begin, end, brick, samples, coarse, step, m, out):  # type: ignore[no-untyped-def]
    for k in range(begin, end):
        for j in range(out.shape[1]):
            for i in range(out.shape[2]):
                x, y, z = world(m, i, j, k)
                out[k, j, i] = _value(brick, samples, coarse, step, x, y, z)


def _point(value: ArrayLike, name: str) -> NDArray[np.float64]:
    point = np.asarray(value, dtype=np.float64)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise InputError(f"{name} must be a point of three numbers in mm, not {point.tolist()}")
    return point


@dataclass(frozen=True, eq=False)
class SparseField:
    """Signed distances in mm, negative inside, on a fine grid of which only bricks about the surface are there.

    brick             (z, y, x) int32, the number of the brick that holds 7 x 7 x 7 cells of the fine grid, or -1
    samples           (n, 8, 8, 8) float32, the distances in each brick; its last are the first of the next, whose they are
    coarse            (z + 1, y + 1, x + 1) float32, the distances at the corners of all bricks, there or not
    shape             voxels of the fine grid along (z, y, x)
    world_from_index  4x4 float64; takes the index (x, y, z) of a voxel of the fine grid to RAS+ mm

    In a brick the field is trilinear between voxels, elsewhere between corners of bricks: continuous among bricks, but for the
    rounding of np.float32, and among places without one. From the one to the other it jumps by the error of the latter. This is
    below 0.87 of a brick's side, 6.1 voxels, mostly a tenth of a voxel, and largest in folds of the surface; for a closed mesh
    the sign is right. Gradients across such a seam are off by as much. Outside of the grid the field is, but for that error, a
    lower bound of the distance.
    """

    brick: NDArray[np.int32]
    samples: NDArray[np.float32]
    coarse: NDArray[np.float32]
    shape: tuple[int, int, int]
    world_from_index: NDArray[np.float64]
    name: str = "field"
    notes: tuple[str, ...] = ()

    @property
    def spacing(self) -> float:
        """Distance in mm of neighbouring voxels."""
        return float(np.linalg.norm(self.world_from_index[:3, 0]))

    @property
    def nbytes(self) -> int:
        """Bytes that the field takes."""
        return self.brick.nbytes + self.samples.nbytes + self.coarse.nbytes

    def at(self, points: ArrayLike) -> NDArray[np.float32]:
        """(n,) distances in mm at points (n, 3), RAS+ mm, anywhere."""
        index = self._index(points)
        out = np.empty(len(index), dtype=np.float32)
        strips(_at, len(index), *self._arrays, index, out, size=1 << 15)
        return out

    def gradient(self, points: ArrayLike) -> NDArray[np.float32]:
        """(n, 3) gradients at points (n, 3), RAS+ mm: central differences over one voxel, of length 1 but for their error."""
        index = self._index(points)
        out = np.empty((len(index), 3))
        strips(_slopes, len(index), *self._arrays, index, out, size=1 << 15)
        return (out @ np.linalg.inv(self.world_from_index[:3, :3])).astype(np.float32)

    def volume(
        self,
        low: ArrayLike | None = None,
        high: ArrayLike | None = None,
        *,
        like: Volume | None = None,
        progress: Progress | None = None,
    ) -> Volume:
        """The field as an ordinary volume of np.float32, for whatever takes one.

        low, high  opposite corners of a box, RAS+ mm: those voxels of the fine grid that lie in it; all without
        like       or a volume whose grid is taken, turned or sheared as it may be; the field is sampled once
        InputError if the box holds fewer than two voxels along an axis.
        """
        if like is not None:
            if not isinstance(like, Volume) or low is not None or high is not None:
                raise InputError(f"like must be a Volume, without low and high, not {like!r}")
            shape, placed = like.shape, like.world_from_index
            matrix = np.linalg.inv(self.world_from_index) @ placed
        else:
            first, last = np.zeros(3), np.array(self.shape[::-1]) - 1.0
            if low is not None:
                first = np.maximum(first, np.ceil(self._index(_point(low, "low")[None])[0] - 1e-6))
            if high is not None:
                last = np.minimum(last, np.floor(self._index(_point(high, "high")[None])[0] + 1e-6))
            if (last - first < 1).any():
                raise InputError(
                    f"{self.name}: the box from {low!r} to {high!r} must hold two voxels of the grid along each axis"
                )
            x, y, z = (int(n) for n in last - first + 1)
            shape, matrix = (z, y, x), np.eye(4)
            matrix[:3, 3] = first
            placed = self.world_from_index @ matrix
        out = np.empty(shape, dtype=np.float32)
        strips(_on_grid, shape[0], *self._arrays, frozen(matrix), out, size=2, progress=progress)
        return Volume(out, placed, self.name, self.notes, distances=True)

    def surface(self, *, progress: Progress | None = None) -> TriangleMesh:
        """The body's surface as a mesh, brick by brick, as `ig.surface` takes it from the whole grid.

        Oriented and, if the mesh behind the field was closed, closed and manifold; that of an open one ends where the field
        changes its sign without bricks. Raises InputError where no voxel of a brick lies inside.
        """
        index, triangles = brick_surface(self.brick, self.samples, self.name, progress)
        vertices = index @ self.world_from_index[:3, :3].T + self.world_from_index[:3, 3]
        normals = self.gradient(vertices)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.float32(1e-20))
        return TriangleMesh(vertices, triangles, self.name, normals=normals)

    @property
    def _arrays(self) -> tuple[Any, ...]:
        return frozen(self.brick), frozen(self.samples), frozen(self.coarse), self.spacing

    def _index(self, points: ArrayLike) -> NDArray[np.float64]:
        place = np.asarray(points, dtype=np.float64)
        if place.ndim != 2 or place.shape[1] != 3 or not np.isfinite(place).all():
            raise InputError(f"points must be (n, 3) finite numbers in mm, not {place.shape}")
        matrix = np.linalg.inv(self.world_from_index)
        return np.ascontiguousarray(place @ matrix[:3, :3].T + matrix[:3, 3])
