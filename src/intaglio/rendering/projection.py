"""Projections without opacity: the largest, the smallest or the mean value along each ray."""

# J. Wallis et al., "Three-dimensional display in nuclear medicine", 1989 (maximum intensity projection).

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from intaglio.camera import Camera
from intaglio.compute import Progress, frozen, kernel, lanes, tiles
from intaglio.rendering.cutting import kept
from intaglio.rendering.first_hit import next_block, ray_at, span
from intaglio.rendering.packets import LANES, flat, values
from intaglio.rendering.skipping import min_max_blocks
from intaglio.selection import Selection, packed_selections
from intaglio.volume import Volume

Projection = Literal["mip", "minip", "average"]


@kernel
def _project(y0, y1, x0, x1, voxels, grid, shape, low, high, heads, data, index_rays, way, step, out):  # type: ignore[no-untyped-def]
    """One tile of out (h, w), NaN where the ray meets nothing. way: 1 largest, -1 smallest, 0 mean. step in voxels."""
    cut = heads.shape[0] > 0
    ray = np.empty(6)
    shift = np.zeros(3)
    value = lanes()
    for py in range(y0, y1):
        for px in range(x0, x1):
            ray_at(index_rays, px + 0.5, py + 0.5, ray)
            near, far = span(ray, shape, 0.0)
            if not near < far:
                continue
            dt = step / math.sqrt(ray[3] ** 2 + ray[4] ** 2 + ray[5] ** 2)
            total = max(int(math.ceil((far - near) / dt - 1e-6)), 1)
            dt = (far - near) / total
            # A mean's samples stand for the parts around them; those of an extreme reach from face to face.
            first = 0.5 if way == 0 else 0.0
            samples = total if way == 0 else total + 1
            best = np.float32(-np.inf if way > 0 else np.inf)
            mean = 0.0
            number = 0
            t = near
            k = 0
            while k < samples:
                bz, by, bx, until = next_block(ray, shape, t, 1e-6 * dt)
                end = min(int(math.ceil((until - near) / dt - first)), samples) if until < far else samples
                t = until
                if (way > 0 and high[bz, by, bx] <= best) or (way < 0 and low[bz, by, bx] >= best):
                    k = max(k, end)
                    continue
                if way == 0 and not cut and low[bz, by, bx] == high[bz, by, bx]:
                    mean += float(low[bz, by, bx]) * max(end - k, 0)
                    number += max(end - k, 0)
                    k = max(k, end)
                    continue
                while k < end:
                    count = min(end - k, LANES)
                    values(voxels, grid, ray, near + (k + first) * dt, dt, count, shift, value)
                    for lane in range(count):
                        if cut:
                            at = near + (k + first + lane) * dt
                            if kept(heads, data, ray[0] + at * ray[3], ray[1] + at * ray[4], ray[2] + at * ray[5]) < 0.0:
                                continue
                        number += 1
                        if way > 0:
                            best = max(best, value[lane])
                        elif way < 0:
                            best = min(best, value[lane])
                        else:
                            mean += value[lane]
                    k += count
            if way == 0 and number > 0:
                out[py, px] = mean / number
            elif way != 0 and number > 0:
                out[py, px] = best


def projection(
    volume: Volume,
    camera: Camera,
    mode: Projection,
    *,
    step: float = 0.5,
    selections: Sequence[Selection] = (),
    progress: Progress | None = None,
) -> NDArray[np.float32]:
    """(h, w) float32 of projected values, NaN where the ray meets nothing; step in voxels.

    What selections cut away does not count. Blocks that cannot change a maximum or minimum, and constant blocks of a mean,
    are not sampled.
    """
    z, y, x = volume.shape
    index_rays = camera.rays() @ volume.index_from_world[:3, :3].T
    index_rays[0] += volume.index_from_world[:3, 3]
    low, high = (block.astype(np.float32) for block in min_max_blocks(volume))
    w, h = camera.size
    out = np.full((h, w), np.nan, dtype=np.float32)
    grid = np.array([x, x * y, x - 1, y - 1, z - 1], dtype=np.float64)
    tools = packed_selections(selections, volume)
    way = {"mip": 1, "minip": -1, "average": 0}[mode]
    tiles(
        _project, (h, w), flat(volume), grid, volume.shape, frozen(low), frozen(high), *tools, index_rays,
        way, float(step), out, progress=progress,
    )  # fmt: skip
    return out
