"""A grid of cells that tells whether a place is free of points of lines."""

from __future__ import annotations

import numpy as np

from intaglio.compute import helper, kernel

# Points that a cell holds, and where an empty place is.
PLACES = 32
NOWHERE = np.float32(1e9)


@helper
def _taken(cell, fx, fy, bound):  # type: ignore[no-untyped-def]
    """Whether a cell (2, PLACES) shows a point too near.

    All places at once, empty ones being far away: one vector instruction instead of a search.
    """
    hits = np.float32(0.0)
    for k in range(PLACES):
        dx = cell[0, k] - fx
        dy = cell[1, k] - fy
        hits += np.float32(1.0) if dx * dx + dy * dy < bound else np.float32(0.0)
    return hits > np.float32(0.0)


@kernel
def far(x, y, limit, inverse, cells):  # type: ignore[no-untyped-def]
    """No point is shown within `limit` of (x, y)."""
    # float32 all through: numba widens integers to 64 bits, which halves the lanes of the vector.
    fx, fy, bound = np.float32(x), np.float32(y), np.float32(limit * limit)
    # The cell of the point itself first: where lines are dense it decides.
    if _taken(cells[int(y * inverse), int(x * inverse)], fx, fy, bound):
        return False
    j0 = max(int((y - limit) * inverse), 0)
    i0 = max(int((x - limit) * inverse), 0)
    for j in range(j0, min(int((y + limit) * inverse) + 1, cells.shape[0])):
        for i in range(i0, min(int((x + limit) * inverse) + 1, cells.shape[1])):
            if _taken(cells[j, i], fx, fy, bound):
                return False
    return True


@helper
def reserve(x, y, inverse, count):  # type: ignore[no-untyped-def]
    """A place in the cell of (x, y), where the point does not show yet; -1 when the cell is full."""
    j = int(y * inverse)
    i = int(x * inverse)
    k = count[j, i]
    if k == PLACES:
        return np.int8(-1)
    count[j, i] = k + 1
    return np.int8(k)


@helper
def show(x, y, inverse, cells, place):  # type: ignore[no-untyped-def]
    """Let a point keep others away."""
    cell = cells[int(y * inverse), int(x * inverse)]
    cell[0, place] = x
    cell[1, place] = y


@helper
def hide(x, y, inverse, cells, place):  # type: ignore[no-untyped-def]
    """Let a point keep its place but nobody away."""
    cells[int(y * inverse), int(x * inverse), 0, place] = NOWHERE


@kernel
def forget(first, n, inverse, count, cells, px, py, place):  # type: ignore[no-untyped-def]
    """Take the latest points out of their cells again."""
    while n > first:
        n -= 1
        hide(px[n], py[n], inverse, cells, place[n])
        count[int(py[n] * inverse), int(px[n] * inverse)] -= 1
