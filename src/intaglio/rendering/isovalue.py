"""A sensible surface for a scan whose isovalue nobody gave."""

# N. Otsu, "A threshold selection method from gray-level histograms", 1979.

from __future__ import annotations

import math

import numpy as np

from intaglio.errors import InputError
from intaglio.volume import Volume

# Between air (-1000) and fat (-100): the skin in Hounsfield units.
SKIN_HU = -300.0


def body_surface(volume: Volume) -> tuple[float, str]:
    """An isovalue that parts body from surroundings, and what it is called in a message.

    In Hounsfield units that is the skin; otherwise the value that parts the histogram into its two most distinct
    classes (Otsu 1979), half way where nothing lies between them. Raises InputError for a constant volume and for NaN.
    """
    low, high = volume.range
    if not (math.isfinite(low) and math.isfinite(high)):
        raise InputError(f"{volume.name}: voxels are NaN or infinite; replace them with fill=VALUE when reading")
    if low == high:
        raise InputError(f"{volume.name}: every voxel is {low:g}, so it has no surface; is this the right file?")
    if volume.array.dtype.kind in "if" and -4096 <= low <= -500 and high >= 300:
        return SKIN_HU, "skin in Hounsfield units"
    stride = max(1, round((volume.array.size / 2e6) ** (1 / 3)))
    values = volume.array[::stride, ::stride, ::stride].astype(np.float64)
    count, bound = np.histogram(values, 256, (low, high))
    share = count / count.sum()
    below = np.cumsum(share)
    mean = np.cumsum(share * np.arange(256))
    spread = (mean[-1] * below - mean) ** 2 / np.maximum(below * (1 - below), 1e-12)
    best = np.flatnonzero(spread >= spread.max() * (1 - 1e-9))
    iso = float(bound[(best[0] + best[-1]) // 2 + 1])
    return round(iso, 3 - math.floor(math.log10(high - low))), "between the two main classes of the histogram"
