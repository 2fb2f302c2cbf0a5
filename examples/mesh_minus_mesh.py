"""A bunny taken out of a skull: two meshes, each on a grid of its own, and the difference of their distances."""

from pathlib import Path

import numpy as np

import intaglio as ig

LIGHTS = (ig.Light(intensity=0.7), ig.Light(direction=(0.7, 0.0, 0.7), intensity=0.3))
LOOK = {"inside": "below", "lights": LIGHTS, "material": ig.Material(ambient=0.18)}


def ball(radius: float) -> ig.TriangleMesh:
    """Where there are no meshes."""
    z, y, x = np.mgrid[-1.2:1.2:40j, -1.2:1.2:40j, -1.2:1.2:40j] * radius
    distance = np.sqrt(x * x + y * y + z * z).astype(np.float32) - np.float32(radius)
    return ig.surface(ig.Volume.from_array(distance, 2.4 * radius / 39))


def mesh(data: Path | None, name: str, radius: float) -> ig.TriangleMesh:
    path = None if data is None else data / "meshes" / name
    return ig.read_mesh(path) if path is not None and path.exists() else ball(radius)


def moved(field: ig.Volume, scale: float, turn: np.ndarray, to: np.ndarray) -> ig.Volume:
    """A distance field in another place and size: its distances grow with it, its samples stay."""
    pose = np.eye(4)
    pose[:3, :3] = scale * turn
    pose[:3, 3] = to - pose[:3, :3] @ field.corners.mean(axis=0)
    return ig.Volume(field.array * np.float32(scale), pose @ field.world_from_index)


# The skull's file has y upwards and z to the front.
UPRIGHT = np.array([[-1.0, 0, 0], [0, 0, 1], [0, 1, 0]])
# The bunny's left side to the viewer.
SIDEWAYS = np.array([[-0.78, 0.62, 0], [-0.62, -0.78, 0], [0, 0, 1]])


def make(data: Path | None, size: int) -> ig.Image:
    skull = ig.distance_field(mesh(data, "skull.obj", 50.0), resolution=256, band="full")
    bunny = ig.distance_field(mesh(data, "bunny_watertight.obj", 30.0), resolution=160, band="full")
    skull = moved(skull, 1.0, UPRIGHT, np.zeros(3))
    extent = skull.corners.max(axis=0) - skull.corners.min(axis=0)
    scale = 0.55 * float(extent.max() / np.ptp(bunny.corners, axis=0).max())
    carved = ig.difference(skull, moved(bunny, scale, SIDEWAYS, extent * (-0.26, 0.2, 0.22)))
    camera = ig.Camera.looking((-0.8, 1.0, 0.35), carved, 2 * size, zoom=1.2)
    return ig.shade(ig.isosurface(carved, 0.0, camera, **LOOK), colour=(0.98, 0.94, 0.84), reduce=2)
