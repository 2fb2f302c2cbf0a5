"""Volumetric hatching: the skull in pencil, the skin over it as a veil of contours."""

from pathlib import Path

from _scans import scan

import intaglio as ig

# Eyelids, lips and the wings of the nose are wider hollows than a style asks for.
VEIL = ig.style("pencil", valley=3.5, ridge=0.0, contour=0.4)


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "ct_head.nii.gz")
    skin, skull = (0.2, 0.55) if real else (ig.body_surface(volume)[0], 2.0 * ig.body_surface(volume)[0])
    parts = [
        ig.Part(volume=volume, iso=skull, islands=0.05, name="skull"),
        ig.Part(volume=volume, iso=skin, style=VEIL, opacity=0.45, lines_only=True, colour="#7a4a32", name="skin"),
    ]
    return ig.illustrate(parts, camera=ig.parts_camera(parts, (0.6, 1.0, 0.12), size))
