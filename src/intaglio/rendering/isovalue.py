"""A sensible surface for a scan whose isovalue nobody gave."""

# N. Otsu, "A threshold selection method from gray-level histograms", 1979.

from __future__ import annotations

import math

import numpy as np

from intaglio.errors import InputError
from intaglio.rendering.skipping import Inside
from intaglio.volume import Volume

# Between air (-1000) and fat (-100): the skin in Hounsfield units.
SKIN_HU = -300.0
# Of the changes in a label map, the part that is followed by another one at most; 0.07 in organs at 3 mm, 0.7 in scans.
STEPS = 0.25


def is_label_map(volume: Volume) -> bool:
    """Whether whole numbers are those of labels rather than of a scan: they change at once, not over several voxels.

    Where a value changes from one voxel to the next, a scan mostly changes again with the one behind, to a third value;
    labels do so only where one is a single voxel thick.
    """
    if volume.array.dtype.kind not in "biu" or volume.range[0] < 0 or volume.range[0] == volume.range[1]:
        return False
    changes = again = 0
    for axis in range(3):
        rows = np.moveaxis(volume.array, axis, -1)
        stride = max(1, math.ceil((rows.size / 2e6) ** 0.5))
        rows = rows[::stride, ::stride]
        a, b, c = rows[..., :-2], rows[..., 1:-1], rows[..., 2:]
        changed = a != b
        changes += int(np.count_nonzero(changed))
        again += int(np.count_nonzero(changed & (c != b) & (c != a)))
    return again <= STEPS * changes


def body_side(volume: Volume, inside: Inside | None = None) -> Inside:
    """On which side of an isovalue the body is, if nobody says: above it, but below in distances."""
    if inside not in (None, "above", "below"):
        raise InputError(f"inside must be above or below, not {inside!r}")
    return inside or ("below" if volume.distances else "above")


def body_surface(volume: Volume) -> tuple[float, str]:
    """An isovalue that parts body from surroundings, and what it is called in a message.

    Of distances it is 0, and the body is below (see `body_side`); in Hounsfield units it is the skin; otherwise the value
    that parts the histogram into its two most distinct classes (Otsu 1979), half way where nothing lies between them.
    Raises InputError for a constant volume and for NaN.
    """
    low, high = volume.range
    if not (math.isfinite(low) and math.isfinite(high)):
        raise InputError(f"{volume.name}: voxels are NaN or infinite; replace them with fill=VALUE when reading")
    if low == high:
        raise InputError(f"{volume.name}: every voxel is {low:g}, so it has no surface; is this the right file?")
    if volume.distances:
        return 0.0, "where the distances are 0, inside negative"
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
