"""A grid of cells that tells whether a place is free: points of lines, with the line and the place along it."""

from __future__ import annotations

import numpy as np

from intaglio.compute import helper, kernel

# Points that a cell holds, and where an empty place is.
PLACES = 16
NOWHERE = np.float32(1e9)


@helper
def _taken(cell, fx, fy, bound, own, at, lag):  # type: ignore[no-untyped-def]
    """Whether a cell (4, PLACES: x, y, line, arc) holds a point too near, other than of the line's own near part.

    All places at once, empty ones being far away: one vector instruction instead of a search.
    """
    hits = np.float32(0.0)
    for k in range(PLACES):
        dx = cell[0, k] - fx
        dy = cell[1, k] - fy
        other = (cell[2, k] != own) | (abs(cell[3, k] - at) >= lag)
        hits += np.float32(1.0) if (dx * dx + dy * dy < bound) & other else np.float32(0.0)
    return hits > np.float32(0.0)


@kernel
def far(x, y, limit, inverse, cells, own, at, lag):  # type: ignore[no-untyped-def]
    """No point of another line, nor of the line's own distant part, within `limit` of (x, y)."""
    # float32 all through: numba widens integers to 64 bits, which halves the lanes of the vector.
    fx, fy, bound = np.float32(x), np.float32(y), np.float32(limit * limit)
    own, at, lag = np.float32(own), np.float32(at), np.float32(lag)
    # The cell of the point itself first: where lines are dense it decides.
    if _taken(cells[int(y * inverse), int(x * inverse)], fx, fy, bound, own, at, lag):
        return False
    j0 = max(int((y - limit) * inverse), 0)
    i0 = max(int((x - limit) * inverse), 0)
    for j in range(j0, min(int((y + limit) * inverse) + 1, cells.shape[0])):
        for i in range(i0, min(int((x + limit) * inverse) + 1, cells.shape[1])):
            if _taken(cells[j, i], fx, fy, bound, own, at, lag):
                return False
    return True


@helper
def enter(x, y, inverse, count, cells, own, at):  # type: ignore[no-untyped-def]
    """Note a point in its cell; False when the cell is full."""
    j = int(y * inverse)
    i = int(x * inverse)
    k = count[j, i]
    if k == PLACES:
        return False
    cells[j, i, 0, k] = x
    cells[j, i, 1, k] = y
    cells[j, i, 2, k] = own
    cells[j, i, 3, k] = at
    count[j, i] = k + 1
    return True


@kernel
def forget(first, n, inverse, count, cells, px, py):  # type: ignore[no-untyped-def]
    """Take the latest points out of their cells again."""
    while n > first:
        n -= 1
        j = int(py[n] * inverse)
        i = int(px[n] * inverse)
        count[j, i] -= 1
        cells[j, i, 0, count[j, i]] = NOWHERE
