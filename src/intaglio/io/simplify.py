"""Strokes as arrays of nodes, and fewer of them."""

# D. H. Douglas and T. K. Peucker, "Algorithms for the reduction of the number of points required to represent a
# digitized line or its caricature", 1973.

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import kernel
from intaglio.drawing import Layer
from intaglio.errors import InputError

Nodes = NDArray[np.float64]
Offsets = NDArray[np.int64]

FARTHEST = 1e5  # mm


def stroke_nodes(layer: Layer) -> Nodes:
    """(n, 4) x, y, half width in mm and opacity of all points of a layer's strokes; InputError for what cannot be drawn."""
    strokes = layer.strokes
    return _nodes(strokes.points, strokes.width, strokes.opacity, f"strokes of layer {layer.name!r}")


def dot_nodes(layer: Layer) -> Nodes:
    """(n, 4) x, y, radius in mm and opacity of a layer's dots; InputError for what cannot be drawn."""
    dots = layer.dots
    return _nodes(dots.points, dots.diameter, dots.opacity, f"dots of layer {layer.name!r}")


def _nodes(points: NDArray[np.float32], width: NDArray[np.float32], opacity: NDArray[np.float32], what: str) -> Nodes:
    nodes = np.empty((len(points), 4))
    nodes[:, :2], nodes[:, 2], nodes[:, 3] = points, width, opacity
    if not (np.abs(nodes) <= FARTHEST).all():
        raise InputError(f"{what} must have finite positions, widths and opacities, at most {FARTHEST:g} mm")
    if len(nodes) and nodes[:, 2:].min() < 0:
        raise InputError(f"{what} must have no negative width or opacity, not {nodes[:, 2:].min():g}")
    nodes[:, 2] *= 0.5
    np.minimum(nodes[:, 3], 1.0, out=nodes[:, 3])
    return nodes


@kernel
def _keep(nodes, offsets, tolerance, keep):  # type: ignore[no-untyped-def]
    stack = np.empty((64, 2), np.int64)
    for s in range(len(offsets) - 1):
        first, last = offsets[s], offsets[s + 1] - 1
        keep[first] = True
        keep[last] = True
        stack[0, 0], stack[0, 1] = first, last
        depth = 1
        while depth > 0:
            depth -= 1
            i, j = stack[depth, 0], stack[depth, 1]
            ax, ay, ar, ao = nodes[i, 0], nodes[i, 1], nodes[i, 2], nodes[i, 3]
            dx, dy, dr, do = nodes[j, 0] - ax, nodes[j, 1] - ay, nodes[j, 2] - ar, nodes[j, 3] - ao
            square = dx * dx + dy * dy
            scale = 1.0 / square if square > 0.0 else 0.0
            worst, at = tolerance, -1
            for k in range(i + 1, j):
                x, y = nodes[k, 0] - ax, nodes[k, 1] - ay
                t = min(max((x * dx + y * dy) * scale, 0.0), 1.0)
                x, y = x - t * dx, y - t * dy
                away = math.sqrt(x * x + y * y) + abs(nodes[k, 2] - ar - t * dr)
                away = max(away, abs(nodes[k, 3] - ao - t * do) * 64.0 * tolerance)
                if away > worst:
                    worst, at = away, k
            if at >= 0:
                keep[at] = True
                # The larger part waits below the smaller one, so that the stack stays below log2 of the length.
                if at - i > j - at:
                    stack[depth, 0], stack[depth, 1], stack[depth + 1, 0], stack[depth + 1, 1] = i, at, at, j
                else:
                    stack[depth, 0], stack[depth, 1], stack[depth + 1, 0], stack[depth + 1, 1] = at, j, i, at
                depth += 2


def simplified(nodes: Nodes, offsets: Offsets, tolerance: float) -> tuple[Nodes, Offsets]:
    """The nodes that matter: no stroke moves or widens by more than the tolerance (mm), no opacity by more than 1/64."""
    keep = np.zeros(len(nodes), dtype=np.bool_)
    _keep(nodes, offsets, tolerance, keep)
    counts = np.concatenate([[0], np.cumsum(keep)])
    return nodes[keep], counts[offsets]
