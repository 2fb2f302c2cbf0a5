"""The triangles of a marching cube: for each of its 256 cases, from one rule for faces."""

# W. Lorensen, H. Cline, "Marching cubes", 1987.
# C. Montani, R. Scateni, R. Scopigno, "A modified look-up table for implicit disambiguation of marching cubes", 1994:
# ambiguous faces always part the body's corners, so that both cells of a face agree and the surface has no holes.

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

# Corner c of a cell stands at x = c / 4, y = c % 2, z = c / 2 % 2: the codes of a row of cells follow from four rows of voxels.
_PLACE = {c: (c >> 2 & 1, c & 1, c >> 1 & 1) for c in range(8)}
_CORNER = {place: c for c, place in _PLACE.items()}
# Edge 4 a + i runs along axis a (x, y, z); i counts the other two coordinates, the first of them fastest.
EDGES = [
    (low, low | bit) for bit in (4, 1, 2) for low in sorted((c for c in range(8) if not c & bit), key=lambda c: _PLACE[c][::-1])
]
_EDGE = {frozenset(edge): e for e, edge in enumerate(EDGES)}

Polygon = tuple[int, ...]


def _faces() -> Iterator[list[int]]:
    """Corners of each face, counter-clockwise seen from outside the cell."""
    for axis, side in product(range(3), (0, 1)):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        around = []
        for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
            place = [side, side, side]
            place[u], place[v] = a, b
            around.append(_CORNER[place[0], place[1], place[2]])
        yield around if side else around[::-1]


FACES = list(_faces())
_FACES_OF = [{k for k, face in enumerate(FACES) if a in face and b in face} for a, b in EDGES]


def _polygons(case: int) -> Iterator[Polygon]:
    """The surface's closed lines on the cell's faces, as edges that they cross; corner c is inside where bit c is set."""
    follows = {}
    for face in FACES:
        around = [(a, b) for a, b in zip(face, face[1:] + face[:1], strict=True) if (case >> a ^ case >> b) & 1]
        for i, (a, b) in enumerate(around):
            if case >> b & 1:
                # Round a corner of the body, or several in a row: in here, out at the next crossing.
                c, d = around[(i + 1) % len(around)]
                follows[_EDGE[frozenset((a, b))]] = _EDGE[frozenset((c, d))]
    while follows:
        line = [min(follows)]
        while (after := follows.pop(line[-1])) != line[0]:
            line.append(after)
        yield tuple(line)


def _triangulations(polygon: Polygon) -> Iterator[tuple[Polygon, ...]]:
    if len(polygon) < 3:
        yield ()
    for k in range(1, len(polygon) - 1):
        for left in _triangulations(polygon[: k + 1]):
            for right in _triangulations(polygon[k:]):
                yield (*left, (polygon[0], polygon[k], polygon[-1]), *right)


def _flat_diagonals(polygon: Polygon, triangles: tuple[Polygon, ...]) -> int:
    """Diagonals that lie in a face of the cell, where they would meet the neighbour's."""
    n = len(polygon)
    sides = {frozenset((polygon[i], polygon[(i + 1) % n])) for i in range(n)}
    inner = {frozenset(pair) for triangle in triangles for pair in combinations(triangle, 2)} - sides
    return sum(bool(_FACES_OF[min(pair)] & _FACES_OF[max(pair)]) for pair in inner)


@cache
def cube_triangles() -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Number of triangles (256,) of each case, and their corners (256, 15) as edges of the cell; from outside counter-clockwise.

    No diagonal lies in a face, so every edge of the surface has exactly two triangles.
    """
    count = np.zeros(256, dtype=np.uint8)
    corners = np.zeros((256, 15), dtype=np.uint8)
    for case in range(256):
        triangles: list[Polygon] = []
        for polygon in _polygons(case):
            best = min(_triangulations(polygon), key=lambda t: _flat_diagonals(polygon, t))
            assert _flat_diagonals(polygon, best) == 0
            triangles += best
        count[case] = len(triangles)
        corners[case, : 3 * len(triangles)] = np.array(triangles, dtype=np.uint8).ravel()
    return count, corners
