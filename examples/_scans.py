"""Where the pictures' scans and meshes come from: a folder of real ones if there is one, else the embedded head, and a knot."""

from __future__ import annotations

import tarfile
import tempfile
from pathlib import Path

import numpy as np

import intaglio as ig
from intaglio.datasets import head


def scan(data: Path | None, name: str) -> tuple[ig.Volume, bool]:
    """A volume from data/volumes, and whether it is the one that was asked for; the embedded head otherwise.

    A ".tar.xz" is unpacked to a temporary folder and read as the series in it.
    """
    path = None if data is None else data / "volumes" / name
    if path is None or not path.exists():
        return head(), False
    if path.suffix != ".xz":
        return ig.read_volume(path), True
    with tempfile.TemporaryDirectory() as folder, tarfile.open(path) as archive:
        archive.extractall(folder, filter="data")
        return ig.read_volume(folder), True


def model(data: Path | None, name: str, *, up: str = "z") -> ig.TriangleMesh:
    """A mesh from data/meshes, turned to RAS where it stands on y and looks along z; a knot otherwise."""
    path = None if data is None else data / "meshes" / name
    if path is None or not path.exists():
        return knot()
    mesh = ig.read_mesh(path)
    return mesh if up == "z" else ig.TriangleMesh(mesh.vertices[:, [0, 2, 1]] * (-1, 1, 1), mesh.triangles, mesh.name)


def knot(around: int = 240, across: int = 32) -> ig.TriangleMesh:
    """A tube along a trefoil, closed, mm."""
    t = np.linspace(0, 2 * np.pi, around, endpoint=False)
    line = 20 * np.stack([np.sin(t) + 2 * np.sin(2 * t), np.sin(3 * t), np.cos(t) - 2 * np.cos(2 * t)], axis=1)
    along = np.roll(line, -1, axis=0) - np.roll(line, 1, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    side = np.cross(along, line)
    side /= np.linalg.norm(side, axis=1)[:, None]
    a = np.linspace(0, 2 * np.pi, across, endpoint=False)
    turn = np.cos(a)[None, :, None] * side[:, None] + np.sin(a)[None, :, None] * np.cross(along, side)[:, None]
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    k, m = (i + 1) % around, (j + 1) % across
    p, q, r, s = (u * across + v for u, v in ((i, j), (k, j), (k, m), (i, m)))
    triangles = np.concatenate([np.stack([p, q, r], axis=-1), np.stack([p, r, s], axis=-1)]).reshape(-1, 3)
    vertices = (line[:, None] + 11 * turn).reshape(-1, 3)
    return ig.TriangleMesh(vertices, triangles[:, ::-1], "knot")
