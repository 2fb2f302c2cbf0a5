"""Averaging over a surface in the image, never across its contours, at a cost that does not depend on the distance."""

# E. Gastal, M. Oliveira, "Domain transform for edge-aware image and video processing", 2011 (recursive filter).

from __future__ import annotations

import math
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import kernel, strips
from intaglio.gbuffer import GBuffer

Field = NDArray[np.float32]

# More would alias in the cache, where rows of a picture lie a power of two apart.
ROWS = 4

_links: WeakKeyDictionary[GBuffer, Field] = WeakKeyDictionary()


@kernel
def _connect(y0, y1, normal, edge, depth, links):  # type: ignore[no-untyped-def]
    """How much a pixel shares with its right and lower neighbour: nothing across a jump, little across a crease."""
    h, w = depth.shape
    for y in range(y0, y1):
        for x in range(w):
            if depth[y, x] == np.inf:
                continue
            for side in range(2):
                xx = x + 1 - side
                yy = y + side
                if xx < w and yy < h and depth[yy, xx] != np.inf and not edge[y, x, side] >= 0.0:
                    turn = 1.0
                    for c in range(3):
                        turn -= normal[y, x, c] * normal[yy, xx, c]
                    links[side, y, x] = math.exp(-10.0 * max(turn, 0.0))


@kernel
def _smooth_rows(y0, y1, field, links, feedback):  # type: ignore[no-untyped-def]
    """Each row there and back. Rows go in step, for one alone waits at every pixel for the one before."""
    w = field.shape[2]
    for c in range(field.shape[0]):
        for top in range(y0, y1, ROWS):
            end = min(top + ROWS, y1)
            for x in range(1, w):
                for y in range(top, end):
                    field[c, y, x] += feedback * links[0, y, x - 1] * (field[c, y, x - 1] - field[c, y, x])
            for x in range(w - 2, -1, -1):
                for y in range(top, end):
                    field[c, y, x] += feedback * links[0, y, x] * (field[c, y, x + 1] - field[c, y, x])


@kernel
def _smooth_columns(x0, x1, field, links, feedback):  # type: ignore[no-untyped-def]
    h = field.shape[1]
    for c in range(field.shape[0]):
        for y in range(1, h):
            for x in range(x0, x1):
                a = feedback * links[1, y - 1, x]
                field[c, y, x] += a * (field[c, y - 1, x] - field[c, y, x])
        for y in range(h - 2, -1, -1):
            for x in range(x0, x1):
                a = feedback * links[1, y, x]
                field[c, y, x] += a * (field[c, y + 1, x] - field[c, y, x])


def connections(gb: GBuffer) -> Field:
    """(2, h, w) links of a G-buffer for `smooth`: 1 on a smooth surface, 0 across a jump in depth; kept with the G-buffer."""
    if gb not in _links:
        h, w = gb.depth.shape
        links = np.zeros((2, h, w), dtype=np.float32)
        strips(_connect, h, gb.normal, gb.border, gb.depth, links, size=32)
        _links[gb] = links
    return _links[gb]


def smooth(field: Field, links: Field, sigma: float, passes: int = 3) -> None:
    """Filter the channels of `field` (c, h, w) in place with a scale of sigma pixels, not across broken links.

    links (2, h, w) is 0..1 between a pixel and its right [0] and lower [1] neighbour. The cost does not depend on sigma.
    """
    height, width = field.shape[1:]
    for i in range(passes):
        scale = sigma * math.sqrt(3.0) * 2.0 ** (passes - i - 1) / math.sqrt(4.0**passes - 1.0)
        feedback = np.float32(math.exp(-math.sqrt(2.0) / max(scale, 1e-3)))
        strips(_smooth_rows, height, field, links, feedback, size=64)
        strips(_smooth_columns, width, field, links, feedback, size=64)


def blurred(gb: GBuffer, image: Field, sigma: float) -> Field:
    """An image (h, w) averaged over sigma pixels, each surface for itself; unchanged where nothing was hit."""
    channels = np.where(gb.mask, image, 0.0)[None].astype(np.float32)
    smooth(channels, connections(gb), sigma)
    return np.where(gb.mask, channels[0], image)
