"""The same head, shaded: what the strokes are drawn from."""

from pathlib import Path

import intaglio as ig
from intaglio.datasets import head


def make(data: Path | None, size: int) -> ig.Image:
    volume = head()
    iso, _ = ig.body_surface(volume)
    camera = ig.surface_camera(volume, iso, (-0.75, 0.6, 0.35), 2 * size)
    return ig.shade(ig.isosurface(volume, iso, camera, islands=0.01), reduce=2)
