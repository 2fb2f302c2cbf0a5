"""A bonsai in nothing but contours, drawn by hand."""

from pathlib import Path

from _scans import scan

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "bonsai.nii.gz")
    iso = 40.0 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, "anterior", size)
    return ig.contour(volume, iso=iso, camera=camera, style="pencil")
