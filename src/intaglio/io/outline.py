"""From strokes to what vector files hold: filled outlines of even opacity, and plain lines."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import kernel
from intaglio.drawing import Layer
from intaglio.io.simplify import Offsets, simplified, stroke_nodes

UNIT = 0.01  # mm; coordinates in files are whole numbers of it
TOLERANCE = 0.012  # mm, by which a written outline may leave the stroke
STEP = 1 / 16  # range of opacity within one piece
PLAIN = 0.03  # relative range of width within a line that is written with a single width
LAP = 0.002  # mm, overlap of neighbouring pieces at half opacity; grows as they get denser


@dataclass(frozen=True, eq=False)
class Paths:
    """Paths of one layer, sorted by opacity, then width.

    points   (n, 2) int32, in UNIT
    offsets  (m + 1,): path i is points[offsets[i]:offsets[i + 1]]
    opacity  (m,) 0.01..1, in hundredths
    width    (m,) mm, in thousandths; 0 for a closed outline, to be filled by the nonzero rule

    One colour laid over itself gives the same in any order, so that sorting changes no picture.
    """

    points: NDArray[np.int32]
    offsets: Offsets
    opacity: NDArray[np.float64]
    width: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.opacity)


def layer_paths(layer: Layer, *, lines: bool = True) -> Paths:
    """What a layer's strokes cover, as outlines and, with `lines`, plain lines where the width is even."""
    nodes, offsets = simplified(stroke_nodes(layer), layer.strokes.offsets, TOLERANCE)
    count, pieces, starts, kind, opacity, width = _pieces(nodes, offsets, STEP, PLAIN if lines else -1.0)
    opacity, width = np.round(opacity[:count], 2), np.round(width[:count], 3)
    order = np.lexsort((width, opacity))
    order = order[opacity[order] > 0]
    points, ends = _outlines(pieces, starts[: count + 1], kind, opacity, width, order, TOLERANCE, 1.0 / UNIT)
    real = np.diff(ends, prepend=0) > 0
    order = order[real]
    offsets = np.concatenate([[0], ends[real]])
    return Paths(points[: offsets[-1]], offsets, opacity[order], width[order])


@kernel
def _pieces(nodes, offsets, step, plain):  # type: ignore[no-untyped-def]
    """Cut strokes where their opacity has changed by a step.

    Returns nodes (k, 3), starts (m + 1,), kind (m,): 1 begins a stroke, 2 ends it, 3 both; opacity (m,); and
    width (m,), 0 unless the piece is a whole stroke of even width.
    """
    room = 0
    for i in range(1, len(nodes)):
        room += 2 * int(abs(nodes[i, 3] - nodes[i - 1, 3]) / step) + 4
    room += 2
    out = np.empty((room, 3))
    starts = np.empty(room + 1, np.int64)
    kind = np.zeros(room, np.uint8)
    opacity = np.empty(room)
    width = np.zeros(room)
    n, m = 0, 0
    starts[0] = 0
    for s in range(len(offsets) - 1):
        i, end = offsets[s], offsets[s + 1]
        x, y, r, o = nodes[i, 0], nodes[i, 1], nodes[i, 2], nodes[i, 3]
        out[n, 0], out[n, 1], out[n, 2] = x, y, r
        n += 1
        low, high, thin, thick, begin = o, o, r, r, 1
        length, tone = 1e-9, 1e-9 * o
        for k in range(i + 1, end):
            bx, by, br, bo = nodes[k, 0], nodes[k, 1], nodes[k, 2], nodes[k, 3]
            if (bx - x) ** 2 + (by - y) ** 2 < 1e-10:
                # A point upon the last one has no direction; a dab of the pen keeps its largest width.
                out[n - 1, 2] = max(out[n - 1, 2], br)
                thick = max(thick, br)
                continue
            t = 0.0
            # Not near a corner, where cross-sections of neighbours would overlap on its inner side.
            whole = math.sqrt((bx - x) ** 2 + (by - y) ** 2)
            margin = min(max(0.25 * (r + br) / whole, 0.02), 0.25)
            while bo != o and max(high, bo) - min(low, bo) > step:
                goal = low + step if bo > high else high - step
                cut = max(t, min(max((goal - o) / (bo - o), margin, t + 0.02), 1.0 - margin))
                if cut <= t:
                    break
                goal = o + cut * (bo - o)
                length += (cut - t) * whole
                tone += (cut - t) * whole * (goal + 0.5 * (t - cut) * (bo - o))
                t = cut
                for copy in range(2):
                    out[n, 0], out[n, 1], out[n, 2] = x + t * (bx - x), y + t * (by - y), r + t * (br - r)
                    n += 1
                    if copy == 0:
                        kind[m] = begin
                        opacity[m] = tone / length
                        m += 1
                        starts[m] = n
                low, high, begin = goal, goal, 0
                length, tone = 1e-9, 1e-9 * goal
            out[n, 0], out[n, 1], out[n, 2] = bx, by, br
            n += 1
            length += (1.0 - t) * whole
            tone += (1.0 - t) * whole * (bo - 0.5 * (1.0 - t) * (bo - o))
            x, y, r, o = bx, by, br, bo
            low, high, thin, thick = min(low, o), max(high, o), min(thin, r), max(thick, r)
        kind[m] = begin + 2
        opacity[m] = tone / length
        if begin == 1 and thick - thin <= plain * thick and n - starts[m] > 1:
            width[m] = thin + thick
        m += 1
        starts[m] = n
    return m, out, starts, kind, opacity, width


