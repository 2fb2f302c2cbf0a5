"""Bodies that no single isovalue bounds: matter of values between two, and labels; as volumes, negative inside."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intaglio.errors import InputError
from intaglio.volume import Volume

Mask = NDArray[np.bool_]

# Voxels around a body that its surface's derivatives reach, and one more.
MARGIN = 4
# Smoothing of thin and of thick parts and gaps, in voxels; thick ones begin at this many voxels from surface to middle.
SIGMAS = (0.8, 2.0)
THICK = 1.5


def _around(mask: Mask) -> tuple[slice, slice, slice]:
    """The box of a mask with a margin, within the grid."""
    found = []
    for axis, n in enumerate(mask.shape):
        at = np.flatnonzero(mask.any(axis=tuple(a for a in range(3) if a != axis)))
        found.append(slice(max(0, int(at[0]) - MARGIN), min(n, int(at[-1]) + MARGIN + 1)))
    return found[0], found[1], found[2]


def _cropped(volume: Volume, box: tuple[slice, slice, slice], array: NDArray[Any], name: str) -> Volume:
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
    box = _around(body)
    v = volume.samples[box].astype(np.float32)
    outside = np.maximum(np.float32(low) - v, v - np.float32(high))
    outside = np.where(mask[box] & ~body[box], -outside, outside)
    film = mask[box] & ~body[box]
    if low > -math.inf and film.any():
        # Where it has been taken off, the matter's rim follows the voxels' steps.
        share = ndimage.gaussian_filter(ndimage.maximum_filter(film.astype(np.float32), 5), 1.0)
        outside += share * (ndimage.gaussian_filter(outside, 1.5) - outside)
    return _cropped(volume, box, outside, f"{volume.name}, {low:g} to {high:g}")


def _smoothed(field: NDArray[np.float32], sigma: NDArray[np.float64]) -> NDArray[np.float32]:
    """2 G - G G with the Gaussian G: keeps quadratic fields, so that round bodies do not shrink."""
    from scipy import ndimage

    once = ndimage.gaussian_filter(field, sigma, mode="nearest", truncate=3.0)
    return np.asarray(2.0 * once - ndimage.gaussian_filter(once, sigma, mode="nearest", truncate=3.0))


def label_distance(volume: Volume, labels: Collection[int]) -> Volume:
    """Signed distance in mm, negative inside, of the body that some labels of a label volume cover together.

    Smoothed over two voxels, so that their steps are gone; over less where the body or the gap beside it is only a few
    voxels wide, so that ribs stay whole and joints open. Cropped to the body. InputError for labels that are not there.
    """
    from scipy import ndimage

    if volume.array.dtype.kind not in "biu":
        raise InputError(f"{volume.name}: labels must be whole numbers, not {volume.array.dtype}; is this the label volume?")
    present = np.unique(volume.array)
    missing = [label for label in labels if label not in present]
    if missing or not labels:
        known = ", ".join(str(int(v)) for v in present[:40] if v) or "none"
        raise InputError(f"{volume.name}: label must be one of {known}, not {missing[0] if missing else 'none'}")
    mask = np.isin(volume.array, list(labels))
    if mask.all():
        raise InputError(f"{volume.name}: labels {', '.join(map(str, labels))} cover every voxel, so they have no surface")
    box = _around(mask)
    mask = mask[box]
    spacing = volume.spacing[::-1]
    edt = ndimage.distance_transform_edt
    distance = (edt(~mask, sampling=spacing) - edt(mask, sampling=spacing)).astype(np.float32)
    # A part or a gap of a few voxels would melt away under what rids a large organ of its steps.
    widest = float(spacing.max())
    reach = tuple(2 * math.ceil(3.0 * widest / step) + 1 for step in spacing)
    thickness = np.minimum(ndimage.maximum_filter(-distance, reach), ndimage.maximum_filter(distance, reach))
    share = ndimage.gaussian_filter(np.clip(thickness / (THICK * widest) - 1.0, 0.0, 1.0), widest / spacing)
    fine, coarse = (_smoothed(distance, sigma * widest / spacing) for sigma in SIGMAS)
    distance = fine + share * (coarse - fine)
    names = ", ".join(str(label) for label in labels)
    return replace(_cropped(volume, box, distance.astype(np.float32), f"{volume.name}, label {names}"), distances=True)
