"""Control points that leave the contour by up to 0, 0.9, 2.2 and 4.1 mm: a scribble."""

from pathlib import Path

from _scans import scan
from _sheets import sheet

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "engine.nii.gz")
    iso = 80.0 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, (0.5, 0.6, 0.5), size // 2)
    gb = ig.isosurface(volume, iso, camera, islands=0.01)
    hands = [ig.Hand(perturbation=mm) for mm in (0, 0.9, 2.2, 4.1)]
    return sheet(
        [ig.draw_lines(gb, ig.style("pencil", contour=0.55, valley=0, ridge=0, hand=hand), width_mm=100) for hand in hands]
    )
