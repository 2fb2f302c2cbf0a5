"""read_mesh: any surface model as triangles."""

from __future__ import annotations

import logging
import os
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from intaglio.errors import InputError
from intaglio.mesh import TriangleMesh, merge_vertices

if TYPE_CHECKING:
    from intaglio.compute import Progress

KINDS = (".stl", ".ply", ".obj", ".off", ".gltf", ".glb")
# These store a vertex once for each triangle, material or texture coordinate, so what is joined can only be told by position.
_SPLIT = (".stl", ".obj", ".gltf", ".glb")

Vertices = NDArray[np.float64]
Triangles = NDArray[np.int64]


@contextmanager
def _silent() -> Iterator[None]:
    """trimesh logs, and numpy warns on what its parsers try; what matters arrives as an exception."""
    log = logging.getLogger("trimesh")
    before = log.disabled
    log.disabled = True
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        log.disabled = before


def _load(path: Path) -> Any:
    """A trimesh scene. Files that it names are looked for in its own folder only, images not at all."""
    import trimesh

    kind = path.suffix.lower()
    resolver = trimesh.resolvers.FilePathResolver(str(path)) if kind == ".gltf" else None
    options: dict[str, Any] = {".ply": {"fix_texture": False}}.get(kind, {})
    try:
        with _silent(), path.open("rb") as file:
            return trimesh.load_scene(
                file, file_type=kind[1:], resolver=resolver, process=False, skip_materials=True, allow_remote=False, **options
            )
    except OSError as error:
        if error.strerror:
            raise
        raise InputError(f"{path.name}: is broken, or a file that it names is missing ({error}); get all its files") from None
    except Exception as error:
        # trimesh wants to guess an encoding for what is neither text nor the binary form.
        reason = (
            "its bytes make no sense"
            if isinstance(error, ImportError)
            else " ".join(str(error).split(" \u2014 ")[0].split())[:160]
        )
        raise InputError(f"{path.name}: cannot be read as {kind[1:].upper()}: {reason}; check that the file is whole") from None


def _strip_triangles(strips: NDArray[Any]) -> Triangles:
    """Triangles of strips that -1 ends; every second triangle of a strip is turned."""
    indices = np.asarray(strips, dtype=np.int64)
    corners = np.stack([indices[:-2], indices[1:-1], indices[2:]], axis=1)
    start = np.maximum.accumulate(np.where(indices == -1, np.arange(len(indices)) + 1, 0))[:-2]
    odd = (np.arange(len(corners)) - start) % 2 == 1
    corners[odd] = corners[odd][:, [1, 0, 2]]
    a, b, c = corners.T
    # Strips are joined by triangles that use a vertex twice.
    return corners[(corners >= 0).all(axis=1) & (a != b) & (b != c) & (c != a)]


def _parts(scene: Any) -> tuple[Vertices, Triangles, bool]:
    """Vertices and triangles of all parts in their places, and whether any part is only points."""
    vertices: list[Vertices] = []
    triangles: list[Triangles] = []
    count = 0
    points = False
    for node in scene.graph.nodes_geometry:
        place, part_name = scene.graph[node]
        part = scene.geometry[part_name]
        faces = getattr(part, "faces", None)
        strips = part.metadata.get("_ply_raw", {}).get("tristrips", {}).get("data")
        if faces is None and strips is not None and len(strips):
            faces = np.concatenate([_strip_triangles(row[0][1]) for row in strips])
        if faces is None or len(faces) == 0:
            points = True
            continue
        local = np.asarray(part.vertices, dtype=np.float64)
        vertices.append(local @ place[:3, :3].T + place[:3, 3])
        corners = np.asarray(faces, dtype=np.int64)
        # A mirrored part would otherwise be inside out.
        triangles.append((corners[:, ::-1] if np.linalg.det(place[:3, :3]) < 0 else corners) + count)
        if corners.min() < 0 or corners.max() >= len(local):
            raise InputError(f"triangles name vertices outside 0..{len(local) - 1}; the file is broken")
        count += len(local)
    if not triangles:
        return np.empty((0, 3)), np.empty((0, 3), dtype=np.int64), points
    return np.concatenate(vertices), np.concatenate(triangles), points


