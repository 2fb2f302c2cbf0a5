"""The same head in pencil."""

from pathlib import Path

import intaglio as ig
from intaglio.datasets import head


def make(data: Path | None, size: int) -> ig.Drawing:
    volume = head()
    iso, _ = ig.body_surface(volume)
    camera = ig.surface_camera(volume, iso, (-0.75, 0.6, 0.35), size)
    return ig.hatch(volume, iso=iso, camera=camera, style="pencil")
