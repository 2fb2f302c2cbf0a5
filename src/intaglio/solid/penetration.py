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
    """depth in mm, negative for the gap between solids apart; place (3,) in RAS+ mm; direction (3,), unit, that frees the second."""

    depth: float
    place: NDArray[np.float64]
    direction: NDArray[np.float64]


def _slope(array: NDArray[Any], k: int, j: int, i: int) -> NDArray[np.float64]:
    """Differences per voxel along x, y, z at a voxel, between its neighbours as far as there are any."""
    near = array[max(k - 1, 0) : k + 2, max(j - 1, 0) : j + 2, max(i - 1, 0) : i + 2].astype(np.float64)
    middle = [min(1, c) for c in (k, j, i)]
    slope = []
    for axis in (2, 1, 0):
        line = np.moveaxis(near, axis, 0)[(slice(None), *(m for a, m in enumerate(middle) if a != axis))]
        slope.append((line[-1] - line[0]) / (len(line) - 1))
    return np.array(slope)


def penetration_depth(a: Volume, b: Volume, *, progress: Progress | None = None) -> Penetration:
    """How far two solids, given as signed distances in mm, are in each other, where, and which way b leaves a.

    depth      the greatest sum of the depths of one place in both. Round it, a ball of a and a ball of b of those radii
               overlap by as much, so no shift by less parts the solids; where they are round there, this shift does.
               Solids apart have a negative depth, the gap between them
    place      of all places with that sum, the one halfway between the surfaces; at voxels of a's grid
    direction  from a's surface outwards, at the place
    Exact to about half a voxel for exact distances. b is resampled on a's grid, beyond its own with a lower bound.
    """
    check_field(a), check_field(b)
    other = resample(b, a, progress)
    total = a.array.astype(np.float32) + other
    depth = -float(total.min())
    # Along the way from surface to surface the sum is the same but for the sampling.
    among = np.flatnonzero(total <= -depth + 0.02 * float(a.spacing.min()))
    uneven = np.abs(a.array.ravel()[among] - other.ravel()[among])
    k, j, i = np.unravel_index(among[int(uneven.argmin())], a.shape)
    place = a.world_from_index @ (i, j, k, 1.0)
    slope = _slope(a.array, k, j, i) - _slope(other, k, j, i)
    direction = a.index_from_world[:3, :3].T @ slope
    size = float(np.linalg.norm(direction))
    return Penetration(depth, place[:3], direction / size if size > 0 else np.array([0.0, 0.0, 1.0]))