def _promised_faces(path: Path, scene: Any) -> int:
    """Faces according to the header of a PLY or OFF file; trimesh passes over those that are missing."""
    if path.suffix.lower() == ".ply":
        return sum(part.metadata.get("_ply_raw", {}).get("face", {}).get("length", 0) for part in scene.geometry.values())
    if path.suffix.lower() != ".off":
        return 0
    with path.open(encoding="latin-1") as file:
        text = " ".join(line.split("#", 1)[0] for line in islice(file, 100))
    numbers = re.findall(r"\d+", text.split("OFF", 1)[-1])
    return int(numbers[1]) if len(numbers) > 1 else 0


def _outwards(mesh: TriangleMesh) -> TriangleMesh:
    """A closed mesh turned so that its normals point outwards."""
    report = mesh.report
    if not (report.closed and report.manifold and report.oriented):
        return mesh
    a, b, c = (mesh.vertices[corner] - mesh.vertices.mean(axis=0) for corner in mesh.triangles.T)
    if np.einsum("ij,ij->i", a, np.cross(b, c)).sum() >= 0:
        return mesh
    return replace(mesh, triangles=mesh.triangles[:, ::-1].copy(), notes=(*mesh.notes, "triangles faced inwards: turned round"))


def read_mesh(path: str | os.PathLike[str], progress: Progress | None = None) -> TriangleMesh:
    """A mesh from an STL, PLY, OBJ, OFF, glTF or glb file, its coordinates taken as RAS+ mm.

    Scenes become one mesh, polygons and strips become triangles. The mesh's notes tell what it is not (closed,
    manifold, ...: its report) and what was changed. progress is called with steps done and in all.
    Raises InputError where there are no triangles, or the file cannot be understood.
    """
    path = Path(os.path.abspath(path))
    name = path.name
    if path.suffix.lower() not in KINDS:
        raise InputError(f"{name}: kind must be one of {' '.join(KINDS)}, not {path.suffix!r}")
    try:
        if not path.exists():
            raise InputError(f"{path}: no such file; check the path")
        if path.is_file() and path.stat().st_size == 0:
            raise InputError(f"{name}: is empty; get the file again")
        scene = _load(path)
    except OSError as error:
        raise InputError(f"{name}: cannot be read ({error.strerror}); check its permissions") from None
    if progress:
        progress(1, 3)
    try:
        vertices, triangles, points = _parts(scene)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    if len(triangles) == 0:
        what = "holds points without faces" if points else "holds no faces"
        raise InputError(f"{name}: {what}; export it as a mesh of triangles")
    used = np.zeros(len(vertices), dtype=bool)
    used[triangles] = True
    bad = ~np.isfinite(vertices).all(axis=1)
    if (bad & used).any():
        raise InputError(f"{name}: {(bad & used).sum()} vertices are NaN or infinite; repair or remove their triangles")
    # What no triangle uses would only widen the bounding box.
    place = np.cumsum(used) - 1
    vertices, triangles = vertices[used], place[triangles]
    notes = []
    if path.suffix.lower() in _SPLIT:
        vertices, triangles = merge_vertices(vertices, triangles)
    if path.suffix.lower() in (".gltf", ".glb"):
        notes.append("glTF lengths are metres: taken as millimetres")
    promised = _promised_faces(path, scene)
    if len(triangles) < promised:
        raise InputError(f"{name}: expected {promised} faces, found {len(triangles)}; the file is truncated, get it again")
    if progress:
        progress(2, 3)
    mesh = _outwards(TriangleMesh(vertices, triangles.astype(np.int32), name, tuple(notes)))
    mesh = replace(mesh, notes=(*mesh.notes, *mesh.report.caveats))
    if progress:
        progress(3, 3)
    return mesh
