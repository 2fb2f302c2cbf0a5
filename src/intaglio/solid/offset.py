"""offset, shell: solids grown, shrunk and hollowed by arithmetic with their distances."""

from __future__ import annotations

import math

import numpy as np

from intaglio.errors import InputError
from intaglio.solid.field import check_field
from intaglio.volume import Volume


def offset(field: Volume, mm: float) -> Volume:
    """The solid grown by mm on all sides, or shrunk where mm is negative; signed distances in, signed distances out.

    Exact where the field is: outwards round corners, inwards sharp. A grown solid may leave the grid: `surface` caps it there.
    """
    if not math.isfinite(mm):
        raise InputError(f"mm must be a finite length, not {mm!r}")
    return Volume(
        check_field(field).array.astype(np.float32) - np.float32(mm), field.world_from_index, field.name, distances=True
    )


def shell(field: Volume, thickness: float) -> Volume:
    """The solid's wall, half of the thickness in mm on either side of its surface, as signed distances.

    For a wall inside only, take difference(field, offset(field, -thickness)).
    """
    if not (math.isfinite(thickness) and thickness > 0):
        raise InputError(f"thickness must be a length in mm above 0, not {thickness!r}")
    wall = np.abs(check_field(field).array.astype(np.float32)) - np.float32(thickness / 2)
    return Volume(wall, field.world_from_index, field.name, distances=True)
