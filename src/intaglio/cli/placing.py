"""What is given beside a scan, labels and tools that cut: read, and seen to lie where the scan is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from intaglio.cli.console import say
from intaglio.errors import InputError

if TYPE_CHECKING:
    from intaglio.volume import Volume


def read_beside(path: Path, scan: Volume) -> Volume:
    """A volume that belongs to the scan. One of as many voxels that does not say where it lies, lies where the scan does."""
    from intaglio.io.geometry import is_placed
    from intaglio.io.volumes import read_volume

    volume = _whole(read_volume(path))
    if not is_placed(volume.notes) and volume.shape == scan.shape:
        said = (f"no orientation stored, and as many voxels as {scan.name}: taken to lie in the same place",)
        volume = replace(volume, world_from_index=scan.world_from_index, notes=said)
    for text in volume.notes:
        say(f"note: {path.name}: {text}")
    check_meets(path.name, _body_corners(volume), scan)
    return volume


def _whole(volume: Volume) -> Volume:
    """Labels and masks that were saved as floats, as whole numbers."""
    array = volume.array
    low, high = volume.range
    if array.dtype.kind != "f" or volume.distances or low < 0 or high > 65535 or (array != np.rint(array)).any():
        return volume
    return replace(volume, array=array.astype(np.uint16))


def check_meets(name: str, corners: NDArray[np.float64], scan: Volume) -> None:
    """InputError if nothing between these corners, (n, 3) in the world, is in the scan."""
    apart = distance_apart(corners, scan)
    if apart > 0:
        raise InputError(
            f"{name}: lies {apart:.0f} mm away from {scan.name}, so they cannot belong together; export both in the same space"
        )


def distance_apart(corners: NDArray[np.float64], scan: Volume) -> float:
    """How far in mm, along the scan's axes, a box is from the scan; 0 if they meet."""
    index = corners @ scan.index_from_world[:3, :3].T + scan.index_from_world[:3, 3]
    last = np.array(scan.shape[::-1]) - 1
    gap = np.maximum(np.maximum(index.min(axis=0) - last - 0.5, -0.5 - index.max(axis=0)), 0.0)
    return float(np.linalg.norm(gap * scan.spacing))


def _body_corners(volume: Volume) -> NDArray[np.float64]:
    """(8, 3) world corners of the box of what is labelled or set, or negative in floats; of all where nothing is."""
    body = volume.array < 0 if volume.array.dtype.kind == "f" else volume.array != 0
    ends = []
    for axes in ((0, 1), (0, 2), (1, 2)):  # leaves x, y, z
        used = np.flatnonzero(body.any(axis=axes))
        if len(used) == 0:
            return volume.corners
        ends.append((used[0], used[-1]))
    index = np.array([(x, y, z) for z in ends[2] for y in ends[1] for x in ends[0]], dtype=np.float64)
    return index @ volume.world_from_index[:3, :3].T + volume.world_from_index[:3, 3]
