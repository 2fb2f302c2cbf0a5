"""Colours looked up before interpolation (left) and after it (right), at the same rate of samples."""

from pathlib import Path

import numpy as np
from _scans import scan

import intaglio as ig

# Narrow shells, one within the other: as fine in the value as a sawtooth.
SHELLS = 6
COLOURS = ("#c8553d", "#f0d9a8", "#4f7f9c", "#f6efe2")


def shells(low: float, high: float) -> ig.TransferFunction:
    points = []
    for i in range(SHELLS):
        a, b = low + (high - low) * i / SHELLS, low + (high - low) * (i + 0.35) / SHELLS
        points += [(a, COLOURS[i % 4], 0.0), (a, COLOURS[i % 4], 0.75), (b, COLOURS[i % 4], 0.75), (b, COLOURS[i % 4], 0.0)]
    return ig.TransferFunction.from_points(points, name="shells")


def make(data: Path | None, size: int) -> ig.Image:
    volume, real = scan(data, "engine.nii.gz")
    low, high = volume.range
    function = shells(low + 0.25 * (high - low), high)
    camera = ig.Camera.looking((0.6, 1.0, 0.5) if real else (-0.75, 0.6, 0.35), volume, (size, size), zoom=2.2)
    shots = [ig.render(volume, function, camera, classify=when).array for when in ("pre", "post")]
    gap = np.ones((size, size // 40, 4), dtype=np.float32)
    return ig.Image(np.concatenate([shots[0], gap, shots[1]], axis=1))
