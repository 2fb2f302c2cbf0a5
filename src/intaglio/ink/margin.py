"""How far a place of a surface is from where the surface ends, so that ink can end there too."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import kernel, strips


@kernel
def _spread(y0, y1, edge, reach, out):  # type: ignore[no-untyped-def]
    """out = min of it and the distance to each crossing, for the rows of a strip."""
    h, w = out.shape
    around = int(math.ceil(reach))
    for y in range(max(0, y0 - around - 1), min(h, y1 + around + 1)):
        for x in range(w):
            for side in range(2):
                part = edge[y, x, side]
                if not part >= np.float32(0.0):
                    continue
                # In pixels whose centres are whole numbers.
                cx = x + part * (1 - side)
                cy = y + part * side
                for j in range(max(y0, y - around), min(y1, y + around + 2)):
                    for i in range(max(0, x - around), min(w, x + around + 2)):
                        dx, dy = i - cx, j - cy
                        out[j, i] = min(out[j, i], np.float32(math.sqrt(dx * dx + dy * dy)))


def margin(edge: NDArray[np.float32], reach: float) -> NDArray[np.float32]:
    """(h, w) pixels from each pixel's centre to the nearest crossing of a G-buffer's edges (h, w, 2), at most `reach`."""
    out = np.full(edge.shape[:2], reach, dtype=np.float32)
    strips(_spread, len(edge), edge, float(reach), out, size=64)
    return out
