"""From face to skull in four steps: mixed distances to the two surfaces of one CT."""

from pathlib import Path

import numpy as np
from _scans import scan

import intaglio as ig

STEPS = (0.0, 0.45, 0.75, 1.0)
SKIN, BONE = np.array([0.86, 0.66, 0.55]), np.array([0.98, 0.94, 0.84])
LIGHTS = (ig.Light(intensity=0.7), ig.Light(direction=(0.7, 0.0, 0.7), intensity=0.35))


def make(data: Path | None, size: int) -> ig.Image:
    volume, real = scan(data, "ct_head.nii.gz")
    iso = 0.2 if real else ig.body_surface(volume)[0]
    skin = ig.redistance(volume, iso)
    bone = ig.redistance(volume, 0.5 if real else 1.7 * iso)
    camera = ig.surface_camera(volume, iso, "anterior-left", size)
    look = {"inside": "below", "islands": 0.01, "lights": LIGHTS, "material": ig.Material(ambient=0.2)}
    pictures = [
        ig.shade(ig.isosurface(ig.morph(skin, bone, t), 0.0, camera, **look), colour=tuple((1 - t) * SKIN + t * BONE), reduce=2)
        for t in STEPS
    ]
    a, b, c, d = (picture.array for picture in pictures)
    return ig.Image(np.concatenate([np.concatenate(row, axis=1) for row in ((a, b), (c, d))]))
