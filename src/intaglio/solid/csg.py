"""union, intersection, difference: solids from solids, as distance fields."""

# J. Bloomenthal et al., "Introduction to implicit surfaces", 1997 (min and max of fields).
# T. Kaehler, "Vergleich von Volumenmodellen", 2010: cuts by difference of distance fields.

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress
from intaglio.errors import InputError
from intaglio.solid.field import check_field, stages
from intaglio.solid.resample import covering_grid, resample
from intaglio.volume import Volume

Array = NDArray[np.float32]


def _lesser(a: Array, b: Array, smooth: float) -> Array:
    """The minimum; where both are within `smooth` of each other, a parabola below it that meets both tangentially."""
    least = np.minimum(a, b, out=a if smooth == 0 else None)
    if smooth > 0:
        near = np.abs(a - b)
        np.subtract(smooth, near, out=near)
        np.maximum(near, 0, out=near)
        near *= near
        near /= 4 * smooth
        least -= near
    return least


def _combine(
    fields: tuple[Volume, ...], grid: Volume, outer: int, inner: int, smooth: float, progress: Progress | None
) -> Volume:
    """outer * least(outer * first, inner * others); resampled one by one, so that there are never more than three grids."""
    if not (math.isfinite(smooth) and smooth >= 0):
        raise InputError(f"smooth must be a length in mm, 0 or more, not {smooth!r}")
    steps = stages(progress, len(fields))
    total = resample(fields[0], grid, steps[0])
    total *= outer
    for field, step in zip(fields[1:], steps[1:], strict=True):
        other = resample(field, grid, step)
        other *= inner
        total = _lesser(total, other, smooth)
    total *= outer
    return Volume(total, grid.world_from_index, fields[0].name, distances=True)


def union(
    field: Volume, *others: Volume, smooth: float = 0.0, like: Volume | None = None, progress: Progress | None = None
) -> Volume:
    """What is in any of the solids: the least of their signed distances.

    fields  signed distances in mm, negative inside, on any grids in any pose; each is resampled once (trilinear)
    smooth  mm; rounds the seam where surfaces meet: they are left this far from it. With more than two solids, the
            order of those that meet within that distance matters
    like    a volume whose grid the result has; else the first field's, extended until it holds the bodies of all
    Up to the interpolation, the surface is exact, and so are distances outside; depths inside are lower bounds (of intersections
    and differences it is the other way round) until `redistance` makes them exact. A field is continued beyond its grid by
    a lower bound of the distance, and a body that its grid cuts off ends there. A smooth seam adds at most smooth / 4.
    Raises InputError for volumes that are no fields, and for grids to resample whose axes are not perpendicular.
    """
    fields = tuple(check_field(f) for f in (field, *others))
    return _combine(fields, like or covering_grid(fields), 1, 1, smooth, progress)


def intersection(
    field: Volume, *others: Volume, smooth: float = 0.0, like: Volume | None = None, progress: Progress | None = None
) -> Volume:
    """What is in all solids: the greatest of their signed distances. As `union`, but on the first field's grid."""
    fields = tuple(check_field(f) for f in (field, *others))
    return _combine(fields, like or field, -1, -1, smooth, progress)


def difference(
    field: Volume, *others: Volume, smooth: float = 0.0, like: Volume | None = None, progress: Progress | None = None
) -> Volume:
    """What is in the first solid and in none of the others: max(a, -b). As `union`, but on the first field's grid."""
    fields = tuple(check_field(f) for f in (field, *others))
    return _combine(fields, like or field, -1, 1, smooth, progress)
