"""A tooth in six media: the plain pen, pencil, graphite, charcoal, chalk and ink."""

from pathlib import Path

from _scans import scan
from _sheets import sheet

import intaglio as ig
from intaglio.brush import BRUSHES
from intaglio.plate import PLATE_LIGHTS, PLATE_MATERIAL


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "tooth.nhdr")
    iso = 500.0 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, (0.3, 0.9, 0.25), size // 2)
    gb = ig.isosurface(volume, iso, camera, lights=PLATE_LIGHTS, material=PLATE_MATERIAL, islands=0.01)
    styles = [
        ig.style("charcoal", brush=brush, contour=0.5, thinnest=0.3, thickest=0.7, separation=0.8) for brush in ("pen", *BRUSHES)
    ]
    return sheet([ig.draw(gb, style, width_mm=60) for style in styles], columns=3)
