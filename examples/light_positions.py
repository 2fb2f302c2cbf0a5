"""Light from the upper left, above, the right and below."""

from pathlib import Path

from _scans import scan
from _sheets import sheet

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "ct_head.nii.gz")
    iso = 0.2 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, "anterior-left", size // 2)
    plates = []
    for direction in ((-0.6, 0.6, 0.5), (0.0, 1.0, 0.2), (1.0, 0.1, 0.4), (0.0, -1.0, 0.3)):
        lights = (ig.Light(direction=direction, intensity=0.85),)
        plates.append(ig.hatch(volume, iso=iso, camera=camera, style="pencil", lights=lights, width_mm=100))
    return sheet(plates)
