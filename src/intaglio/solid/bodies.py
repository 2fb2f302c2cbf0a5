"""Matter of values between two, which no single isovalue bounds, as volumes, negative inside."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intaglio.errors import InputError
from intaglio.volume import Volume

Mask = NDArray[np.bool_]

# Voxels around a body that its surface's derivatives reach, and one more.
MARGIN = 4


def around(mask: Mask) -> tuple[slice, slice, slice]:
    """The box of a mask with a margin, within the grid."""
    found = []
    for axis, n in enumerate(mask.shape):
        at = np.flatnonzero(mask.any(axis=tuple(a for a in range(3) if a != axis)))
        found.append(slice(max(0, int(at[0]) - MARGIN), min(n, int(at[-1]) + MARGIN + 1)))
    return found[0], found[1], found[2]


def cropped(volume: Volume, box: tuple[slice, slice, slice], array: NDArray[Any], name: str) -> Volume:
    """A volume of what stands in a box of another one's grid."""
    world = volume.world_from_index.copy()
    world[:3, 3] += world[:3, :3] @ np.array([s.start for s in box[::-1]], dtype=np.float64)
    return Volume(array, world, name)


def _enclosed(mask: Mask) -> Mask:
    """The pieces of a mask that do not touch the border of the grid."""
    from scipy import ndimage

    piece, count = ndimage.label(mask)
    inner = np.ones(count + 1, dtype=bool)
    inner[0] = False
    for axis in range(3):
        for end in (0, -1):
            inner[piece.take(end, axis=axis)] = False
    return np.asarray(inner[piece])


def _thick(mask: Mask) -> Mask:
    """A mask without what is thinner than 3 voxels in any direction: opened by a cube, whose corners round bodies get back."""
    from scipy import ndimage

    core = ndimage.minimum_filter(mask.view(np.uint8), 3, mode="nearest")
    return np.asarray(ndimage.maximum_filter(core, 5, mode="constant") & mask.view(np.uint8), dtype=bool)


def _matter(volume: Volume, low: float, high: float) -> tuple[Mask, Mask]:
    """Voxels of values from low to high, and those of them that `between` takes for matter."""
    if not low < high or math.isnan(low) or high == -math.inf:
        raise InputError(f"{volume.name}: a range must run from a smaller to a larger value, not {low:g} to {high:g}")
    values = volume.samples
    mask = np.asarray(values <= high if low == -math.inf else (values >= low) & (values <= high))
    return mask, _enclosed(mask) if low == -math.inf else _thick(mask)


def has_matter(volume: Volume, low: float, high: float) -> bool:
    """Whether `between` finds anything."""
    return bool(_matter(volume, low, high)[1].any())


def between(volume: Volume, low: float, high: float) -> Volume:
    """Matter whose values lie from low to high, wherever a ray comes from: beneath denser matter, or around less dense.

    Its surface is where the volume returned is 0, negative inside; the unit is the scan's. Where one matter passes into
    another, all values between are met, too: films thinner than three voxels are therefore left out. With low = -inf it
    is what the rest encloses, cavities: values that reach the border of the scan are its surroundings.
    Cropped to the matter. InputError if nothing is left.
    """
    from scipy import ndimage

    mask, body = _matter(volume, low, high)
    if not body.any():
        low_, high_ = volume.range
        what = "no cavity" if low == -math.inf else "no matter three voxels thick"
        raise InputError(f"{volume.name}: {what} has values from {low:g} to {high:g}; the scan's run from {low_:g} to {high_:g}")
    box = around(body)
    v = volume.samples[box].astype(np.float32)
    outside = np.maximum(np.float32(low) - v, v - np.float32(high))
    outside = np.where(mask[box] & ~body[box], -outside, outside)
    film = mask[box] & ~body[box]
    if low > -math.inf and film.any():
        # Where it has been taken off, the matter's rim follows the voxels' steps.
        share = ndimage.gaussian_filter(ndimage.maximum_filter(film.astype(np.float32), 5), 1.0)
        outside += share * (ndimage.gaussian_filter(outside, 1.5) - outside)
    return cropped(volume, box, outside, f"{volume.name}, {low:g} to {high:g}")
