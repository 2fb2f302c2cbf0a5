"""No, one, two and four layers of crosshatching."""

from pathlib import Path

from _scans import scan
from _sheets import sheet

import intaglio as ig
from intaglio.plate import PLATE_LIGHTS, PLATE_MATERIAL


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "engine.nii.gz")
    iso = 80.0 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, (0.5, 0.6, 0.5), size // 2)
    gb = ig.isosurface(volume, iso, camera, lights=PLATE_LIGHTS, material=PLATE_MATERIAL, islands=0.01)
    styles = [ig.style("engraving", separation=2.2, thickest=0.6, thinnest=0.1, crosshatch=value) for value in (0, 1, 2, 4)]
    return sheet([ig.draw(gb, style, width_mm=100) for style in styles])
