"""What functions of fields share: the check that a volume is one, sampling on another grid, progress in stages."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress, helper
from intaglio.errors import InputError
from intaglio.volume import Volume, check_volume


def check_field(field: Volume, what: str = "a field") -> Volume:
    """The volume, if it holds signed floats. InputError otherwise."""
    check_volume(field)
    low, high = field.range
    if field.array.dtype.kind != "f":
        raise InputError(
            f"{field.name}: {what} must hold signed distances in floats, not {field.array.dtype}; "
            "make one with signed_distance (of masks and labels) or redistance (of scans)"
        )
    if not (math.isfinite(low) and math.isfinite(high)):
        raise InputError(f"{field.name}: {what} must be finite, not {low:g} to {high:g}")
    return field


Side = Literal["above", "below"]


def check_level(volume: Volume, iso: float | None, inside: Side | None) -> tuple[float, float]:
    """The isovalue, and 1 where the body is above it, -1 where it is below.

    Without an isovalue it is the zero level of a distance field or the border of a mask; with one, the body is brighter,
    but in distances.
    """
    if inside not in (None, "above", "below"):
        raise InputError(f"inside must be above or below, not {inside!r}")
    mask = volume.array.dtype.kind == "b"
    low, high = volume.range
    if not (math.isfinite(low) and math.isfinite(high)):
        raise InputError(f"{volume.name}: voxels are NaN or infinite; replace them with fill=VALUE when reading")
    if iso is None and volume.array.dtype.kind in "iu":
        raise InputError(
            f"{volume.name}: iso must be given for voxels of {volume.array.dtype}; for one of its labels give label="
        )
    level = iso if iso is not None else 0.5 if mask else 0.0
    if not low <= level <= high or low == high:
        raise InputError(f"{volume.name}: iso must be within the volume's values, {low:g} to {high:g}, not {level:g}")
    side = inside or ("below" if volume.distances or (iso is None and not mask) else "above")
    return level, 1.0 if side == "above" else -1.0


def grid_spacing(volume: Volume) -> NDArray[np.float32]:
    """Spacing (x, y, z) in mm of a grid whose axes are perpendicular; InputError if they are not."""
    axes = volume.world_from_index[:3, :3] / volume.spacing
    lean = float(np.abs(axes.T @ axes - np.eye(3)).max())
    if lean > 1e-4:
        angle = math.degrees(math.asin(min(lean, 1.0)))
        raise InputError(f"{volume.name}: the grid must have perpendicular axes, not {angle:.2g} degrees off; resample it")
    return volume.spacing.astype(np.float32)


def stages(progress: Progress | None, count: int) -> list[Progress | None]:
    """One progress for each of several stages, which together make one."""
    if progress is None:
        return [None] * count
    report = progress

    def stage(k: int) -> Progress:
        return lambda done, total: report(1000 * k + 1000 * done // max(total, 1), 1000 * count)

    return [stage(k) for k in range(count)]


@helper
def beyond(x, n):  # type: ignore[no-untyped-def]
    """How far an index lies outside 0..n-1."""
    return max(max(-x, x - (n - 1.0)), 0.0)
