"""The engine block in polished metal, mirroring a studio with two windows."""

from pathlib import Path

import numpy as np
from _scans import scan

import intaglio as ig


def studio(height: int = 256) -> np.ndarray:
    """Latitude-longitude map of a grey room, darker below, with a tall window on either side of the viewer."""
    polar = (np.arange(height)[:, None] + 0.5) / height
    around = ((np.arange(2 * height) + 0.5) / height - 1.0)[None]
    room = 0.35 + 0.4 * (1 - polar) ** 2 - 0.25 * np.clip(4 * polar - 2, 0, 1)
    windows = sum(
        np.clip((w - abs(around - at)) * 30, 0, 1) * np.clip((0.24 - abs(polar - 0.32)) * 30, 0, 1)
        for at, w in ((-0.02, 0.07), (0.45, 0.1))
    )
    return np.repeat((room + 0.9 * windows)[..., None], 3, axis=2).astype(np.float32) * np.float32((0.97, 1.0, 1.04))


def make(data: Path | None, size: int) -> ig.Image:
    volume, real = scan(data, "engine.nii.gz")
    iso = 80.0 if real else ig.body_surface(volume)[0]
    camera = ig.surface_camera(volume, iso, (0.5, 0.6, 0.5) if real else (-0.75, 0.6, 0.35), 2 * size)
    gb = ig.isosurface(volume, iso, camera, islands=0.01)
    return ig.shade(gb, colour=(0.75, 0.78, 0.8), environment=studio(), mirror=0.55, reduce=2)
