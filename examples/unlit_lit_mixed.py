"""A tooth that only glows, the same with light on all of it, and with light where it has a surface."""

from pathlib import Path

import numpy as np
from _scans import scan

import intaglio as ig

# Parts of the range: pulp and soft rim, dentine, enamel. Opacity of a millimetre.
TOOTH = ig.TransferFunction.from_points(
    [
        (0.43, "#8a3f2e", 0.0),
        (0.50, "#b8643f", 0.06),
        (0.56, "#d99a5b", 0.02),
        (0.66, "#e6b878", 0.03),
        (0.76, "#f2e2c0", 0.12),
        (1.00, "#fffdf4", 0.5),
    ],
    name="tooth",
)
LIGHTS = (ig.Light(intensity=0.85), ig.Light(direction=(0.8, -0.1, 0.6), intensity=0.3))
MATERIAL = ig.Material(ambient=0.3, diffuse=0.9, specular=0.3, shininess=30.0)


def make(data: Path | None, size: int) -> ig.Image:
    volume, real = scan(data, "tooth.nhdr")
    low, high = volume.range
    onset = low + 0.43 * (high - low) if real else ig.body_surface(volume)[0]
    tissues = TOOTH.mapped((0.0, 0.43, 1.0), (low, onset, high))
    camera = ig.Camera.looking((0.6, 1.0, 0.25) if real else (-0.75, 0.6, 0.35), volume, 2 * size // 3 * 2, zoom=1.15)
    # What changes by a tenth of the range within a voxel is a surface.
    steep = 0.1 * (high - low) / float(volume.spacing.min())
    looks = ({"lit": False}, {"fade": 0.0}, {"fade": steep})
    shots = [
        ig.render(volume, tissues, camera, lights=LIGHTS, material=MATERIAL, classify="preintegrated", **look).array
        for look in looks
    ]
    return ig.Image(np.concatenate(shots, axis=1))
