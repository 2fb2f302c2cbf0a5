"""Tools that cut, shown as ghosts: glass whose rim can be seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from intaglio.camera import Camera
from intaglio.lighting import Light
from intaglio.rendering.isosurface import isosurface
from intaglio.selection import Selection

COLOUR = (0.25, 0.45, 0.75)
# Opacity of glass seen face on, as a part of that of its rim.
FACE_ON = 0.12


def ghosts(selections: Sequence[Selection], camera: Camera, opacity: float, lights: Sequence[Light]) -> NDArray[np.float32]:
    """(h, w, 5) where along `Camera.rays` the nearest tool begins, its lit straight colour and its opacity.

    Planes have no shape that could be shown. The depth is inf where there is no tool.
    """
    w, h = camera.size
    out = np.zeros((h, w, 5), dtype=np.float32)
    out[..., 0] = np.inf
    rays = camera.rays()
    x, y = np.arange(w) + 0.5, np.arange(h)[:, None] + 0.5
    along = sum(float(camera.forward[c]) * (rays[3, c] + x * rays[4, c] + y * rays[5, c]) for c in range(3))
    for selection in selections:
        if selection.tool is None:
            continue
        tool = replace(selection.tool, world_from_index=selection.world_from_tool @ selection.tool.world_from_index)
        if selection.binary:
            gb = isosurface(replace(tool, array=(tool.array > 0).astype(np.uint8)), 0.5, camera, lights=lights)
        else:
            gb = isosurface(tool, 0.0, camera, lights=lights, inside="below")
        t = gb.depth / along
        nearer = t < out[..., 0]
        rim = FACE_ON + (1.0 - FACE_ON) * (1.0 - gb.facing[nearer]) ** 3
        ambient, diffuse, specular = gb.light[nearer].T
        colour = np.array(COLOUR) * (ambient + diffuse)[:, None] + specular[:, None]
        out[nearer] = np.column_stack([t[nearer], np.clip(colour, 0.0, 1.0), opacity * rim])
    return out
