"""Which edges of a mesh are left over when uses one way cancel out those the other way."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import frozen, kernel

Edges = tuple[NDArray[np.int64], NDArray[np.int64]]
# Uses of edges at one vertex up to which they are sorted by moving them up.
FEW = 32


@kernel
def _count(triangles, start):  # type: ignore[no-untyped-def]
    for t in range(len(triangles)):
        for k in range(3):
            start[min(triangles[t, k], triangles[t, (k + 1) % 3]) + 1] += 1


@kernel
def _sort_into(triangles, at, uses):  # type: ignore[no-untyped-def]
    """Uses of edges, by the lower of their ends: the other end and, in the last bit, the direction."""
    for t in range(len(triangles)):
        for k in range(3):
            a, b = triangles[t, k], triangles[t, (k + 1) % 3]
            low = min(a, b)
            uses[at[low]] = np.uint32(max(a, b)) << np.uint32(1) | np.uint32(a < b)
            at[low] += 1


@kernel
def _settle(start, uses, left, net):  # type: ignore[no-untyped-def]
    """Let the uses of each edge cancel out; the number of edges left over. Lists them only where `left` has room."""
    found = 0
    for low in range(len(start) - 1):
        mine = uses[start[low] : start[low + 1]]
        n = len(mine)
        if n > FEW:
            mine.sort()
        else:
            for i in range(1, n):
                use, k = mine[i], i
                while k > 0 and mine[k - 1] > use:
                    mine[k] = mine[k - 1]
                    k -= 1
                mine[k] = use
        i = 0
        while i < n:
            high, forward, backward = mine[i] >> np.uint32(1), 0, 0
            while i < n and mine[i] >> np.uint32(1) == high:
                if mine[i] & np.uint32(1):
                    forward += 1
                else:
                    backward += 1
                i += 1
            if forward != backward and high != low:
                if found < len(left):
                    left[found, 0], left[found, 1], net[found] = low, high, forward - backward
                found += 1
    return found


def net_edges(triangles: NDArray[np.int32]) -> Edges:
    """The boundary of a set of oriented triangles as a chain: edges (n, 2), and how often each is left over (n,), not zero.

    An edge counts +1 for a triangle that runs along it and -1 for one that runs against it, so that edges of more than
    two triangles may well cancel out. Where nothing is left, every winding number is an integer.
    """
    triangles = frozen(triangles)
    start = np.zeros(int(triangles.max()) + 2, dtype=np.int64)
    _count(triangles, start)
    start = np.cumsum(start)
    uses = np.empty(start[-1], dtype=np.uint32)
    _sort_into(triangles, start[:-1].copy(), uses)
    found = _settle(start, uses, np.empty((0, 2), dtype=np.int64), np.empty(0, dtype=np.int64))
    edges, net = np.empty((found, 2), dtype=np.int64), np.empty(found, dtype=np.int64)
    if found:
        _settle(start, uses, edges, net)
    return edges, net
