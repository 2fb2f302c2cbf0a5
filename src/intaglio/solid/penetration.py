"""penetration_depth: how far two solids are in each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress
from intaglio.solid.field import check_field
from intaglio.solid.resample import resample
from intaglio.volume import Volume


@dataclass(frozen=True, eq=False)
class Penetration:
    """depth in mm, negative for a gap; place (3,) in RAS+ mm; direction (3,), unit, that frees the second solid."""

    depth: float
    place: NDArray[np.float64]
    direction: NDArray[np.float64]


def _slope(array: NDArray[Any], place: tuple[int, ...]) -> NDArray[np.float64]:
    """Differences per voxel along x, y, z at a voxel (z, y, x), between its neighbours as far as there are any."""
    slope = []
    for axis in (2, 1, 0):
        low, high = list(place), list(place)
        low[axis] = max(place[axis] - 1, 0)
        high[axis] = min(place[axis] + 1, array.shape[axis] - 1)
        slope.append((float(array[tuple(high)]) - float(array[tuple(low)])) / (high[axis] - low[axis]))
    return np.array(slope)


def penetration_depth(a: Volume, b: Volume, *, progress: Progress | None = None) -> Penetration:
    """How far two solids, given as signed distances in mm, are in each other, where, and which way b leaves a.

    depth      the greatest sum of the depths of one place in both. Round it, a ball of a and a ball of b of those radii
               overlap by as much, so no shift by less parts the solids; where they are round there, this shift does.
               Solids apart have a negative depth, the gap between them
    place      of all places with that sum, the one halfway between the surfaces; at voxels of a's grid
    direction  from a's surface outwards, at the place
    Exact to about half a voxel for exact distances. b is resampled on a's grid; where the gap between solids apart lies
    beyond b's grid, its length is a lower bound.
    """
    check_field(a), check_field(b)
    other = resample(b, a, progress)
    total = a.array.astype(np.float32) + other
    # Where they overlap both are on their own grids, where distances are more than bounds.
    overlap = np.maximum(a.array, other) < 0
    if overlap.any():
        total[~overlap] = np.inf
    depth = -float(total.min())
    # Along the way from surface to surface the sum is the same but for the sampling.
    among = np.flatnonzero(total <= -depth + 0.02 * float(a.spacing.min()))
    uneven = np.abs(a.array.ravel()[among] - other.ravel()[among])
    k, j, i = (int(c) for c in np.unravel_index(among[int(uneven.argmin())], a.shape))
    place = a.world_from_index @ (i, j, k, 1.0)
    slope = _slope(a.array, (k, j, i)) - _slope(other, (k, j, i))
    direction = a.index_from_world[:3, :3].T @ slope
    size = float(np.linalg.norm(direction))
    return Penetration(depth, place[:3], direction / size if size > 0 else np.array([0.0, 0.0, 1.0]))
