"""Which pieces of what a transfer function shows are large enough to be rendered."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import each
from intaglio.rendering.isovalue import body_side
from intaglio.rendering.skipping import BLOCK, check_islands, large_pieces, surface_blocks
from intaglio.transfer_function import TransferFunction
from intaglio.transfer_function_2d import TransferFunction2D
from intaglio.volume import Volume

Blocks = NDArray[np.bool_]
ENTRIES = 4096


def _slab(volume: Volume, z: int, low: float, scale: float, opacity: NDArray[np.float32], out: NDArray[np.float64]) -> None:
    """Opacities summed over each block of a layer of blocks, without the voxels that a block shares with the next."""
    values = volume.samples[z * BLOCK : z * BLOCK + BLOCK]
    entry = np.clip((values - np.float32(low)) * np.float32(scale), 0, len(opacity) - 1).astype(np.int32)
    shown = opacity[entry].sum(axis=0, dtype=np.float64)
    rows = np.add.reduceat(shown, np.arange(0, shown.shape[0], BLOCK), axis=0)
    out[z] = np.add.reduceat(rows, np.arange(0, shown.shape[1], BLOCK), axis=1)[: out.shape[1], : out.shape[2]]


def shown_pieces(volume: Volume, function: TransferFunction | TransferFunction2D, visible: Blocks, islands: float) -> Blocks:
    """The visible blocks of pieces whose opacities together are at least this part of those of the piece that shows most.

    So a large but faint board is smaller than the bones that lie on it. Pieces less than a block apart count as one.
    """
    check_islands(islands)
    if islands == 0:
        return visible
    low, high = (function.low, function.high) if isinstance(function, TransferFunction2D) else volume.range
    if isinstance(function, TransferFunction2D):
        opacity = function.array[..., 3].max(axis=1)
    else:
        opacity = function.table(low, max(high, np.nextafter(low, np.inf)), ENTRIES)[:, 3]
    size = np.zeros(visible.shape)
    scale = (len(opacity) - 1) / max(high - low, 1e-30)
    each(_slab, [(volume, z, low, scale, np.ascontiguousarray(opacity), size) for z in range(len(size))])
    return large_pieces(visible, size, islands)


def surface_pieces(volume: Volume, levels: NDArray[np.float32], visible: Blocks, islands: float) -> Blocks:
    """The visible blocks of isosurfaces whose bodies are not smaller than this part of the largest one, the outermost's."""
    check_islands(islands)
    if islands == 0:
        return visible
    inside = body_side(volume)
    outermost = float(levels.min() if inside == "above" else levels.max())
    return visible & (surface_blocks(volume, outermost, islands, inside) > 0)
