"""TriangleMesh: a surface model."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intaglio.errors import InputError


@dataclass(frozen=True)
class MeshReport:
    """What kind of surface a mesh is; `caveats` says in words what it is not."""

    closed: bool
    manifold: bool
    oriented: bool
    components: int
    boundary_edges: int
    nonmanifold_edges: int
    degenerate_triangles: int

    @property
    def caveats(self) -> tuple[str, ...]:
        lines = []
        if self.boundary_edges:
            lines.append(f"open: {self.boundary_edges} boundary edges")
        if not self.manifold:
            lines.append(f"not manifold: {self.nonmanifold_edges} edges with more than two triangles")
        if not self.oriented:
            lines.append("triangles of one surface face different ways")
        if self.degenerate_triangles:
            lines.append(f"{self.degenerate_triangles} triangles without area")
        return tuple(lines)


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Triangles in RAS+ millimetres.

    vertices   (n, 3) float64
    triangles  (m, 3) int32 indices into vertices, counter-clockwise seen from outside
    normals    (n, 3) float32, unit and outwards, of the surface that the mesh stands for; or None
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    name: str = "mesh"
    notes: tuple[str, ...] = field(default=())
    normals: NDArray[np.float32] | None = None

    def __post_init__(self) -> None:
        vertices = np.ascontiguousarray(self.vertices, dtype=np.float64)
        triangles = np.asarray(self.triangles)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise InputError(f"{self.name}: vertices must be (n, 3) finite numbers, not {vertices.shape}")
        if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) == 0:
            raise InputError(f"{self.name}: triangles must be (m, 3) with m > 0, not {triangles.shape}")
        if triangles.dtype.kind not in "iu":
            raise InputError(f"{self.name}: triangles must be integers, not {triangles.dtype}")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            raise InputError(f"{self.name}: triangles name vertices outside 0..{len(vertices) - 1}")
        if self.normals is not None and self.normals.shape != vertices.shape:
            raise InputError(f"{self.name}: normals must be one for each vertex, {vertices.shape}, not {self.normals.shape}")
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", np.ascontiguousarray(triangles, dtype=np.int32))

    @property
    def corners(self) -> NDArray[np.float64]:
        """(8, 3) corners of the bounding box."""
        low, high = self.vertices.min(axis=0), self.vertices.max(axis=0)
        return np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])

    @cached_property
    def report(self) -> MeshReport:
        """Closed, manifold, consistently oriented, components; from the edges alone."""
        a, b, c = self.triangles.T
        live = (a != b) & (b != c) & (c != a)
        p, q, r = self.vertices[a], self.vertices[b], self.vertices[c]
        area = np.linalg.norm(np.cross(q - p, r - p), axis=1)
        flat = int((~live | (area == 0.0)).sum())
        directed = np.concatenate([np.stack(e, axis=1) for e in ((a[live], b[live]), (b[live], c[live]), (c[live], a[live]))])
        _, inverse, uses = np.unique(np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True)
        forward = np.bincount(inverse.ravel(), weights=directed[:, 0] < directed[:, 1], minlength=len(uses))
        paired = uses == 2
        return MeshReport(
            closed=bool((uses % 2 == 0).all()) and len(uses) > 0,
            manifold=not (uses > 2).any(),
            oriented=bool((forward[paired] == 1).all()),
            components=self._components(directed),
            boundary_edges=int((uses == 1).sum()),
            nonmanifold_edges=int((uses > 2).sum()),
            degenerate_triangles=flat,
        )

    def save(self, path: str | PathLike[str]) -> None:
        """Write .stl, .ply, .obj or .glb, chosen by the extension, in RAS+ mm; the file appears only when it is complete."""
        from intaglio.io.mesh_files import save_mesh

        save_mesh(self, path)

    def _components(self, edges: NDArray[np.int32]) -> int:
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        n = len(self.vertices)
        graph = coo_array((np.ones(len(edges), dtype=bool), (edges[:, 0], edges[:, 1])), shape=(n, n))
        _, label = connected_components(graph, directed=False)
        return len(np.unique(label[edges[:, 0]]))


def merge_vertices(vertices: NDArray[np.float64], triangles: NDArray[Any]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """One vertex for each position, exactly compared; vertices (n, 3), triangles (m, 3)."""
    order = np.lexsort(vertices.T)
    ordered = vertices[order]
    new = np.concatenate([[True], (ordered[1:] != ordered[:-1]).any(axis=1)])
    place = np.empty(len(vertices), dtype=np.int64)
    place[order] = np.cumsum(new) - 1
    return ordered[new], place[triangles]
