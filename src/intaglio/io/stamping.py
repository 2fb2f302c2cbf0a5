"""Brushed strokes as pixels: tips stamped along them, on paper whose tops take the pigment first."""

# A. R. Smith, "Paint", 1978 (stamped brushes); M. C. Sousa, J. W. Buchanan, "Observational models of graphite pencil
# materials", 2000 (pigment and the heights of paper).

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.brush import Brush
from intaglio.compute import helper, kernel
from intaglio.io.simplify import Nodes, Offsets
from intaglio.io.tips import FULLEST, OPACITIES, PAPER_SIDE, SIDE, SIZES, VARIANTS, tips

# Smaller tips are stamped this large and as much fainter; stamps are no nearer than this.
SMALLEST = 1.6  # pixels
NEAREST = 0.5  # pixels
# A dab has the pigment of a stroke so many tip widths long.
DAB = 0.45
# Range of coverage over which paper goes from bare to covered.
TOOTH = 0.75


def stamps(nodes: Nodes, offsets: Offsets, brush: Brush) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """What `stamp` needs of strokes whose nodes are x, y, half width in pixels, and opacity.

    Returns (n, 5) float32 x, y, how far a stamp reaches, tip width, and pigment of a stamp at each node;
    and (n,) the number of stamps up to each node, which begins anew at a half with each stroke.
    """
    tip = tips(brush)
    # A stroke of opacity o is to cover o of its width: the tip must be so much wider as its edge is soft.
    opacity = np.maximum(nodes[:, 3], 0.01)
    size = np.maximum(2.0 * nodes[:, 2] * opacity / np.interp(opacity, OPACITIES, tip.covered), SMALLEST)
    covering = np.interp(2.0 * nodes[:, 2] * nodes[:, 3] / size, tip.covered, OPACITIES)
    apart = np.maximum(brush.spacing * size, NEAREST)
    out = np.empty((len(nodes), 5), dtype=np.float32)
    out[:, :2] = nodes[:, :2]
    out[:, 2] = 0.71 * (1.0 + brush.jitter) * size + 1.0
    out[:, 3] = size
    out[:, 4] = -np.log1p(-np.minimum(covering, FULLEST)) * apart / (size * tip.column)
    count = np.zeros(len(nodes))
    _count(np.ascontiguousarray(nodes[:, :2]), apart, size, offsets, count, out)
    return out, count


@kernel
def _count(points, apart, size, offsets, count, out):  # type: ignore[no-untyped-def]
    """Number the stamps of each stroke, a whole number of them, evenly spread."""
    for s in range(len(offsets) - 1):
        first, end = offsets[s], offsets[s + 1]
        total = 0.0
        for i in range(first + 1, end):
            length = math.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
            total += 2.0 * length / (apart[i] + apart[i - 1])
            count[i] = total
        whole = max(1.0, np.rint(total))
        # A stroke shorter than its width is one dab.
        more = max(total, DAB * size[first] / apart[first]) / whole
        for i in range(first, end):
            count[i] = 0.5 + (count[i] * whole / total if total > 1e-6 else 0.0)
            out[i, 4] *= more
        count[end - 1] = whole + 0.5


@helper
def _chance(a, b):  # type: ignore[no-untyped-def]
    """32 random bits from two numbers."""
    h = np.uint32(np.uint32(a) * np.uint32(0x9E3779B1)) ^ np.uint32(np.uint32(b) * np.uint32(0x85EBCA77))
    h = np.uint32(np.uint32(h ^ (h >> np.uint32(15))) * np.uint32(0x2C1B3C6D))
    h = np.uint32(np.uint32(h ^ (h >> np.uint32(12))) * np.uint32(0x297A2D39))
    return np.uint32(h ^ (h >> np.uint32(15)))


