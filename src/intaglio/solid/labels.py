"""label_distance: how far it is to the border of labels, without their voxels' steps."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress
from intaglio.errors import InputError
from intaglio.solid.bodies import around, cropped
from intaglio.solid.edt import signed_distance
from intaglio.solid.field import stages
from intaglio.solid.relaxation import relaxed
from intaglio.volume import Volume, check_volume


def _mask_of(volume: Volume, labels: Collection[int]) -> NDArray[np.bool_]:
    """The voxels that labels cover. InputError for what holds none, for labels that are not there, and if they are everywhere."""
    check_volume(volume)
    if volume.array.dtype.kind not in "biu":
        raise InputError(f"{volume.name}: labels must be whole numbers, not {volume.array.dtype}; is this the label volume?")
    mask = np.zeros(volume.shape, dtype=bool)
    missing = [] if labels else ["none"]
    for label in labels:
        voxels = volume.array == label
        missing += [] if voxels.any() else [str(label)]
        mask |= voxels
    if missing:
        known = ", ".join(str(int(v)) for v in np.unique(volume.array)[:40] if v) or "none"
        raise InputError(f"{volume.name}: label must be one of {known}, not {missing[0]}")
    if mask.all():
        raise InputError(f"{volume.name}: labels {', '.join(map(str, labels))} cover every voxel, so they have no surface")
    return mask


def label_distance(
    volume: Volume, labels: int | Collection[int], *, smooth: bool = True, progress: Progress | None = None
) -> Volume:
    """Signed distance in mm, negative inside, of the body that some labels of a label volume cover together.

    Smoothed over two voxels, so that their steps are gone; over less where the body or the gap beside it is only a few
    voxels wide. What is up to two voxels wide keeps the side of every voxel and stays attached, so ribs stay whole and joints
    open. Elsewhere voxels at the border may change sides, and no others: vertices of the surface move by a voxel and a half at
    most. The volume is that of the voxels. Cropped to the body. smooth=False gives the distance to the faces between voxels.
    InputError for labels that are not there, and for grids whose axes are not perpendicular.
    """
    labels = labels if isinstance(labels, Collection) else (labels,)
    mask = _mask_of(volume, labels)
    box = around(mask)
    names = ", ".join(str(label) for label in labels)
    measuring, smoothing = stages(progress, 2)
    field = signed_distance(cropped(volume, box, mask[box], f"{volume.name}, label {names}"), progress=measuring)
    return relaxed(field, smoothing) if smooth else field
