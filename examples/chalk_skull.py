"""Its skull in chalk on dark paper: strokes are where it is bright."""

from pathlib import Path

from _scans import scan

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "ct_head.nii.gz")
    iso = 0.55 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, (-0.6, 0.8, 0.15), size)
    return ig.hatch(volume, iso=iso, camera=camera, style="chalk")
