"""Following lines in a picture: from a filtered contour image to ordered chains of points."""

# C. Steger, "An unbiased detector of curvilinear structures", 1998 (the middle of a line, finer than a pixel).
# M. Gerl, "Volume hatching", 2006 (starts on scanlines, the two best neighbours, branches). Unlike there, each branch is a
# chain of its own, in order, so that nothing is connected that is not connected in the picture.

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import kernel, strips

Floats = NDArray[np.float32]

# A chain does not go on where the line would turn by more than this.
TURN = math.cos(math.radians(65.0))


@kernel
def _middles(y0, y1, image, least, place, way):  # type: ignore[no-untyped-def]
    """place = the middle of the line that passes through a pixel, NaN where none does; way = unit direction along it.

    Across the line, which is where the second derivative is most negative, the first derivative vanishes at
    t = -g.n / n.H.n from the pixel's centre; the line passes through the pixel if that is within it.
    """
    h, w = image.shape
    for y in range(max(y0, 1), min(y1, h - 1)):
        for x in range(1, w - 1):
            if image[y, x] < least:
                continue
            gx = 0.5 * (image[y, x + 1] - image[y, x - 1])
            gy = 0.5 * (image[y + 1, x] - image[y - 1, x])
            xx = image[y, x + 1] - 2.0 * image[y, x] + image[y, x - 1]
            yy = image[y + 1, x] - 2.0 * image[y, x] + image[y - 1, x]
            xy = 0.25 * (image[y + 1, x + 1] - image[y + 1, x - 1] - image[y - 1, x + 1] + image[y - 1, x - 1])
            # Eigenvector of the most negative eigenvalue.
            angle = 0.5 * math.atan2(2.0 * xy, xx - yy) + 0.5 * math.pi
            nx = math.cos(angle)
            ny = math.sin(angle)
            bend = nx * nx * xx + 2.0 * nx * ny * xy + ny * ny * yy
            # Beside a curved line, where it fades, the picture bends along it, but slopes much more.
            if bend >= -1e-6 or abs(gx) + abs(gy) > -3.0 * bend:
                continue
            t = -(gx * nx + gy * ny) / bend
            if max(abs(t * nx), abs(t * ny)) <= 0.6:
                place[y, x, 0] = x + 0.5 + t * nx
                place[y, x, 1] = y + 0.5 + t * ny
                way[y, x, 0] = -ny
                way[y, x, 1] = nx


