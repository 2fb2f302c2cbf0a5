"""The CT head with a ball cut out of it, in pen and ink: a distance volume as the tool."""

from pathlib import Path

import numpy as np
from _scans import scan

import intaglio as ig


def ball(radius: float) -> ig.Volume:
    """Signed distance to a ball round the origin, 64 voxels a side, mm."""
    axis = np.linspace(-1.2, 1.2, 64) * radius
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    distance = np.sqrt(x * x + y * y + z * z) - radius
    return ig.Volume.from_array(distance.astype(np.float32), axis[1] - axis[0], (axis[0],) * 3, "ball")


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "ct_head.nii.gz")
    iso = 0.2 if real else ig.body_surface(volume)[0]
    corners = volume.corners
    extent = corners.max(axis=0) - corners.min(axis=0)
    pose = np.eye(4)
    pose[:3, 3] = corners.mean(axis=0) + extent * (-0.18, 0.22, 0.3)
    tool = ig.Selection.of(ball(0.24 * float(extent.min())), pose)
    camera = ig.surface_camera(volume, iso, "anterior-left-superior", size)
    return ig.hatch(volume, iso=iso, camera=camera, style="pen-and-ink", selections=[tool])
