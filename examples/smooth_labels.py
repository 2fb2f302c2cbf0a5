"""Organs of a label map in voxels of 3 mm: the faces of their voxels, and `label_distance`, which keeps volume and thin parts."""

from pathlib import Path

import numpy as np
from _scans import scan

import intaglio as ig

LIGHTS = (ig.Light(direction=(-0.5, 0.7, 0.6), intensity=0.85), ig.Light(direction=(0.8, 0.1, 0.5), intensity=0.2))
# Liver, kidneys and vertebrae.
ORGANS = (((5,), (0.62, 0.30, 0.24)), ((2, 3), (0.72, 0.46, 0.30)), (tuple(range(26, 34)), (0.93, 0.86, 0.72)))


def make(data: Path | None, size: int) -> ig.Image:
    labels, real = scan(data, "ct_abdomen_labels.nii.gz")
    if not real:
        iso, _ = ig.body_surface(labels)
        labels = ig.Volume((labels.array > iso).astype(np.uint8), labels.world_from_index)
    present = [(found, colour) for of, colour in ORGANS if (found := tuple(np.intersect1d(labels.array, of).tolist()))]
    organs = present or [((1,), ORGANS[2][1])]
    whole = ig.label_distance(labels, [label for of, _ in organs for label in of], smooth=False)
    camera = ig.Camera.looking("posterior", whole, (size // 2, size // 2), margin=0.02)
    shots = []
    for smooth in (False, True):
        picture = np.ones((size // 2, size // 2, 4), dtype=np.float32)
        nearest = np.full(picture.shape[:2], np.inf, dtype=np.float32)
        for of, colour in organs:
            body = ig.label_distance(labels, of, smooth=smooth)
            depth = ig.isosurface(body, 0.0, camera, inside="below").depth
            lit = ig.render(
                ig.Volume(-body.array, body.world_from_index), None, camera, mode="isosurface", surfaces=[(0.0, colour, 1.0)],
                lights=LIGHTS,
            ).array  # fmt: skip
            front = np.isfinite(depth) & (depth < nearest)
            picture[front, :3], nearest[front] = lit[front, :3], depth[front]
        shots.append(picture)
    return ig.Image(np.concatenate(shots, axis=1))
