"""A mesh's distance field: cut through, red outside and green inside; levels outside; levels inside."""

from pathlib import Path

import numpy as np
from _scans import model

import intaglio as ig

BONE, RED, GREEN = (0.93, 0.86, 0.72), (0.85, 0.25, 0.2), (0.25, 0.65, 0.3)
LIGHTS = (ig.Light(direction=(-0.5, 0.7, 0.6), intensity=0.85), ig.Light(direction=(0.8, 0.1, 0.5), intensity=0.2))
VIEW = (-0.55, -1.0, 0.2)


def bands(low: float, high: float, step: float) -> ig.TransferFunction:
    """Opaque, in stripes as wide as a step, a line where the surface is."""
    edges = np.arange(np.floor(low / step), np.ceil(high / step) + 1)
    points = []
    for edge in edges[:-1]:
        light = 0.12 if edge % 2 else 0.0
        colour = tuple(c + (1 - c) * light for c in (RED if edge >= 0 else GREEN))
        points += [(edge * step, colour, 1.0), ((edge + 1) * step, colour, 1.0)]
    return ig.TransferFunction.from_points(points, name="bands")


def make(data: Path | None, size: int) -> ig.Image:
    mesh = model(data, "bunny_watertight.obj")
    field = ig.distance_field(mesh, resolution=200, band="full")
    low, high = field.range
    step = -low / 6
    camera = ig.Camera.looking(VIEW, field, size * 3 // 5)
    half = ig.Selection.plane(mesh.vertices.mean(axis=0), (0, -1, 0))
    section = ig.render(field, bands(low, high, step), camera, lit=False, selections=[half])
    outside = [(0.0, BONE, 1.0), (0.5 * step, RED, 0.3), (step, RED, 0.3)]
    inside = [(0.0, BONE, 0.2), (-step, GREEN, 0.3), (-2 * step, GREEN, 0.4), (-3 * step, GREEN, 1.0)]
    shells = [ig.render(field, None, camera, mode="isosurface", surfaces=s, lights=LIGHTS) for s in (outside, inside)]
    return ig.Image(np.concatenate([picture.array for picture in (section, *shells)], axis=1))
