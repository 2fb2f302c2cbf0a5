"""Skin as a veil, bone under it: a transfer function of several tissues."""

from pathlib import Path

from _scans import scan

import intaglio as ig

# Values of the scan: air 0, skin from 0.15, soft tissue 0.2 to 0.3, bone from 0.4. Opacity of a millimetre.
TISSUES = ig.TransferFunction.from_points(
    [
        (0.10, "#d9a184", 0.0),
        (0.16, "#e6a888", 0.11),
        (0.21, "#e8bda2", 0.0),
        (0.30, "#b5473a", 0.0),
        (0.38, "#d9b48a", 0.02),
        (0.46, "#efdfc0", 0.55),
        (0.60, "#fbf3e2", 0.9),
        (1.00, "#fffaf0", 0.98),
    ],
    name="tissues",
)
LIGHTS = (ig.Light(intensity=0.8), ig.Light(direction=(0.8, -0.1, 0.6), intensity=0.35))
MATERIAL = ig.Material(ambient=0.24, diffuse=0.85, specular=0.14, shininess=18.0)


def make(data: Path | None, size: int) -> ig.Image:
    volume, real = scan(data, "ct_head.nii.gz")
    if not real:
        iso, _ = ig.body_surface(volume)
        tissues = TISSUES.mapped((0.0, 0.16, 1.0), (0.0, iso, volume.range[1]))
    else:
        tissues = TISSUES
    camera = ig.Camera.looking((-0.8, 1.0, 0.1), volume, 2 * size, projection="perspective", fov=20, zoom=1.3)
    return ig.render(volume, tissues, camera, lights=LIGHTS, material=MATERIAL, classify="preintegrated")
