"""Saving meshes: STL, PLY, OBJ, glTF, whole or not at all."""

from __future__ import annotations

from os import PathLike

from intaglio.io.plates import check_output, write_whole
from intaglio.mesh import TriangleMesh

SAVED = (".stl", ".ply", ".obj", ".glb")


def save_mesh(mesh: TriangleMesh, path: str | PathLike[str]) -> None:
    """Write .stl (binary), .ply (binary), .obj or .glb, normals where the mesh has them; mm, RAS+. InputError as check_output."""
    import trimesh

    target = check_output(path, SAVED)
    kind = target.suffix.lower()[1:]
    model = trimesh.Trimesh(mesh.vertices, mesh.triangles, vertex_normals=mesh.normals, process=False)
    options = {"stl": {}, "glb": {}, "ply": {"vertex_normal": True}, "obj": {"include_normals": True}}[kind]
    if mesh.normals is None:
        options = {}
    data = model.export(file_type=kind, **options)
    write_whole(target, data if isinstance(data, bytes) else data.encode())
