"""Six plates of a turntable: a skull under its skin; strokes go with both surfaces."""

from pathlib import Path

from _scans import scan
from _sheets import sheet

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "ct_head.nii.gz")
    skin, skull = (0.2, 0.55) if real else (ig.body_surface(volume)[0], 2.0 * ig.body_surface(volume)[0])
    veil = ig.style("pencil", valley=3.5, ridge=0.0, contour=0.4)
    parts = [
        ig.Part(volume=volume, iso=skull, islands=0.05, name="skull"),
        ig.Part(volume=volume, iso=skin, style=veil, opacity=0.45, lines_only=True, colour="#7a4a32", name="skin"),
    ]
    turn = {"frames": 6, "degrees": 60, "view": (0.6, 1.0, 0.12)}
    return sheet(list(ig.turntable(parts, **turn, size=size // 2, width_mm=90.0, halo=0.3)), columns=3)
