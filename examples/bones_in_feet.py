"""Volumetric hatching in pen and ink: the bones of both feet within their skin."""

from pathlib import Path

from _scans import scan

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "ct_feet_dicom.tar.xz")
    skin, bones = (-200.0, 200.0) if real else (ig.body_surface(volume)[0], 2.0 * ig.body_surface(volume)[0])
    veil = ig.style("pen-and-ink", ridge=0.0, contour=0.35)
    parts = [
        ig.Part(volume=volume, iso=bones, style="pen-and-ink", name="bones"),
        ig.Part(volume=volume, iso=skin, style=veil, opacity=0.4, lines_only=True, name="skin"),
    ]
    return ig.illustrate(parts, camera=ig.parts_camera(parts, (0.3, 1.0, 0.6), size), halo=0.3)