@kernel
def _arc(out, n, x, y, r, nx, ny, angle, tolerance):  # type: ignore[no-untyped-def]
    """Points on the circle strictly between r (nx, ny) and the same turned by the angle."""
    if r > 0.25 * tolerance:
        count = int(abs(angle) / (2.0 * math.acos(max(1.0 - 0.5 * tolerance / r, 0.5)))) + 1
        count = min(max(count, int(abs(angle) * 1.2)), 40)
        for k in range(1, count):
            c, s = math.cos(angle * k / count), math.sin(angle * k / count)
            out[n, 0], out[n, 1] = x + r * (nx * c - ny * s), y + r * (nx * s + ny * c)
            n += 1
    return n


@kernel
def _outlines(nodes, starts, kind, opacity, width, order, tolerance, scale):  # type: ignore[no-untyped-def]
    """Lines as they are, others as polygons: one side forwards, a cap, the other side backwards, a cap."""
    longest = 0
    for m in range(len(starts) - 1):
        longest = max(longest, starts[m + 1] - starts[m])
    left = np.empty((42 * longest + 84, 2))
    right = np.empty((42 * longest + 84, 2))
    points = np.empty((4 * len(nodes) + 1024, 2), np.int32)
    ends = np.empty(len(order), np.int64)
    n = 0
    for q in range(len(order)):
        m = order[q]
        i, end = starts[m], starts[m + 1]
        a, b = 0 * i, 0 * i  # of the same integer type for _arc
        if width[m] > 0.0:
            for k in range(i, end):
                left[a, 0], left[a, 1] = nodes[k, 0], nodes[k, 1]
                a += 1
        elif end - i == 1:
            x, y, r = nodes[i, 0], nodes[i, 1], nodes[i, 2]
            left[0, 0], left[0, 1] = x + r, y
            a = _arc(left, a + 1, x, y, r, 1.0, 0.0, 2.0 * math.pi, tolerance)
        else:
            x, y, r = nodes[i, 0], nodes[i, 1], nodes[i, 2]
            dx, dy = nodes[i + 1, 0] - x, nodes[i + 1, 1] - y
            length = math.sqrt(dx * dx + dy * dy)
            nx, ny = -dy / length, dx / length
            # A viewer antialiases each piece for itself, and paper shines through where two meet: the denser they are,
            # the more, and the less an overlap is seen. Dense ones overlap, by up to half their width.
            if kind[m] & 1 == 0:
                back = min(LAP * (opacity[m] / (1.04 - opacity[m])) ** 2, r) / length
                x, y = x - back * dx, y - back * dy
            else:
                a = _arc(left, a, x, y, r, -nx, -ny, -math.pi, tolerance)
            left[a, 0], left[a, 1] = x + r * nx, y + r * ny
            right[0, 0], right[0, 1] = x - r * nx, y - r * ny
            a, b = a + 1, 1
            for k in range(i + 1, end - 1):
                x, y, r = nodes[k, 0], nodes[k, 1], nodes[k, 2]
                dx, dy = nodes[k + 1, 0] - x, nodes[k + 1, 1] - y
                ahead = math.sqrt(dx * dx + dy * dy)
                mx, my = -dy / ahead, dx / ahead
                dot, cross = nx * mx + ny * my, nx * my - ny * mx
                # tan(half the turn) = |cross| / (1 + dot): how far back along the segments the inner mitre reaches.
                if dot > 0.5 and r * abs(cross) <= 0.9 * (1.0 + dot) * min(length, ahead):
                    ux, uy = r * (nx + mx) / (1.0 + dot), r * (ny + my) / (1.0 + dot)
                    left[a, 0], left[a, 1] = x + ux, y + uy
                    right[b, 0], right[b, 1] = x - ux, y - uy
                    a, b = a + 1, b + 1
                else:
                    # Through the corner itself on the inner side, so that every part of the polygon turns the same
                    # way round and nothing cancels under the nonzero rule; around it on the outer side.
                    angle = math.atan2(cross, dot)
                    left[a, 0], left[a, 1] = x + r * nx, y + r * ny
                    right[b, 0], right[b, 1] = x - r * nx, y - r * ny
                    a, b = a + 1, b + 1
                    if angle > 0.0:
                        left[a, 0], left[a, 1] = x, y
                        a += 1
                        b = _arc(right, b, x, y, r, -nx, -ny, angle, tolerance)
                    else:
                        right[b, 0], right[b, 1] = x, y
                        b += 1
                        a = _arc(left, a, x, y, r, nx, ny, angle, tolerance)
                    left[a, 0], left[a, 1] = x + r * mx, y + r * my
                    right[b, 0], right[b, 1] = x - r * mx, y - r * my
                    a, b = a + 1, b + 1
                nx, ny, length = mx, my, ahead
            x, y, r = nodes[end - 1, 0], nodes[end - 1, 1], nodes[end - 1, 2]
            left[a, 0], left[a, 1] = x + r * nx, y + r * ny
            right[b, 0], right[b, 1] = x - r * nx, y - r * ny
            a, b = a + 1, b + 1
            if kind[m] & 2:
                a = _arc(left, a, x, y, r, nx, ny, -math.pi, tolerance)
        if n + a + b > len(points):
            grown = np.empty((2 * (n + a + b), 2), np.int32)
            for k in range(n):
                grown[k, 0], grown[k, 1] = points[k, 0], points[k, 1]
            points = grown
        begin = n
        for k in range(a + b):
            x, y = (left[k, 0], left[k, 1]) if k < a else (right[a + b - 1 - k, 0], right[a + b - 1 - k, 1])
            px, py = int(math.floor(x * scale + 0.5)), int(math.floor(y * scale + 0.5))
            if n == begin or px != points[n - 1, 0] or py != points[n - 1, 1]:
                points[n, 0], points[n, 1] = px, py
                n += 1
        if width[m] == 0.0:
            if n - begin > 1 and points[n - 1, 0] == points[begin, 0] and points[n - 1, 1] == points[begin, 1]:
                n -= 1
            if n - begin < 3:
                n = begin
        ends[q] = n
    return points, ends