@kernel
def _follow(image, place, way, scan, reach, used, points, offsets, start):  # type: ignore[no-untyped-def]
    """Chains from starts on scanlines; start[i] is the number of the start of chain i. Returns points and chains."""
    h, w = image.shape
    n = 0
    chains = 0
    begun = 0
    # Branches to follow: pixel, and the place where they leave their chain.
    pending = np.empty((4096, 6))
    first = np.empty((1, 2))
    for across in range(2):
        size = h if across == 0 else w
        for fixed in range(min(scan, size) // 2, size, scan):
            for moving in range(w if across == 0 else h):
                sy = fixed if across == 0 else moving
                sx = moving if across == 0 else fixed
                if used[sy, sx] or not place[sy, sx, 0] >= 0.0:
                    continue
                begun += 1
                waiting = 0
                # Both ways from the start: the second way first, turned round, so that they are one chain.
                begin = n
                for side in range(2):
                    if side == 1:
                        low = begin
                        high = n - 1
                        while low < high:
                            first[0, :] = points[low]
                            points[low] = points[high]
                            points[high] = first[0]
                            low += 1
                            high -= 1
                    y = sy
                    x = sx
                    hx = way[y, x, 0] if side == 0 else -way[y, x, 0]
                    hy = way[y, x, 1] if side == 0 else -way[y, x, 1]
                    if side == 0:
                        used[y, x] = True
                        points[n] = place[y, x]
                        n += 1
                    n, waiting = _walk(image, place, way, reach, used, points, n, y, x, hx, hy, pending, waiting)
                chains += 1
                offsets[chains] = n
                start[chains - 1] = begun
                while waiting > 0:
                    waiting -= 1
                    y = int(pending[waiting, 0])
                    x = int(pending[waiting, 1])
                    if used[y, x]:
                        continue
                    points[n, 0] = pending[waiting, 4]
                    points[n, 1] = pending[waiting, 5]
                    points[n + 1] = place[y, x]
                    used[y, x] = True
                    n, waiting = _walk(
                        image,
                        place,
                        way,
                        reach,
                        used,
                        points,
                        n + 2,
                        y,
                        x,
                        pending[waiting, 2],
                        pending[waiting, 3],
                        pending,
                        waiting,
                    )
                    chains += 1
                    offsets[chains] = n
                    start[chains - 1] = begun
    return n, chains


@kernel
def _walk(image, place, way, reach, used, points, n, y, x, hx, hy, pending, waiting):  # type: ignore[no-untyped-def]
    """Go on from a pixel along a heading while there is a next one; note where the line branches."""
    h, w = image.shape
    while True:
        best = 0.0
        second = 0.0
        by = bx = ay = ax = -1
        px = place[y, x, 0]
        py = place[y, x, 1]
        for j in range(max(y - reach, 0), min(y + reach + 1, h)):
            for i in range(max(x - reach, 0), min(x + reach + 1, w)):
                if used[j, i] or not place[j, i, 0] >= 0.0:
                    continue
                dx = place[j, i, 0] - px
                dy = place[j, i, 1] - py
                far = math.sqrt(dx * dx + dy * dy)
                if far < 0.3 or far > reach + 0.3:
                    continue
                ahead = (dx * hx + dy * hy) / far
                along = abs(way[j, i, 0] * dx + way[j, i, 1] * dy) / far
                if ahead < TURN or along < TURN:
                    continue
                score = image[j, i] * ahead * along / far
                if score > best:
                    second = best
                    ay = by
                    ax = bx
                    best = score
                    by = j
                    bx = i
                elif score > second:
                    second = score
                    ay = j
                    ax = i
        if by < 0:
            return n, waiting
        dx = place[by, bx, 0] - px
        dy = place[by, bx, 1] - py
        far = math.sqrt(dx * dx + dy * dy)
        dx /= far
        dy /= far
        if ay >= 0 and waiting < len(pending):
            ex = place[ay, ax, 0] - px
            ey = place[ay, ax, 1] - py
            away = math.sqrt(ex * ex + ey * ey)
            # Not the next pixel of the same line.
            if abs(ex * dy - ey * dx) > 0.8:
                pending[waiting, 0] = ay
                pending[waiting, 1] = ax
                pending[waiting, 2] = ex / away
                pending[waiting, 3] = ey / away
                pending[waiting, 4] = px
                pending[waiting, 5] = py
                waiting += 1
        # Pixels passed over, beside the step, belong to the line too.
        for j in range(min(y, by) - 1, max(y, by) + 2):
            for i in range(min(x, bx) - 1, max(x, bx) + 2):
                if 0 <= j < h and 0 <= i < w and not used[j, i] and place[j, i, 0] >= 0.0:
                    ex = place[j, i, 0] - px
                    ey = place[j, i, 1] - py
                    if abs(ex * dy - ey * dx) < 0.5 and -0.5 < ex * dx + ey * dy < far - 0.2:
                        used[j, i] = True
        y = by
        x = bx
        used[y, x] = True
        points[n] = place[y, x]
        n += 1
        # The heading is that of the line, turned the way we go.
        ahead = 1.0 if way[y, x, 0] * dx + way[y, x, 1] * dy >= 0.0 else -1.0
        hx = 0.5 * (hx + ahead * way[y, x, 0])
        hy = 0.5 * (hy + ahead * way[y, x, 1])
        size = math.sqrt(hx * hx + hy * hy)
        if size > 1e-6:
            hx /= size
            hy /= size


def follow(image: Floats, *, least: float, scan: int, reach: int = 2) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
    """Lines along the ridges of a picture (h, w): points (n, 2) in pixels, offsets of chains, and each chain's start.

    least  value below which there is no line
    scan   pixels between the scanlines on which lines are looked for
    reach  pixels within which a line is looked for where it is interrupted
    A chain holds points in their order along one line. Branches are chains that begin on the one they leave; those of one
    start come one after the other. A line that closes ends where it began.
    """
    h, w = image.shape
    place = np.full((h, w, 2), np.nan, dtype=np.float32)
    way = np.zeros((h, w, 2), dtype=np.float32)
    strips(_middles, h, image, np.float32(least), place, way, size=32)
    count = int(np.isfinite(place[..., 0]).sum())
    # A branch adds the point that it leaves from.
    points = np.empty((3 * count + 2, 2), dtype=np.float32)
    offsets = np.zeros(count + 2, dtype=np.int64)
    start = np.zeros(count + 2, dtype=np.int64)
    used = np.zeros((h, w), dtype=np.bool_)
    n, chains = _follow(image, place, way, max(1, scan), reach, used, points, offsets, start)
    points, offsets = points[:n].copy(), offsets[: chains + 1].copy()
    return _closed(points, offsets, start[:chains].copy(), reach)


def _closed(
    points: Floats, offsets: NDArray[np.int64], start: NDArray[np.int64], reach: int
) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
    """Chains whose ends meet repeat their first point, in place of a last one that has gone past it."""
    first, last = offsets[:-1], offsets[1:] - 1
    meets = (np.hypot(*(points[first] - points[last]).T) < reach + 0.3) & (np.diff(offsets) > 8)
    short = np.einsum("nc,nc->n", points[first] - points[last], points[last] - points[last - 1]) > 0.0
    grown = np.diff(offsets) + (meets & short)
    ends = np.concatenate([[0], np.cumsum(grown)]).astype(np.int64)
    index = np.repeat(first - ends[:-1], grown) + np.arange(ends[-1])
    index[ends[1:][meets] - 1] = first[meets]
    return points[index], ends, start
