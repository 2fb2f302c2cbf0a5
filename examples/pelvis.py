"""Bones of an abdominal CT of 3 mm voxels, engraved."""

from pathlib import Path

from _scans import scan

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "ct_abdomen.nii.gz")
    iso = 130.0 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, "anterior", size)
    return ig.hatch(volume, iso=iso, camera=camera, style="engraving")
