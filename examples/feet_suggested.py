"""Feet in pencil, with suggestive contours: folds and tendons that are no contours yet."""

from pathlib import Path

from _scans import scan

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "ct_feet_dicom.tar.xz")
    iso = -200.0 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, (0.6, 0.8, 0.6), size)
    return ig.hatch(volume, iso=iso, camera=camera, style="pencil", suggestive=6.0)
