"""A tooth in graphite."""

from pathlib import Path

from _scans import scan

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "tooth.nhdr")
    iso = 500.0 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, (0.3, 0.9, 0.25), size)
    return ig.hatch(volume, iso=iso, camera=camera, style="graphite")
