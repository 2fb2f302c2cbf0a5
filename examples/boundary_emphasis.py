"""A tooth by value alone (left), and by value and slope (right): where nothing changes, nothing hides what does."""

from pathlib import Path

import numpy as np
from _scans import scan

import intaglio as ig

DENTINE, ENAMEL = (0.80, 0.58, 0.42), (0.96, 0.94, 0.85)


def make(data: Path | None, size: int) -> ig.Image:
    volume, _ = scan(data, "tooth.nhdr")
    low, high = volume.range
    unit = (high - low) / 1300
    points = [(420, DENTINE, 0.0), (500, DENTINE, 0.06), (800, DENTINE, 0.06), (850, ENAMEL, 0.5)]
    function = ig.TransferFunction.from_points([(low + v * unit, colour, opacity) for v, colour, opacity in points])
    slopes = [(20 * unit, 0.0), (120 * unit, 1.0)]
    emphasized = ig.TransferFunction2D.emphasized(function, volume.range, slopes)
    camera = ig.Camera.looking("anterior", volume, (size * 2 // 3, size))
    material = ig.Material(two_sided=True)
    shots = [ig.render(volume, f, camera, step=0.2, material=material).array for f in (function, emphasized)]
    return ig.Image(np.concatenate(shots, axis=1))
