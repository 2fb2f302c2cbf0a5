"""Strokes moved and turned by up to 0 mm and 0°, 0.3 and 2°, 0.6 and 4°, 2.2 and 13°."""

from pathlib import Path

from _scans import scan
from _sheets import sheet

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "tooth.nhdr")
    iso = 500.0 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, (0.3, 0.9, 0.25), size // 2)
    gb = ig.isosurface(volume, iso, camera, islands=0.01)
    hands = [ig.Hand(translation=mm, rotation=angle) for mm, angle in ((0, 0), (0.3, 2), (0.6, 4), (2.2, 13))]
    return sheet(
        [ig.draw_lines(gb, ig.style("pencil", contour=0.75, valley=0, ridge=0, hand=hand), width_mm=100) for hand in hands]
    )
