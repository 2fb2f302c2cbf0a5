"""The brightest value on each ray: vessels filled with contrast medium."""

from pathlib import Path

import intaglio as ig
from intaglio.datasets import head

# Ink on paper: the brighter the vessel, the darker and redder.
INK = ig.TransferFunction.from_points(
    [(0.05, "#ffffff", 1.0), (0.2, "#e8c9b8", 1.0), (0.5, "#b8463a", 1.0), (1.0, "#3a0d12", 1.0)], name="ink"
)


def make(data: Path | None, size: int) -> ig.Image:
    path = None if data is None else data / "volumes" / "aneurism.raw.gz"
    if path is not None and path.exists():
        volume = ig.read_volume(path, raw=((256, 256, 256), "uint8", (1.0, 1.0, 1.0)))
        view = "posterior"
    else:
        volume, view = head(), "left"
    camera = ig.Camera.looking(view, volume, 2 * size)
    return ig.render(volume, INK.rescaled(*volume.range), camera, mode="mip", step=0.25)
