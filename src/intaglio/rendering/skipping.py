"""Min-max blocks: which parts of a volume can hold a surface."""

from __future__ import annotations

from typing import Any, Literal
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress, frozen, kernel, strips
from intaglio.errors import InputError
from intaglio.volume import Volume

BLOCK = 8
SURFACE, INSIDE = 1, 2

Inside = Literal["above", "below"]

_blocks: WeakKeyDictionary[Volume, tuple[NDArray[Any], NDArray[Any]]] = WeakKeyDictionary()


@kernel
def _min_max(begin, end, voxels, low, high):  # type: ignore[no-untyped-def]
    nz, ny, nx = voxels.shape
    for bz in range(begin, end):
        for by in range(low.shape[1]):
            for z in range(bz * BLOCK, min(bz * BLOCK + BLOCK + 1, nz)):
                for y in range(by * BLOCK, min(by * BLOCK + BLOCK + 1, ny)):
                    row = voxels[z, y]
                    for bx in range(low.shape[2]):
                        first = bx * BLOCK
                        a = row[first]
                        b = a
                        for x in range(first + 1, min(first + BLOCK + 1, nx)):
                            a = min(a, row[x])
                            b = max(b, row[x])
                        if z == bz * BLOCK and y == by * BLOCK:
                            low[bz, by, bx] = a
                            high[bz, by, bx] = b
                        else:
                            low[bz, by, bx] = min(low[bz, by, bx], a)
                            high[bz, by, bx] = max(high[bz, by, bx], b)


@kernel
def _fill(begin, end, voxels, blocks, iso, sign, count):  # type: ignore[no-untyped-def]
    """Voxels of the body in each block, without the layer it shares with the next one."""
    nz, ny, nx = voxels.shape
    for bz in range(begin, end):
        for by in range(blocks.shape[1]):
            for bx in range(blocks.shape[2]):
                if blocks[bz, by, bx] == INSIDE:
                    count[bz, by, bx] = BLOCK * BLOCK * BLOCK
                elif blocks[bz, by, bx] == SURFACE:
                    n = 0
                    for z in range(bz * BLOCK, min(bz * BLOCK + BLOCK, nz)):
                        for y in range(by * BLOCK, min(by * BLOCK + BLOCK, ny)):
                            for x in range(bx * BLOCK, min(bx * BLOCK + BLOCK, nx)):
                                n += sign * (voxels[z, y, x] - iso) >= 0.0
                    count[bz, by, bx] = n


def min_max_blocks(volume: Volume, progress: Progress | None = None) -> tuple[NDArray[Any], NDArray[Any]]:
    """Smallest and largest voxel of each block of 8 x 8 x 8 cells, (z, y, x); kept as long as the volume lives.

    A cell has its eight voxels at the corners, so neighbouring blocks share a layer of voxels.
    """
    if volume not in _blocks:
        z, y, x = (max(1, -(-(n - 1) // BLOCK)) for n in volume.shape)
        low = np.empty((z, y, x), dtype=volume.samples.dtype)
        high = np.empty_like(low)
        strips(_min_max, z, frozen(volume.samples), low, high, progress=progress)
        _blocks[volume] = (low, high)
    return _blocks[volume]


def surface_blocks(volume: Volume, iso: float, islands: float = 0.0, inside: Inside = "above") -> NDArray[np.uint8]:
    """What of the body is in each block: nothing (0), its surface (SURFACE), nothing else (INSIDE).

    islands  pieces of the body that have fewer voxels than this part of the largest piece are left out: dust,
             cables, the corner of a table. Pieces less than a block apart count as one.
    inside   on which side of the isovalue the body is
    """
    check_islands(islands)
    low, high = min_max_blocks(volume)
    some, all_ = (high >= iso, low >= iso) if inside == "above" else (low <= iso, high <= iso)
    blocks = some.astype(np.uint8) * SURFACE
    blocks[all_] = INSIDE
    if islands > 0:
        voxels = np.zeros(low.shape, dtype=np.int64)
        sign = 1.0 if inside == "above" else -1.0
        strips(_fill, len(low), frozen(volume.samples), blocks, float(iso), sign, voxels)
        blocks *= large_pieces(some, voxels, islands)
    return blocks


def large_pieces(some: NDArray[np.bool_], size: NDArray[Any], islands: float) -> NDArray[np.bool_]:
    """The blocks of pieces whose sizes, summed over their blocks, are at least this part of the largest one's."""
    from scipy import ndimage

    label, count = ndimage.label(some, np.ones((3, 3, 3), dtype=bool))
    if count < 2:
        return some
    total = np.bincount(label.ravel(), weights=size.ravel())
    total[0] = 0
    return some & (total >= islands * total.max())[label]


def check_islands(islands: float) -> None:
    if not 0 <= islands < 1:
        raise InputError(f"islands must be a part of the largest piece, 0 up to 1, not {islands!r}")


def surface_corners(volume: Volume, blocks: NDArray[np.uint8]) -> NDArray[np.float64]:
    """(8 n, 3) world corners of the surface's blocks: what a camera must see of it."""
    z, y, x = np.nonzero(blocks == SURFACE)
    first = np.stack([x, y, z], axis=1) * BLOCK
    last = np.minimum(first + BLOCK, np.array(volume.shape[::-1]) - 1)
    pick = np.array([(i, j, k) for k in (0, 1) for j in (0, 1) for i in (0, 1)], dtype=bool)
    index = np.where(pick[None], last[:, None], first[:, None]).reshape(-1, 3)
    return index @ volume.world_from_index[:3, :3].T + volume.world_from_index[:3, 3]
