"""A CT of a head in charcoal, on rough paper."""

from pathlib import Path

from _scans import scan

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "ct_head.nii.gz")
    iso = 0.2 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, "anterior-left", size)
    return ig.hatch(volume, iso=iso, camera=camera, style="charcoal")
