"""Files that hold signed distances: how ours say so, and how those of others are told by their values."""

# S. Osher, R. Fedkiw, "Level Set Methods and Dynamic Implicit Surfaces", 2003: |grad d| = 1 wherever d has a gradient.

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from intaglio.io.geometry import Matrix

# What a file says of itself: in NIfTI as its description, in NRRD and MetaImage as the field KEY.
KEY = "ITK_FileNotes"
MARK = "signed distance in mm, negative inside"
GUESSED = 'values change by 1 per mm: taken for distances in mm from a surface at 0, negative inside; inside="above" turns them'
# How far from 1 a slope may be, and how many of the slopes have to be that near.
SLACK = 0.1
SHARE = 0.6
# Places that are looked at, and the fewest that can tell.
PLACES = 50_000
FEWEST = 200


def are_distances(array: NDArray[np.floating], world_from_index: Matrix) -> bool:
    """Whether values of both signs have the slope of a distance, 1 per mm, at most places that have one.

    Where values stay at their smallest or largest, as beyond the band of a narrow field, there is none.
    """
    low, high = float(array.min()), float(array.max())
    if not low < 0 < high or min(array.shape) < 3:
        return False
    inner = [n - 2 for n in array.shape]
    count = int(np.prod(inner))
    # Multiples of the golden ratio spread evenly, whatever the sides of the grid.
    places = np.arange(min(count, PLACES)) * 0.6180339887498949 % 1.0 * count
    z, y, x = (i + 1 for i in np.unravel_index(places.astype(np.int64), inner))
    value = array[z, y, x]
    pairs = (
        (array[z, y, x + 1], array[z, y, x - 1]),
        (array[z, y + 1, x], array[z, y - 1, x]),
        (array[z + 1, y, x], array[z - 1, y, x]),
    )
    told = (value > low) & (value < high)
    for pair in pairs:
        for end in pair:
            told &= (end > low) & (end < high)
    if np.count_nonzero(told) < FEWEST:
        return False
    difference = np.stack([(b[told].astype(np.float64) - a[told]) / 2 for b, a in pairs], axis=1)
    slope = np.linalg.norm(difference @ np.linalg.inv(world_from_index[:3, :3]), axis=1)
    return bool((np.abs(slope - 1) <= SLACK).mean() >= SHARE)
