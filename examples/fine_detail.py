"""Teeth of a skull: from a field of 256³, and from a sparse one of 1024³, of which only what is in sight is unpacked."""

from pathlib import Path

import numpy as np
from _scans import model

import intaglio as ig

BONE = (0.93, 0.86, 0.72)
LIGHTS = (ig.Light(direction=(-0.5, 0.7, 0.6), intensity=0.85), ig.Light(direction=(0.8, 0.1, 0.5), intensity=0.2))


def make(data: Path | None, size: int) -> ig.Image:
    mesh = model(data, "skull.obj", up="y")
    low, high = mesh.corners.min(axis=0), mesh.corners.max(axis=0)
    box = low + (high - low) * ((0.3, 0.68, 0.12), (0.7, 1.0, 0.42))
    camera = ig.Camera.looking((0.35, 1.0, 0.1), box, (size // 2, size // 2), margin=0.0)
    shots = []
    for resolution in (256, 1024) if size > 900 else (64, 256):
        field = ig.sparse_field(mesh, resolution=resolution).volume(*box)
        inside = ig.Volume(-field.array, field.world_from_index)
        shots.append(ig.render(inside, None, camera, mode="isosurface", surfaces=[(0.0, BONE, 1.0)], lights=LIGHTS).array)
    return ig.Image(np.concatenate(shots, axis=1))
