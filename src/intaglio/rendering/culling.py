"""Which part of its way a ray has to look at: the depths that visible blocks cover, for each small tile of the picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from intaglio.camera import Camera
from intaglio.compute import frozen, kernel
from intaglio.rendering.skipping import BLOCK
from intaglio.volume import Volume

TILE = 16


@kernel
def _cover(blocks, centre, steps, radius, pixel, perspective, width, height, near, far):  # type: ignore[no-untyped-def]
    """Every block's ball, in the camera's frame (right, down, forward), widens the range of the tiles it may cover.

    centre (3,) of the first block in mm, steps (3, 3) to the next one along x, y, z.
    """
    rows, columns = near.shape
    for k in range(blocks.shape[0]):
        for j in range(blocks.shape[1]):
            for i in range(blocks.shape[2]):
                if blocks[k, j, i] == 0:
                    continue
                x = centre[0] + i * steps[0, 0] + j * steps[1, 0] + k * steps[2, 0]
                y = centre[1] + i * steps[0, 1] + j * steps[1, 1] + k * steps[2, 1]
                z = centre[2] + i * steps[0, 2] + j * steps[1, 2] + k * steps[2, 2]
                low, high = z - radius, z + radius
                x0, x1, y0, y1 = 0, columns, 0, rows
                if not perspective:
                    x0 = int((width / 2 + (x - radius) / pixel) / TILE)
                    x1 = int((width / 2 + (x + radius) / pixel) / TILE) + 1
                    y0 = int((height / 2 + (y - radius) / pixel) / TILE)
                    y1 = int((height / 2 + (y + radius) / pixel) / TILE) + 1
                elif low > 1e-6:
                    # The widest that the ball can look is at its near side on the outside, at its far side on the inside.
                    a, b = x - radius, x + radius
                    x0 = int((width / 2 + a / (pixel * (low if a < 0.0 else high))) / TILE)
                    x1 = int((width / 2 + b / (pixel * (high if b < 0.0 else low))) / TILE) + 1
                    a, b = y - radius, y + radius
                    y0 = int((height / 2 + a / (pixel * (low if a < 0.0 else high))) / TILE)
                    y1 = int((height / 2 + b / (pixel * (high if b < 0.0 else low))) / TILE) + 1
                for row in range(max(y0, 0), min(y1, rows)):
                    for column in range(max(x0, 0), min(x1, columns)):
                        near[row, column] = min(near[row, column], low)
                        far[row, column] = max(far[row, column], high)


def tile_depths(volume: Volume, blocks: NDArray[Any], camera: Camera) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Nearest and farthest depth (mm) of the blocks that are not 0, for tiles of 16 x 16 pixels; inf, -inf where none is."""
    w, h = camera.size
    near = np.full((-(-h // TILE), -(-w // TILE)), np.inf)
    far = np.full_like(near, -np.inf)
    frame = np.stack([camera.right, -camera.up, camera.forward], axis=1)
    step = BLOCK * volume.world_from_index[:3, :3]
    first = volume.world_from_index[:3, :3] @ np.full(3, BLOCK / 2) + volume.world_from_index[:3, 3]
    # Half the longest diagonal of a block, sheared grids included.
    diagonals = step @ np.array([(1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)]).T
    radius = float(np.linalg.norm(diagonals, axis=0).max()) / 2 * 1.0001
    _cover(
        frozen(blocks).view(np.uint8), (first - camera.eye) @ frame, step.T @ frame, radius, camera.pixel,
        camera.projection == "perspective", float(w), float(h), near, far,
    )  # fmt: skip
    return near, far
