"""The CT head cut near its middle, engraved: sections are ruled, bone lighter than what is soft, and hollows hatched."""

from pathlib import Path

from _scans import scan

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "ct_head.nii.gz")
    iso = 0.2 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, (-1.0, 0.25, 0.12), size)
    x, y, z = volume.corners.mean(axis=0)
    tool = ig.Selection.plane((x + 3.0, y, z), (-1, 0, 0))
    return ig.hatch(volume, iso=iso, camera=camera, style="engraving", selections=[tool])
