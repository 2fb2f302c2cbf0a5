"""Six plates of a turntable: lines move with the engine from one to the next."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from _scans import scan

import intaglio as ig
from intaglio.drawing import Drawing

ACROSS = 3
GAP = 4.0


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "engine.nii.gz")
    iso = 80.0 if real else ig.body_surface(volume)[0]
    turn = {"frames": 6, "degrees": 60, "view": (0.5, 0.6, 0.5)}
    plates = ig.turntable(volume, iso=iso, **turn, size=size // 2, width_mm=80.0, style="pen-and-ink", separation=0.65)
    layers, width, height = [], 0.0, 0.0
    for i, plate in enumerate(plates):
        corner = np.float32([i % ACROSS * (plate.width_mm + GAP), i // ACROSS * (plate.height_mm + GAP)])
        width, height = max(width, float(corner[0]) + plate.width_mm), max(height, float(corner[1]) + plate.height_mm)
        for layer in plate.layers:
            moved = replace(layer.strokes, points=layer.strokes.points + corner)
            layers.append(replace(layer, name=f"{i + 1} {layer.name}", strokes=moved))
    return Drawing(tuple(layers), width, height, title="An engine turns")
