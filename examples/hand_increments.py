"""Strokes begin after 2, 4, 6 and 10 control points: fewer and fewer overlap."""

from pathlib import Path

from _scans import scan
from _sheets import sheet

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "ct_feet_dicom.tar.xz")
    iso = -300.0 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, (0.3, 1.0, 0.6), size // 2)
    gb = ig.isosurface(volume, iso, camera, islands=0.01)
    hands = [ig.Hand(increment=n) for n in (2, 4, 6, 10)]
    return sheet(
        [ig.draw_lines(gb, ig.style("pencil", contour=0.55, valley=0, ridge=0, hand=hand), width_mm=100) for hand in hands]
    )
