"""Strokes whose ends leave the contour by up to 0, 0.6, 1.6 and 3.1 mm."""

from pathlib import Path

from _scans import scan
from _sheets import sheet

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "ct_head.nii.gz")
    iso = 0.2 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, "anterior-left", size // 2)
    gb = ig.isosurface(volume, iso, camera, islands=0.01)
    hands = [ig.Hand(deviation=mm) for mm in (0, 0.6, 1.6, 3.1)]
    return sheet(
        [ig.draw_lines(gb, ig.style("pencil", contour=0.55, valley=0, ridge=0, hand=hand), width_mm=100) for hand in hands]
    )
