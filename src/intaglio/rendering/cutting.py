"""What selections leave of a volume, asked at its indices."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import kernel
from intaglio.rendering.skipping import BLOCK, INSIDE, SURFACE
from intaglio.volume import Volume

# Outside a tool's grid, mm.
FAR = 1e6


@kernel
def kept(heads, data, x, y, z):  # type: ignore[no-untyped-def]
    """Distance in mm, as far as the tools know it, to the nearest cut: positive where the volume is kept."""
    least = 1e30
    for n in range(heads.shape[0]):
        head = heads[n]
        if head[0] == 0.0:
            value = head[8] * x + head[9] * y + head[10] * z + head[11]
        else:
            nx, ny, nz = int(head[2]), int(head[3]), int(head[4])
            u = head[8] * x + head[9] * y + head[10] * z + head[11]
            v = head[12] * x + head[13] * y + head[14] * z + head[15]
            w = head[16] * x + head[17] * y + head[18] * z + head[19]
            if u < 0.0 or v < 0.0 or w < 0.0 or u > nx - 1.0 or v > ny - 1.0 or w > nz - 1.0:
                value = FAR
            else:
                i, j, k = min(int(u), nx - 2), min(int(v), ny - 2), min(int(w), nz - 2)
                u, v, w = u - i, v - j, w - k
                b = int(head[1]) + (k * ny + j) * nx + i
                c = b + ny * nx
                low = (data[b] * (1 - u) + data[b + 1] * u) * (1 - v) + (data[b + nx] * (1 - u) + data[b + nx + 1] * u) * v
                high = (data[c] * (1 - u) + data[c + 1] * u) * (1 - v) + (data[c + nx] * (1 - u) + data[c + nx + 1] * u) * v
                value = low * (1 - w) + high * w
        least = min(least, head[5] * value)
    return least


@kernel
def slopes_of_cut(heads, data, ray, t, fade, lane, gx, gy, gz):  # type: ignore[no-untyped-def]
    """The gradient that a cut face has in index space, steep enough to count in full."""
    x, y, z = ray[0] + t * ray[3], ray[1] + t * ray[4], ray[2] + t * ray[5]
    dx = kept(heads, data, x + 0.5, y, z) - kept(heads, data, x - 0.5, y, z)
    dy = kept(heads, data, x, y + 0.5, z) - kept(heads, data, x, y - 0.5, z)
    dz = kept(heads, data, x, y, z + 0.5) - kept(heads, data, x, y, z - 0.5)
    # Away from its own edge a binary tool does not know how far it is.
    if dx * dx + dy * dy + dz * dz > 1e-12:
        steep = 1e3 * (fade + 1e-6)
        gx[lane], gy[lane], gz[lane] = steep * dx, steep * dy, steep * dz


def cut_blocks(volume: Volume, blocks: NDArray[np.uint8], heads: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Blocks again, with those inside the body that a tool may cut marked as surface, and those it removes left out."""
    if len(heads) == 0:
        return blocks
    blocks = blocks.copy()
    k, j, i = (axis * BLOCK + BLOCK / 2 for axis in np.indices(blocks.shape))
    centre = np.stack([i, j, k, np.ones_like(i)], axis=-1)
    radius = BLOCK * float(np.linalg.norm(volume.spacing)) / 2 * 1.01
    near = np.zeros(blocks.shape, dtype=bool)
    for head in heads:
        if head[0] == 0.0:
            distance: NDArray[Any] = head[5] * (centre @ head[8:12])
            near |= np.abs(distance) <= radius
            blocks[distance < -radius] = 0
        else:
            # In the tool's own index space, where its grid is a box and the block a ball.
            rows = head[8:20].reshape(3, 4)
            reach = BLOCK / 2 * np.abs(rows[:, :3]).sum(axis=1) * 1.01
            place = centre @ rows.T
            touches = ((place > -reach) & (place < head[2:5] - 1 + reach)).all(axis=-1)
            near |= touches
            if head[5] < 0:
                blocks[~touches] = 0
    blocks[near & (blocks == INSIDE)] = SURFACE
    return blocks
