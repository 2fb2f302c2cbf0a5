"""Reflection mapping: an environment far away, seen in the surface."""

# J. Blinn, M. Newell, "Texture and reflection in computer generated images", 1976.

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from intaglio.errors import InputError
from intaglio.gbuffer import GBuffer


def look_up(environment: NDArray[np.float32], direction: NDArray[np.float32]) -> NDArray[np.float32]:
    """Colours (..., 3) of a latitude-longitude map (h, w, 3) in directions (..., 3), bilinear.

    The top row is superior, the bottom row inferior, the middle column anterior, and columns run on over the patient's
    left, so that the map is what somebody inside the patient sees.
    """
    if environment.ndim != 3 or environment.shape[2] != 3 or min(environment.shape[:2]) < 2:
        raise InputError(f"environment must be (height, width, 3) with at least 2 x 2 pixels, not {environment.shape}")
    h, w = environment.shape[:2]
    x, y, z = np.moveaxis(direction, -1, 0)
    column = (0.5 + np.arctan2(-x, y) / (2 * np.pi)) * w - 0.5
    row = np.arccos(np.clip(z, -1.0, 1.0)) / np.pi * h - 0.5
    i, j = np.floor(column), np.clip(np.floor(row), 0, h - 2)
    u, v = (column - i)[..., None], np.clip(row - j, 0.0, 1.0)[..., None]
    i0, j0 = i.astype(np.int64) % w, j.astype(np.int64)
    i1 = (i0 + 1) % w
    top = environment[j0, i0] * (1 - u) + environment[j0, i1] * u
    low = environment[j0 + 1, i0] * (1 - u) + environment[j0 + 1, i1] * u
    return np.asarray(top * (1 - v) + low * v, dtype=np.float32)


def reflections(gb: GBuffer, environment: NDArray[np.float32]) -> NDArray[np.float32]:
    """(h, w, 3) float32: what each pixel's surface mirrors, r = d - 2 (d.n) n for a view ray d; 0 where nothing was hit."""
    w, h = gb.camera.size
    ray = gb.camera.rays()[3:]
    px, py = np.arange(w)[None, :, None] + 0.5, np.arange(h)[:, None, None] + 0.5
    view = np.broadcast_to(ray[0] + px * ray[1] + py * ray[2], (h, w, 3))
    view = view / np.linalg.norm(view, axis=2, keepdims=True)
    mirrored = view - 2.0 * np.einsum("yxc,yxc->yx", view, gb.normal)[..., None] * gb.normal
    return np.where(gb.mask[..., None], look_up(environment, mirrored.astype(np.float32)), np.float32(0.0))
