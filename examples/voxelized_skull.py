"""A skull's mesh in 32, 64, 128 and 256 voxels along its longest side: the normals of a binary grid know few directions."""

from pathlib import Path

import numpy as np
from _scans import model

import intaglio as ig

BONE = (0.93, 0.86, 0.72)
LIGHTS = (ig.Light(direction=(-0.5, 0.7, 0.6), intensity=0.85), ig.Light(direction=(0.8, 0.1, 0.5), intensity=0.2))


def make(data: Path | None, size: int) -> ig.Image:
    mesh = model(data, "skull.obj", up="y")
    camera = ig.Camera.looking((0.5, 1.0, 0.15), mesh, size * 3 // 5)
    shots = []
    for resolution in (32, 64, 128, 256):
        voxels = ig.voxelize(mesh, resolution=resolution)
        shots.append(ig.render(voxels, None, camera, mode="isosurface", surfaces=[(0.5, BONE, 1.0)], lights=LIGHTS).array)
    return ig.Image(np.concatenate([np.concatenate(shots[:2], axis=1), np.concatenate(shots[2:], axis=1)]))
