"""morph: a solid between two others."""

# D. Cohen-Or, D. Levin, A. Solomovici, "Three-dimensional distance field metamorphosis", 1998.

from __future__ import annotations

import numpy as np

from intaglio.compute import Progress
from intaglio.errors import InputError
from intaglio.solid.field import check_field, stages
from intaglio.solid.resample import covering_grid, resample
from intaglio.volume import Volume


def morph(a: Volume, b: Volume, t: float, *, progress: Progress | None = None) -> Volume:
    """The solid at t on the way from a (t = 0) to b (t = 1): (1 - t) a + t b of their signed distances.

    On a's grid, extended until it holds b's body. Solids should overlap, for what has nothing of the other nearby
    shrinks away. The result is a field, no longer a distance: see `redistance`.
    """
    if not 0 <= t <= 1:
        raise InputError(f"t must be 0 to 1, not {t!r}")
    grid = covering_grid((check_field(a), check_field(b)))
    first, second = stages(progress, 2)
    mixed = resample(a, grid, first)
    mixed *= np.float32(1 - t)
    mixed += np.float32(t) * resample(b, grid, second)
    return Volume(mixed, grid.world_from_index, a.name, distances=True)
