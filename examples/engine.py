"""An engine block from an industrial CT, in pen and ink."""

from pathlib import Path

from _scans import scan

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "engine.nii.gz")
    iso = 80.0 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, (0.5, 0.6, 0.5), size)
    # A casting has edges: rounded by up to 4 mm, they are lines.
    return ig.hatch(volume, iso=iso, camera=camera, style="pen-and-ink", ridge=4.0)
