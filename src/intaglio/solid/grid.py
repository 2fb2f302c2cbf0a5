"""The grid that a mesh is converted to."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.errors import InputError
from intaglio.mesh import TriangleMesh
from intaglio.volume import Volume

# Room around the mesh on each side, as a part of its longest extent: what the default band of a distance field needs.
MARGIN = 0.05
LARGEST = 2**36

Shape = tuple[int, int, int]


def extent_of(mesh: TriangleMesh) -> float:
    """Longest side of the mesh's bounding box, mm."""
    # Column by column: along the short axis numpy takes ten times as long.
    longest = max(float(np.ptp(mesh.vertices[:, k])) for k in range(3))
    if longest == 0.0:
        raise InputError(f"{mesh.name}: all vertices are in one place; a solid needs an extent")
    return longest


def grid_around(
    mesh: TriangleMesh, resolution: int | None, spacing: float | None, like: Volume | None
) -> tuple[Shape, NDArray[np.float64]]:
    """Shape (z, y, x) and world_from_index of the grid of `like`, or of one of cubic voxels around the mesh."""
    if sum(choice is not None for choice in (resolution, spacing, like)) != 1:
        raise InputError("exactly one of resolution=, spacing= and like= must be given")
    longest = extent_of(mesh)
    if like is not None:
        if not isinstance(like, Volume):
            raise InputError(f"like must be a Volume, not {like!r}")
        return like.shape, like.world_from_index
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    room = 2 * MARGIN * longest
    if resolution is not None:
        if not isinstance(resolution, (int, np.integer)) or not 4 <= resolution <= 4096:
            raise InputError(f"resolution must be a whole number of voxels, 4 to 4096, not {resolution!r}")
        step = (longest + room) / (resolution - 1)
    else:
        assert spacing is not None
        step = float(spacing)
        if not (math.isfinite(step) and step > 0):
            raise InputError(f"spacing must be a positive number of mm, not {spacing!r}")
    # A rounding error must not add a voxel.
    count = np.ceil((high - low + room) / step * (1 - 1e-12)) + 1
    if np.prod(count) > LARGEST:
        raise InputError(f"spacing {step:g} mm makes a grid of {'x'.join(f'{n:.0f}' for n in count)} voxels; take a larger one")
    matrix = np.diag([step, step, step, 1.0])
    matrix[:3, 3] = (low + high - (count - 1) * step) / 2
    x, y, z = (max(2, int(n)) for n in count)
    return (z, y, x), matrix
