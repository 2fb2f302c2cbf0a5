"""A hollow inside denser matter: pulp chamber and root canals of a molar, its dentine and enamel as veils."""

import math
from pathlib import Path

from _scans import scan

import intaglio as ig


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "tooth.nhdr")
    if real:
        parts = [
            ig.Part(volume=volume, iso=(-math.inf, 600.0), style="engraving", colour="#8a2b1a", name="pulp"),
            ig.Part(volume=volume, iso=(600.0, 930.0), opacity=0.4, name="dentine"),
            ig.Part(volume=volume, iso=930.0, opacity=0.5, lines_only=True, name="enamel"),
        ]
    else:
        iso, _ = ig.body_surface(volume)
        parts = [
            ig.Part(volume=volume, iso=(-math.inf, 0.7 * iso), style="engraving", colour="#8a2b1a", name="cavities"),
            ig.Part(volume=volume, iso=iso, opacity=0.4, name="body"),
        ]
    return ig.illustrate(parts, camera=ig.parts_camera(parts, (0.3, 0.9, 0.25), size))
