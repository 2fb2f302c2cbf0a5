"""Lines 1.9, 0.95, 0.6 and 0.4 mm apart."""

from pathlib import Path

from _scans import scan
from _sheets import sheet

import intaglio as ig
from intaglio.plate import PLATE_LIGHTS, PLATE_MATERIAL


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "tooth.nhdr")
    iso = 500.0 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, (0.3, 0.9, 0.25), size // 2)
    gb = ig.isosurface(volume, iso, camera, lights=PLATE_LIGHTS, material=PLATE_MATERIAL, islands=0.01)
    styles = [ig.style("pen-and-ink", separation=mm, thickest=0.7 * mm, thinnest=0.08 * mm) for mm in (1.9, 0.95, 0.6, 0.4)]
    return sheet([ig.draw(gb, style, width_mm=100) for style in styles])
