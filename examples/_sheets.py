"""Contact sheets: several plates side by side on one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import intaglio as ig
from intaglio.drawing import Layer


def sheet(plates: Sequence[ig.Drawing], columns: int = 2, gap: float = 4.0) -> ig.Drawing:
    """Drawings in rows, from the upper left, as one; on the paper of the first."""
    width, height = max(p.width_mm for p in plates) + gap, max(p.height_mm for p in plates) + gap
    layers: list[Layer] = []
    for number, plate in enumerate(plates):
        row, column = divmod(number, columns)
        shift = np.array([gap + column * width, gap + row * height], dtype=np.float32)
        for layer in plate.layers:
            strokes = replace(layer.strokes, points=layer.strokes.points + shift)
            layers.append(replace(layer, name=f"{number + 1} {layer.name}", strokes=strokes))
    rows = -(-len(plates) // columns)
    return ig.Drawing(tuple(layers), gap + columns * width, gap + rows * height, plates[0].paper, grain=plates[0].grain)
