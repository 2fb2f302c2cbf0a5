"""A plain shaded picture of a G-buffer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from intaglio.drawing import Image
from intaglio.errors import InputError
from intaglio.gbuffer import GBuffer
from intaglio.rendering.reflection import reflections


def shade(
    gb: GBuffer,
    *,
    colour: tuple[float, float, float] = (1.0, 0.98, 0.94),
    background: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0),
    reduce: int = 1,
    environment: NDArray[np.float32] | None = None,
    mirror: float = 0.35,
) -> Image:
    """Ambient and diffuse light times colour, plus white highlights; over the background.

    environment  (height, width, 3) latitude-longitude map that the surface mirrors; see `reflection.look_up`
    mirror       how much of it, 0..1; more at grazing angles (Schlick 1994)
    reduce  each picture pixel is the mean of reduce x reduce pixels of the G-buffer, which smooths its edges
    """
    h, w = gb.depth.shape
    if not 1 <= reduce <= min(h, w):
        raise InputError(f"reduce must be between 1 and the image's side, not {reduce!r}")
    rgba = np.empty((h, w, 4), dtype=np.float32)
    body = gb.light[..., 0] + gb.light[..., 1]
    rgba[..., :3] = np.clip(body[..., None] * np.asarray(colour, dtype=np.float32) + gb.light[..., 2, None], 0.0, 1.0)
    if environment is not None:
        if not 0 <= mirror <= 1:
            raise InputError(f"mirror must be between 0 and 1, not {mirror!r}")
        part = mirror + (1.0 - mirror) * mirror * (1.0 - np.clip(gb.facing, 0.0, 1.0)) ** 5
        rgba[..., :3] += part[..., None] * (reflections(gb, environment) - rgba[..., :3])
    rgba[..., 3] = 1.0
    rgba[~gb.mask] = background
    if reduce > 1:
        h, w = h // reduce, w // reduce
        rgba = rgba[: h * reduce, : w * reduce].reshape(h, reduce, w, reduce, 4).mean(axis=(1, 3))
    return Image(rgba)
