"""A sensible surface for a scan whose isovalue nobody gave."""

# N. Otsu, "A threshold selection method from gray-level histograms", 1979.

from __future__ import annotations

import numpy as np

from intaglio.errors import InputError
from intaglio.volume import Volume

# Between air (-1000) and fat (-100): the skin in Hounsfield units.
SKIN_HU = -300.0


def body_surface(volume: Volume) -> tuple[float, str]:
    """An isovalue that parts body from surroundings, and what it is called in a message.

    In Hounsfield units that is the skin; otherwise the value that parts the histogram into its two most distinct
    classes (Otsu 1979). Raises InputError for a constant volume.
    """
    low, high = volume.range
    if low == high:
        raise InputError(f"{volume.name}: every voxel is {low:g}, so it has no surface; is this the right file?")
    if volume.array.dtype.kind in "if" and -4096 <= low <= -500 and high >= 300:
        return SKIN_HU, "skin in Hounsfield units"
    stride = max(1, round((volume.array.size / 2e6) ** (1 / 3)))
    values = volume.array[::stride, ::stride, ::stride].astype(np.float64)
    count, bound = np.histogram(values, 256, (low, high))
    centre = (bound[1:] + bound[:-1]) / 2
    share = count / count.sum()
    below = np.cumsum(share)
    mean = np.cumsum(share * centre)
    spread = (mean[-1] * below - mean) ** 2 / np.maximum(below * (1 - below), 1e-12)
    return float(f"{bound[int(np.argmax(spread)) + 1]:.4g}"), "between the two main classes of the histogram"
