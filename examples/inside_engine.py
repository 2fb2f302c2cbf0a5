"""The inner parts of an engine in pen and ink, its casting as a veil."""

from pathlib import Path

from _scans import scan

import intaglio as ig

# Above it, mm, lies the seat of the cylinder head, as dense as the inner parts that it would cover.
SEAT = 32.0


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "engine.nii.gz")
    casting, inner = (80.0, 180.0) if real else (ig.body_surface(volume)[0], 2.0 * ig.body_surface(volume)[0])
    cut = (ig.Selection.plane((0.0, 0.0, SEAT), (0.0, 0.0, 1.0)),) if real else ()
    veil = ig.style("pen-and-ink", contour=0.35)
    parts = [
        ig.Part(volume=volume, iso=inner, style="pen-and-ink", selections=cut, name="inner parts"),
        ig.Part(volume=volume, iso=casting, style=veil, opacity=0.35, lines_only=True, name="casting"),
    ]
    return ig.illustrate(parts, camera=ig.parts_camera(parts, (-0.6, -0.7, 0.4), size))
