"""Meshes in 256 voxels along their longest side, and the zero level of their distance fields on the same grid."""

from pathlib import Path

import numpy as np
from _scans import model

import intaglio as ig

# File, the axis it stands on, colour.
MODELS = (
    ("bunny_watertight.obj", "z", (0.80, 0.62, 0.46)),
    ("armadillo.obj", "y", (0.55, 0.66, 0.52)),
    ("skull.obj", "y", (0.93, 0.86, 0.72)),
)
LIGHTS = (ig.Light(direction=(-0.5, 0.7, 0.6), intensity=0.85), ig.Light(direction=(0.8, 0.1, 0.5), intensity=0.2))


def make(data: Path | None, size: int) -> ig.Image:
    columns = []
    for name, up, colour in MODELS:
        mesh = model(data, name, up=up)
        camera = ig.Camera.looking((0.5, 1.0, 0.15), mesh, (size // 3, size // 3), margin=0.04)
        look = {"mode": "isosurface", "lights": LIGHTS}
        voxels = ig.render(ig.voxelize(mesh, resolution=256), None, camera, surfaces=[(0.5, colour, 1.0)], **look)
        field = ig.distance_field(mesh, resolution=256, band=0.02)
        inwards = ig.Volume(-field.array, field.world_from_index)
        columns.append(
            np.concatenate([voxels.array, ig.render(inwards, None, camera, surfaces=[(0.0, colour, 1.0)], **look).array])
        )
    return ig.Image(np.concatenate(columns, axis=1))
