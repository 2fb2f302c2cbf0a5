"""Paper stays blank above a brightness of 0.3, 0.5, 0.7 and 0.9."""

from pathlib import Path

from _scans import scan
from _sheets import sheet

import intaglio as ig
from intaglio.plate import PLATE_LIGHTS, PLATE_MATERIAL


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "ct_head.nii.gz")
    iso = 0.2 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, "anterior-left", size // 2)
    gb = ig.isosurface(volume, iso, camera, lights=PLATE_LIGHTS, material=PLATE_MATERIAL, islands=0.01)
    styles = [ig.style("pencil", white=value) for value in (0.3, 0.5, 0.7, 0.9)]
    return sheet([ig.draw(gb, style, width_mm=100) for style in styles])
