"""How much line lies where: length for each unit of area."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from intaglio.compute import kernel
from intaglio.ink.strokes import sample

Floats = NDArray[np.float32]

# Cells of the grid for each distance of lines, and the distance over which lines flow together: less shows single lines.
CELLS = 2.0
SPREAD = 0.7


@dataclass(frozen=True, eq=False)
class LineDensity:
    """Length of lines for each area, in 1/pixel, on a grid of square cells with a side in pixels."""

    grid: Floats
    cell: float

    def at(self, points: Floats) -> Floats:
        """(n,) values at points (n, 2) in pixels."""
        return sample(self.grid, points / np.float32(self.cell))


@kernel
def _lay(points, weight, offsets, inverse, grid):  # type: ignore[no-untyped-def]
    """Share the weighted length of every segment among the four cells about its middle."""
    h, w = grid.shape
    for line in range(len(offsets) - 1):
        for p in range(offsets[line], offsets[line + 1] - 1):
            dx = points[p + 1, 0] - points[p, 0]
            dy = points[p + 1, 1] - points[p, 1]
            length = 0.5 * (weight[p] + weight[p + 1]) * np.sqrt(dx * dx + dy * dy)
            x = min(max((points[p, 0] + 0.5 * dx) * inverse - 0.5, 0.0), w - 1.001)
            y = min(max((points[p, 1] + 0.5 * dy) * inverse - 0.5, 0.0), h - 1.001)
            i = int(x)
            j = int(y)
            u = x - i
            v = y - j
            grid[j, i] += length * (1 - u) * (1 - v)
            grid[j, min(i + 1, w - 1)] += length * u * (1 - v)
            grid[min(j + 1, h - 1), i] += length * (1 - u) * v
            grid[min(j + 1, h - 1), min(i + 1, w - 1)] += length * u * v


@kernel
def _count(allowed, inverse, grid):  # type: ignore[no-untyped-def]
    h, w = allowed.shape
    for y in range(h):
        j = int((y + 0.5) * inverse)
        for x in range(w):
            grid[j, int((x + 0.5) * inverse)] += np.float32(allowed[y, x])


@dataclass(frozen=True, eq=False)
class Ground:
    """The area that lines are to fill, on a grid of cells, smoothed as they are, so that beside it nothing is missing."""

    area: Floats
    cell: float
    spread: float

    @classmethod
    def of(cls, region: NDArray[np.bool_], separation: float) -> Ground:
        """For lines about `separation` pixels apart in a region (h, w)."""
        h, w = region.shape
        cell = max(separation / CELLS, 1.0)
        area = np.zeros((int(h / cell) + 1, int(w / cell) + 1), dtype=np.float32)
        _count(region.view(np.uint8), 1.0 / cell, area)
        spread = SPREAD * separation / cell
        return cls(np.maximum(_smoothed(area, spread), np.float32(1e-3)), cell, spread)

    def lines(self, points: Floats, weight: Floats, offsets: NDArray[np.int64]) -> LineDensity:
        """Density of lines: points (n, 2) in pixels; weight (n,) of a line there, as a part of a whole one."""
        length = np.zeros_like(self.area)
        _lay(points, weight, offsets, 1.0 / self.cell, length)
        return LineDensity(_smoothed(length, self.spread) / self.area, self.cell)


def _smoothed(grid: Floats, spread: float) -> Floats:
    return np.asarray(ndimage.gaussian_filter(grid, spread, mode="constant", truncate=3.0), dtype=np.float32)
