"""Control points every 0.3, 0.6, 0.9 and 1.6 mm: longer and simpler strokes."""

from pathlib import Path

from _scans import scan
from _sheets import sheet

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "bonsai.nii.gz")
    iso = 40.0 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, "anterior", size // 2)
    gb = ig.isosurface(volume, iso, camera, islands=0.01)
    hands = [ig.Hand(interval=mm) for mm in (0.3, 0.6, 0.9, 1.6)]
    return sheet(
        [ig.draw_lines(gb, ig.style("pencil", contour=0.55, valley=0, ridge=0, hand=hand), width_mm=100) for hand in hands]
    )
