"""Bone inside skin: isosurfaces within one another, found on each ray without polygons."""

from pathlib import Path

from _scans import scan

import intaglio as ig

SKIN, BONE = (0.86, 0.66, 0.55), (0.98, 0.94, 0.84)
LIGHTS = (ig.Light(intensity=0.8), ig.Light(direction=(0.7, 0.0, 0.7), intensity=0.25))


def make(data: Path | None, size: int) -> ig.Image:
    volume, real = scan(data, "ct_head.nii.gz")
    if real:
        surfaces = [(0.18, SKIN, 0.28), (0.5, BONE, 1.0)]
    else:
        iso, _ = ig.body_surface(volume)
        surfaces = [(iso, SKIN, 0.3), (2.0 * iso, BONE, 0.9)]
    camera = ig.Camera.looking((0.55, 1.0, 0.15), volume, 2 * size, zoom=1.2)
    return ig.render(
        volume, None, camera, mode="isosurface", surfaces=surfaces, lights=LIGHTS, material=ig.Material(ambient=0.25)
    )
