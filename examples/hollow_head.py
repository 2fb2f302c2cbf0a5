"""Skin as a shell of 5 mm, a window with rounded rims cut into it, and the skull within: union and difference of distances."""

from pathlib import Path

import numpy as np
from _scans import scan

import intaglio as ig

SKIN, BONE = (0.86, 0.66, 0.55), (0.98, 0.94, 0.84)
LIGHTS = (ig.Light(intensity=0.7), ig.Light(direction=(0.7, 0.0, 0.7), intensity=0.35))


def capsule(start: np.ndarray, end: np.ndarray, radius: float) -> ig.Volume:
    """Signed distance in mm to what a ball sweeps from start to end, on a grid of 3 mm about it."""
    low = np.minimum(start, end) - radius - 9
    count = np.ceil((np.maximum(start, end) + radius + 9 - low) / 3).astype(int) + 1
    z, y, x = (low[a] + 3.0 * np.arange(count[a]) for a in (2, 1, 0))
    p = np.stack(np.meshgrid(z, y, x, indexing="ij")[::-1], axis=-1)
    along = np.clip(((p - start) @ (end - start)) / ((end - start) @ (end - start)), 0, 1)
    distance = np.linalg.norm(p - start - along[..., None] * (end - start), axis=-1) - radius
    return ig.Volume.from_array(distance.astype(np.float32), 3.0, low)


def make(data: Path | None, size: int) -> ig.Image:
    volume, real = scan(data, "ct_head.nii.gz")
    iso = 0.2 if real else ig.body_surface(volume)[0]
    skin = ig.redistance(volume, iso)
    bone = ig.redistance(volume, 0.5 if real else 1.7 * iso)
    middle = volume.corners.mean(axis=0)
    extent = volume.corners.max(axis=0) - volume.corners.min(axis=0)
    ends = [middle + extent * place for place in ((-0.6, 0.1, 0.12), (0.05, 0.45, 0.12))]
    window = capsule(ends[0], ends[1], 0.2 * float(extent.min()))
    wall = ig.difference(skin, ig.offset(skin, -5.0), window, smooth=4.0)
    camera = ig.surface_camera(volume, iso, "anterior-left", 2 * size)
    look = {"inside": "below", "islands": 0.01, "lights": LIGHTS, "material": ig.Material(ambient=0.2)}
    layers = [ig.isosurface(field, 0.0, camera, **look) for field in (wall, bone)]
    nearer = np.argmin([gb.depth for gb in layers], axis=0)[..., None]
    picture = np.choose(nearer, [ig.shade(gb, colour=c).array for gb, c in zip(layers, (SKIN, BONE), strict=True)])
    height, width = (n // 2 for n in picture.shape[:2])
    return ig.Image(picture[: 2 * height, : 2 * width].reshape(height, 2, width, 2, 4).mean(axis=(1, 3)))
