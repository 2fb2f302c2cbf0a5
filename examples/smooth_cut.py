"""A ball cut out of a box on 64 voxels a side: of masks on the left, of distance fields on the right."""

from pathlib import Path

import numpy as np

import intaglio as ig

SIDE = 64
LIGHTS = (ig.Light(intensity=0.7), ig.Light(direction=(0.9, -0.3, 0.5), intensity=0.3))


def solids() -> tuple[ig.Volume, ig.Volume]:
    """Signed distances in mm to a box and to a ball over one of its corners."""
    axis = np.linspace(-1.2, 1.2, SIDE)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    past = np.stack([abs(x) - 1.0, abs(y) - 1.0, abs(z) - 1.0])
    box = np.linalg.norm(np.maximum(past, 0), axis=0) + np.minimum(past.max(axis=0), 0)
    ball = np.sqrt((x - 0.75) ** 2 + (y - 0.75) ** 2 + (z - 0.75) ** 2) - 0.95
    box_field, ball_field = (ig.Volume.from_array(d.astype(np.float32), axis[1] - axis[0], (axis[0],) * 3) for d in (box, ball))
    return box_field, ball_field


def make(data: Path | None, size: int) -> ig.Image:
    box, ball = solids()
    smooth = ig.difference(box, ball)
    mask = ig.Volume((box.array < 0) & (ball.array >= 0), box.world_from_index)
    camera = ig.Camera.looking((0.55, 1.0, 0.75), box, (size, size), zoom=1.25)
    look = {"lights": LIGHTS, "material": ig.Material(ambient=0.15)}
    left = ig.isosurface(mask, 0.5, camera, **look)
    right = ig.isosurface(smooth, 0.0, camera, inside="below", **look)
    pictures = [ig.shade(gb, colour=(0.93, 0.74, 0.54), reduce=2).array for gb in (left, right)]
    return ig.Image(np.concatenate(pictures, axis=1))