@kernel
def stamp(nodes, count, stroke, entries, texture, round_, jitter, turning, x0, y0, load):  # type: ignore[no-untyped-def]
    """Add the pigment of the segments `entries` to a tile (h, w): load = -ln(bare part) if paper were smooth.

    round_ says that the tip does not reach into the corners of its square. Chance comes from the numbers of stroke and stamp,
    so that a tile has the same stamps as its neighbours.
    """
    zero, half, one = np.float32(0.0), np.float32(0.5), np.float32(1.0)
    height, width = load.shape
    for e in range(len(entries)):
        i = entries[e]
        j = i + 1
        ax, ay = nodes[i, 0] - np.float32(x0), nodes[i, 1] - np.float32(y0)
        dx, dy = nodes[j, 0] - nodes[i, 0], nodes[j, 1] - nodes[i, 1]
        length = math.sqrt(dx * dx + dy * dy)
        way_x, way_y = (dx / length, dy / length) if length > np.float32(1e-6) else (one, zero)
        own = _chance(stroke[i], 0)
        for k in range(int(math.ceil(count[i])), int(math.floor(count[j])) + 1):
            if k <= count[i]:
                continue
            t = np.float32((k - count[i]) / (count[j] - count[i]))
            chance = _chance(stroke[i], k)
            more = one + jitter * (np.float32(chance & np.uint32(255)) / np.float32(127.5) - one)
            size = (nodes[i, 3] + t * (nodes[j, 3] - nodes[i, 3])) * (one + half * (more - one))
            pigment = nodes[i, 4] + t * (nodes[j, 4] - nodes[i, 4])
            pigment *= one + jitter * (np.float32((chance >> np.uint32(8)) & np.uint32(255)) / np.float32(127.5) - one)
            cx, cy = ax + t * dx, ay + t * dy
            c, s, variant = way_x, way_y, own & np.uint32(VARIANTS - 1)
            if turning:
                angle = np.float32((chance >> np.uint32(16)) & np.uint32(255)) * np.float32(2 * math.pi / 256)
                c, s, variant = math.cos(angle), math.sin(angle), (chance >> np.uint32(24)) & np.uint32(VARIANTS - 1)
            flip = -one if own & np.uint32(64) else one

            level = 0
            n = SIDE
            while level + 1 < SIZES and n > size + size:
                level += 1
                n >>= 1
            scale, middle = np.float32(n) / size, half * np.float32(n + 1)
            # Images fill their squares.
            reach = half * size * (one if round_ else abs(c) + abs(s)) + one / scale
            low, high = max(int(math.floor(cy - reach)), 0), min(int(math.ceil(cy + reach)), height)
            tip = texture[level, variant]
            edge = np.float32(n + 1)
            for py in range(low, high):
                y = np.float32(py) + half - cy
                across = math.sqrt(max(reach * reach - y * y, zero)) if round_ else reach
                begin, end = max(int(math.floor(cx - across)), 0), min(int(math.ceil(cx + across)), width)
                for px in range(begin, end):
                    x = np.float32(px) + half - cx
                    u = (x * c + y * s) * scale + middle
                    v = (y * c - x * s) * flip * scale + middle
                    if u <= zero or v <= zero or u >= edge or v >= edge:
                        continue
                    a, b = int(u), int(v)
                    p, q = u - np.float32(a), v - np.float32(b)
                    top = tip[b, a] + p * (tip[b, a + 1] - tip[b, a])
                    below = tip[b + 1, a] + p * (tip[b + 1, a + 1] - tip[b + 1, a])
                    load[py, px] += pigment * (top + q * (below - top))


@kernel
def catch(load, heights, texel, grain, x0, y0, colour, tile):  # type: ignore[no-untyped-def]
    """Cover a tile with pigment: where it would cover the share c of smooth paper, it reaches down to height 1 - c.

    texel is the side of a pixel in texels of the paper. The ramp around that height narrows as c nears 0 or 1, so that
    its mean over all heights is c.
    """
    zero, half, one = np.float32(0.0), np.float32(0.5), np.float32(1.0)
    for y in range(load.shape[0]):
        for x in range(load.shape[1]):
            if load[y, x] <= np.float32(1e-4):
                continue
            cover = one - math.exp(-load[y, x])
            if grain > zero:
                u, v = (x0 + x + half) * texel, (y0 + y + half) * texel
                i, j = int(u), int(v)
                p, q = np.float32(u - i), np.float32(v - j)
                i, j = i % PAPER_SIDE, j % PAPER_SIDE
                i2, j2 = (i + 1) % PAPER_SIDE, (j + 1) % PAPER_SIDE
                top = heights[j, i] + p * (heights[j, i2] - heights[j, i])
                below = heights[j2, i] + p * (heights[j2, i2] - heights[j2, i])
                h = top + q * (below - top)
                soft = min(np.float32(TOOTH), min(cover, one - cover) * np.float32(2.0)) + np.float32(1e-6)
                caught = min(max((cover + h - one) / soft + half, zero), one)
                cover += grain * (caught - cover)
            for channel in range(3):
                tile[y, x, channel] += cover * (colour[channel] - tile[y, x, channel])
